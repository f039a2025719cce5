"""URDF, the Unified Robot Description Format: links with meshes, in the state in which all joints are at zero."""

from __future__ import annotations

from typing import TYPE_CHECKING

from viewsphere.plugins.reader import ReaderSpec

if TYPE_CHECKING:
    from viewsphere.assets.mesh import Mesh
    from viewsphere.assets.paths.folder import ModelFolder
    from viewsphere.assets.primitive import FileFacts


def _read(folder: ModelFolder) -> tuple[Mesh, FileFacts]:
    """The model, see `reading.read_urdf`."""
    from viewsphere.assets.readers.urdf.reading import read_urdf

    return read_urdf(folder)


READER = ReaderSpec(
    about="URDF",
    suffixes=("urdf",),
    axes=("+z", "+x"),
    unit="1 m",
    read=_read,
    joins_files=True,
    modules=("viewsphere.assets.readers.urdf.reading",),
)
