"""Pictures, which become upright planes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from viewsphere.plugins.reader import ReaderSpec

if TYPE_CHECKING:
    from viewsphere.assets.mesh import Mesh
    from viewsphere.assets.paths.folder import ModelFolder
    from viewsphere.assets.primitive import FileFacts


def _read(folder: ModelFolder) -> tuple[Mesh, FileFacts]:
    """The model, see `reading.read_picture`."""
    from viewsphere.assets.readers.picture.reading import read_picture

    return read_picture(folder)


READER = ReaderSpec(
    about="PNG, JPEG, WebP, BMP, TIFF",
    suffixes=("bmp", "jpeg", "jpg", "png", "tif", "tiff", "webp"),
    axes=("+z", "-y"),
    unit="1 m",
    is_picture=True,
    read=_read,
    modules=("viewsphere.assets.readers.picture.reading",),
)
