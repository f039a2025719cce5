"""glTF 2.0 and GLB."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from viewsphere.plugins.reader import ReaderSpec

if TYPE_CHECKING:
    from viewsphere.assets.mesh import Mesh
    from viewsphere.assets.paths.folder import ModelFolder
    from viewsphere.assets.primitive import FileFacts


def _read(folder: ModelFolder) -> tuple[Mesh, FileFacts]:
    """The model, see `reading.read_gltf`."""
    from viewsphere.assets.readers.gltf.reading import read_gltf

    return read_gltf(folder)


def _frames(folder: ModelFolder, frames: Sequence[int]) -> Iterator[tuple[Mesh, FileFacts]]:
    """The model at frames of an animation, see `reading.read_gltf_frames`."""
    from viewsphere.assets.readers.gltf.reading import read_gltf_frames

    return read_gltf_frames(folder, frames)


def _timeline(folder: ModelFolder) -> dict[str, Any]:
    """The animations' frames, see `animation.timeline`."""
    from viewsphere.assets.readers.gltf.animation import timeline
    from viewsphere.assets.readers.gltf.document import Document

    return timeline(Document.read(folder), folder.clip, folder.fps)


READER = ReaderSpec(
    about="glTF, GLB (2.0)",
    suffixes=("glb", "gltf"),
    axes=("+y", "+z"),
    unit="metre",
    frames=_frames,
    timeline=_timeline,
    first_bytes={b"glTF": ("glb", "gltf")},
    read=_read,
    modules=("viewsphere.assets.readers.gltf.reading",),
)
