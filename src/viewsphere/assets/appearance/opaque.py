"""Pictures of opaque surfaces, from files that a recipe names."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.paths.folder import SHARPEST, UnreadableError, decode_image, reduced
from viewsphere.errors import RecipeError
from viewsphere.files import read_bytes

Stamp = tuple[int, int]
"""A file's size in bytes and its modification time in nanoseconds, which differs after the file has changed."""


def stamp_of(path: str, field: str) -> Stamp:
    """The stamp of a file that a recipe's field names; raises RecipeError if the file does not exist."""
    try:
        found = Path(path).stat()
    except OSError as error:
        raise RecipeError(f"{field}: expected an image file, found {error.strerror}: {path}") from None
    return found.st_size, found.st_mtime_ns


def opaque_picture(path: str, field: str, *, upright: bool = False, on_white: bool = False) -> NDArray[np.uint8]:
    """The picture in a file that a recipe's field names, (H, W, 4) uint8 sRGB, alpha 255, at most `SHARPEST` texels a side.

    upright: a photograph is rotated by its EXIF orientation. on_white: transparent parts show white, otherwise their hidden
    colour. Raises RecipeError for a picture that cannot be read.
    """
    try:
        pixels = reduced(decode_image(read_bytes(Path(path), "MAX_PICTURE_BYTES"), path, upright=upright), SHARPEST)
    except UnreadableError as error:
        raise RecipeError(f"{field}: expected a readable image; {error}: mend or replace it") from None
    except OSError as error:
        raise RecipeError(f"{field}: expected a readable image, found {error.strerror}: {path}") from None
    if on_white and pixels[..., 3].min() < 255:
        alpha = pixels[..., 3:].astype(np.uint16)
        pixels[..., :3] = (pixels[..., :3] * alpha + 255 * (255 - alpha) + 127) // 255
    pixels[..., 3] = 255
    return pixels
