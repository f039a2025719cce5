"""EXIF's orientation, the rotation for the display of a picture.

https://www.cipa.jp/std/documents/e/DC-008-2012_E.pdf, section 4.6.4 A.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from PIL.Image import Image

UPRIGHT = 1
SWAPPED = (5, 6, 7, 8)
"""Orientations in which width and height change places."""

_TAG = 0x0112


def orientation(picture: Image) -> int:
    """A picture's orientation, 1 to 8; 1 if none can be read."""
    try:
        found = int(picture.getexif().get(_TAG, UPRIGHT))
    except Exception:  # the parser of a damaged block may raise anything
        return UPRIGHT
    return found if found in range(1, 9) else UPRIGHT
