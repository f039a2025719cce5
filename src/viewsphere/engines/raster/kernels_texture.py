"""What texture look-ups and shading share: wrap modes, and what the compiler may do to colours."""

from __future__ import annotations

FAST = {"contract", "arcp", "nsz", "afn", "reassoc"}
REPEAT, CLAMP, MIRROR = 0, 1, 2
