"""Wavefront OBJ and its material libraries."""

from __future__ import annotations

from typing import TYPE_CHECKING

from viewsphere.plugins.reader import ReaderSpec

if TYPE_CHECKING:
    from viewsphere.assets.mesh import Mesh
    from viewsphere.assets.paths.folder import ModelFolder
    from viewsphere.assets.primitive import FileFacts


def _read(folder: ModelFolder) -> tuple[Mesh, FileFacts]:
    """The model, see `reading.read_obj`."""
    from viewsphere.assets.readers.obj.reading import read_obj

    return read_obj(folder)


READER = ReaderSpec(
    about="OBJ + MTL",
    suffixes=("obj",),
    axes=("+y", "+z"),
    assumes_up=True,
    unit="1 m",
    read=_read,
    modules=("viewsphere.assets.readers.obj.reading",),
)
