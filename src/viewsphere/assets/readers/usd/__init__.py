"""USD files, read by the package usd-core of the extra `usd`: https://openusd.org. Blender reads their animations."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from viewsphere.plugins.reader import ReaderSpec

if TYPE_CHECKING:
    from viewsphere.assets.mesh import Mesh
    from viewsphere.assets.paths.folder import ModelFolder
    from viewsphere.assets.primitive import FileFacts


def _read(folder: ModelFolder) -> tuple[Mesh, FileFacts]:
    """The model, see `scene.read_usd`."""
    from viewsphere.assets.readers.usd.scene import read_usd

    return read_usd(folder)


def _timeline(folder: ModelFolder) -> dict[str, Any]:
    """The animation's frames, see `animated.timeline`."""
    from viewsphere.assets.readers.usd.layers import timeline

    return timeline(folder)


READER = ReaderSpec(
    about="USD (usd, usda, usdc, usdz)",
    suffixes=("usd", "usda", "usdc", "usdz"),
    timeline=_timeline,
    packages=("pxr",),
    install="viewsphere[usd]",
    reserves_memory=True,
    first_bytes={b"PXR-USDC": ("usdc", "usd"), b"#usda": ("usda", "usd")},
    archives={"usd": "ZIP", "usdz": "ZIP"},
    read=_read,
)
