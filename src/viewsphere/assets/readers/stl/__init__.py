"""STL, text and binary."""

from __future__ import annotations

from typing import TYPE_CHECKING

from viewsphere.plugins.reader import ReaderSpec

if TYPE_CHECKING:
    from viewsphere.assets.mesh import Mesh
    from viewsphere.assets.paths.folder import ModelFolder
    from viewsphere.assets.primitive import FileFacts


def _read(folder: ModelFolder) -> tuple[Mesh, FileFacts]:
    """The model, see `reading.read_stl`."""
    from viewsphere.assets.readers.stl.reading import read_stl

    return read_stl(folder)


READER = ReaderSpec(
    about="STL",
    suffixes=("stl",),
    axes=("+z", "-y"),
    assumes_up=True,
    unit="1 m",
    read=_read,
    modules=("viewsphere.assets.readers.stl.reading",),
)
