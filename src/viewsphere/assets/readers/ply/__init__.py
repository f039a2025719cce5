"""PLY, ASCII and binary."""

from __future__ import annotations

from typing import TYPE_CHECKING

from viewsphere.plugins.reader import ReaderSpec

if TYPE_CHECKING:
    from viewsphere.assets.mesh import Mesh
    from viewsphere.assets.paths.folder import ModelFolder
    from viewsphere.assets.primitive import FileFacts


def _read(folder: ModelFolder) -> tuple[Mesh, FileFacts]:
    """The model, see `reading.read_ply`."""
    from viewsphere.assets.readers.ply.reading import read_ply

    return read_ply(folder)


READER = ReaderSpec(
    about="PLY",
    suffixes=("ply",),
    axes=("+z", "-y"),
    assumes_up=True,
    unit="1 m",
    first_bytes={b"ply\n": ("ply",), b"ply\r": ("ply",)},
    read=_read,
    modules=("viewsphere.assets.readers.ply.reading",),
)
