"""OFF, the Object File Format of Geomview."""

from __future__ import annotations

from typing import TYPE_CHECKING

from viewsphere.plugins.reader import ReaderSpec

if TYPE_CHECKING:
    from viewsphere.assets.mesh import Mesh
    from viewsphere.assets.paths.folder import ModelFolder
    from viewsphere.assets.primitive import FileFacts


def _read(folder: ModelFolder) -> tuple[Mesh, FileFacts]:
    """The model, see `reading.read_off`."""
    from viewsphere.assets.readers.off.reading import read_off

    return read_off(folder)


READER = ReaderSpec(
    about="OFF",
    suffixes=("off",),
    axes=("+z", "-y"),
    assumes_up=True,
    unit="1 m",
    read=_read,
    modules=("viewsphere.assets.readers.off.reading",),
)
