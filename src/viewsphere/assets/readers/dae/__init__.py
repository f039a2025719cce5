"""COLLADA."""

from __future__ import annotations

from typing import TYPE_CHECKING

from viewsphere.plugins.reader import ReaderSpec

if TYPE_CHECKING:
    from viewsphere.assets.mesh import Mesh
    from viewsphere.assets.paths.folder import ModelFolder
    from viewsphere.assets.primitive import FileFacts


def _read(folder: ModelFolder) -> tuple[Mesh, FileFacts]:
    """The model, see `reading.read_dae`."""
    from viewsphere.assets.readers.dae.reading import read_dae

    return read_dae(folder)


READER = ReaderSpec(
    about="DAE (COLLADA)",
    suffixes=("dae",),
    read=_read,
    modules=("viewsphere.assets.readers.dae.reading",),
)
