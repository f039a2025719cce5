"""Pictures of other tools with an EXIF rotation: labels describe the rotated picture that viewers show."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from viewsphere.codecs.orientation import SWAPPED, UPRIGHT, orientation
from viewsphere.codecs.png_tiff import encode_png
from viewsphere.codecs.size import opened
from viewsphere.store.foreign import Loaded

Size = tuple[int, int]


def shown_size(file: Path, told: object = None) -> Size:
    """Width and height of a picture as shown: rotated by its tag, unless the size in the labels, (width, height), fits only
    the pixels as stored. Raises the same errors as `viewsphere.codecs.size.opened`.
    """
    with opened(file) as picture:
        width, height = picture.size
        is_turned = orientation(picture) in SWAPPED and told != (width, height)
    return (height, width) if is_turned else (width, height)


def upright(file: Path, size: Size) -> Path | Loaded:
    """A picture of this shown size that all readers show alike: the file itself, or a PNG if a tag rotates it."""
    from PIL import ImageOps

    with opened(file) as picture:
        turn = orientation(picture)
        if turn == UPRIGHT:
            return file
        is_stored = turn in SWAPPED and picture.size == size != size[::-1]
        found = picture if is_stored else ImageOps.exif_transpose(picture)
        return Loaded(".png", encode_png(np.asarray(found.convert("RGB"))))
