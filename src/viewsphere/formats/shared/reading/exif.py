"""Pictures of other tools whose EXIF tag says how a viewer is to turn them: labels speak of what viewers show."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from viewsphere.codecs.orientation import SWAPPED, UPRIGHT, orientation
from viewsphere.codecs.png_tiff import encode_png
from viewsphere.codecs.size import opened
from viewsphere.store.foreign import Loaded

Size = tuple[int, int]


def shown_size(file: Path, told: object = None) -> Size:
    """Width and height of a picture as it is shown: turned as its tag says, unless the size that labels tell, (width, height),
    is that of the pixels as they are stored and not the other. Raises what `viewsphere.codecs.size.opened` does.
    """
    with opened(file) as picture:
        width, height = picture.size
        is_turned = orientation(picture) in SWAPPED and told != (width, height)
    return (height, width) if is_turned else (width, height)


def upright(file: Path, size: Size) -> Path | Loaded:
    """A picture of this shown size, which every reader shows alike: the file itself, or a PNG where a tag turns it."""
    from PIL import ImageOps

    with opened(file) as picture:
        turn = orientation(picture)
        if turn == UPRIGHT:
            return file
        is_stored = turn in SWAPPED and picture.size == size != size[::-1]
        found = picture if is_stored else ImageOps.exif_transpose(picture)
        return Loaded(".png", encode_png(np.asarray(found.convert("RGB"))))
