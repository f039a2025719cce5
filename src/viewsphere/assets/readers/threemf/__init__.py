"""3MF."""

from __future__ import annotations

from typing import TYPE_CHECKING

from viewsphere.plugins.reader import ReaderSpec

if TYPE_CHECKING:
    from viewsphere.assets.mesh import Mesh
    from viewsphere.assets.paths.folder import ModelFolder
    from viewsphere.assets.primitive import FileFacts


def _read(folder: ModelFolder) -> tuple[Mesh, FileFacts]:
    """The model, see `reading.read_3mf`."""
    from viewsphere.assets.readers.threemf.reading import read_3mf

    return read_3mf(folder)


READER = ReaderSpec(
    about="3MF",
    suffixes=("3mf",),
    axes=("+z", "-y"),
    unit="from the file, else mm",
    archives={"3mf": "ZIP"},
    read=_read,
    modules=("viewsphere.assets.readers.threemf.reading",),
)
