"""Constants shared by texture look-ups and shading: wrap modes, and the compiler's liberties with colours."""

from __future__ import annotations

FAST = {"contract", "arcp", "nsz", "afn", "reassoc"}
REPEAT, CLAMP, MIRROR = 0, 1, 2
