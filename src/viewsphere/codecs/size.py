"""The pixel limit of pictures and maps that are stored in a data set or imported into one."""

from __future__ import annotations

import warnings
from collections.abc import Generator
from contextlib import ExitStack, contextmanager
from pathlib import Path, PurePath
from typing import IO, TYPE_CHECKING

from viewsphere.errors import UserError
from viewsphere.files import open_file
from viewsphere.limits import limits

if TYPE_CHECKING:
    from PIL.Image import Image


def check_size(width: int, height: int) -> None:
    """Raise UserError for a file of more pixels than the limit. Call this before unpacking its pixels."""
    most = limits.MAX_STORED_PIXELS
    if width * height > most:
        raise UserError(f"expected at most {most:,} pixels (limit MAX_STORED_PIXELS), found {width:,} x {height:,}; {RAISE}")


RAISE = "set VIEWSPHERE_MAX_STORED_PIXELS higher if it is meant so"


@contextmanager
def opened(file: Path | IO[bytes]) -> Generator[Image]:
    """A picture opened by Pillow, with its pixels not unpacked yet. Raises UserError if it exceeds the limit, and Pillow's
    OSError, ValueError or SyntaxError if it is damaged.
    """
    from PIL import Image

    with ExitStack() as then:
        then.enter_context(warnings.catch_warnings())
        warnings.simplefilter("ignore")  # Pillow's warnings of skipped tags would appear among our own output
        stream = then.enter_context(open_file(file, "MAX_PICTURE_BYTES")) if isinstance(file, PurePath) else file
        limit, Image.MAX_IMAGE_PIXELS = Image.MAX_IMAGE_PIXELS, None  # Pillow has no other way; ours is checked at once
        try:
            image = then.enter_context(Image.open(stream))
        finally:
            Image.MAX_IMAGE_PIXELS = limit
        check_size(*image.size)
        try:
            yield image
        except Image.DecompressionBombError as error:  # Pillow's own limit for blocks unpacked at once, such as a TIFF's tile
            raise ValueError(str(error)) from None
