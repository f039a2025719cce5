"""The most pixels of a picture or map that is stored in a data set, or imported into one."""

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
    """Raise UserError for a file of more pixels than the limit; to be called before its pixels are unpacked."""
    most = limits.MAX_STORED_PIXELS
    if width * height > most:
        raise UserError(f"expected at most {most:,} pixels (limit MAX_STORED_PIXELS), found {width:,} x {height:,}; {RAISE}")


RAISE = "set VIEWSPHERE_MAX_STORED_PIXELS higher if it is meant so"


@contextmanager
def opened(file: Path | IO[bytes]) -> Generator[Image]:
    """A picture as Pillow opens it, whose pixels are not unpacked yet; raises UserError for one beyond the limit, and Pillow's
    OSError, ValueError or SyntaxError for a damaged one.
    """
    from PIL import Image

    with ExitStack() as then:
        then.enter_context(warnings.catch_warnings())
        warnings.simplefilter("ignore")  # Pillow's, of tags that it skips, would stand among our own lines
        stream = then.enter_context(open_file(file, "MAX_PICTURE_BYTES")) if isinstance(file, PurePath) else file
        limit, Image.MAX_IMAGE_PIXELS = Image.MAX_IMAGE_PIXELS, None  # Pillow has no other way; ours is checked at once
        try:
            image = then.enter_context(Image.open(stream))
        finally:
            Image.MAX_IMAGE_PIXELS = limit
        check_size(*image.size)
        try:
            yield image
        except Image.DecompressionBombError as error:  # what Pillow unpacks at once, as a TIFF's tile, has a limit of its own
            raise ValueError(str(error)) from None
