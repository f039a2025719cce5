"""FBX, Alembic, .blend and USD files, which Blender reads."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from viewsphere.plugins.reader import ReaderSpec

if TYPE_CHECKING:
    from viewsphere.assets.mesh import Mesh
    from viewsphere.assets.paths.folder import ModelFolder
    from viewsphere.assets.primitive import FileFacts


USD = ("usd", "usda", "usdc", "usdz")


def _read(folder: ModelFolder) -> tuple[Mesh, FileFacts]:
    """The model, see `reading.read_via_blender`."""
    if folder.model.suffix[1:].lower() in USD:
        folder.warn("Blender may lose the transform above a mesh that is below a mesh; pip install 'viewsphere[usd]'")
    from viewsphere.assets.readers.blender.reading import read_via_blender

    return read_via_blender(folder)


def _frames(folder: ModelFolder, frames: Sequence[int]) -> Iterator[tuple[Mesh, FileFacts]]:
    """The model at frames of an animation, see `reading.read_frames`."""
    from viewsphere.assets.readers.blender.reading import read_frames

    return read_frames(folder, frames)


READER = ReaderSpec(
    about="FBX, Alembic (abc), Blender (blend)",
    suffixes=("abc", "blend", "fbx", *USD),
    axes=("+z", "-y"),
    unit="metre, after Blender's own turn and scale",
    frames=_frames,
    by_blender=True,
    reserves_memory=True,
    first_bytes={b"Kaydara FBX": ("fbx",), b"BLENDER": ("blend",), b"Ogawa": ("abc",)},
    archives={"blend": "gzip", "usd": "ZIP", "usdz": "ZIP"},
    read=_read,
)
