"""A small recipe that renders in a second, and a digest of what it makes."""

from __future__ import annotations

import hashlib
from pathlib import Path

ROOT = Path(__file__).parent.parent


def still_channels() -> tuple[str, ...]:
    """Names of the pictures, and of the labels of pixels that need no other picture."""
    from viewsphere.labels import channel_labels
    from viewsphere.model.channel import PICTURES

    return (*PICTURES, *(name for name, label in channel_labels().items() if not label.needs and label.components))


def small_recipe(**changes):
    """Two post boxes from six sides on 96 x 72 pixels, with ground and all channels of still pictures, without occlusion, which
    would take a fifth of the time.
    """
    from viewsphere import Recipe

    values = {
        "name": "small",
        "models": [{"source": "zoo:post_box", "category": "post box", "count": 2, "scale": {"length": 0.18}}],
        "viewpoints": {"azimuth": [0, 120, 240], "elevation": [15, 50], "distance": 1.0},
        "camera": {"size": [96, 72], "fov_deg": 35},
        "scene": {"ground": True},
        "engine": {"name": "raster", "ambient_occlusion": "off"},
        "channels": list(still_channels()),
        "formats": ["native", "coco"],
        "shot_frames": 2,
    }
    return Recipe(**{**values, **changes})


def tree_hash(folder: Path) -> str:
    """One digest of all file names and bytes below a folder."""
    digest = hashlib.sha256()
    for path in sorted(p for p in folder.rglob("*") if p.is_file()):
        digest.update(f"{path.relative_to(folder).as_posix()}\0{hashlib.sha256(path.read_bytes()).hexdigest()}\n".encode())
    return digest.hexdigest()
