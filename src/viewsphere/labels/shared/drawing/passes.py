"""The drawings in previews and reports for the passes that engines paint beside pictures; passes are not labels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from viewsphere.labels.shared.spec import Drawing, Picture
from viewsphere.model.channel import PASSES, PICTURES
from viewsphere.model.scene import ViewTransform
from viewsphere.rendering.view import develop, to_bytes


def picture(name: str, array: NDArray[np.float32]) -> Picture:
    """A pass as a picture (H, W, 3) uint8: light developed as in pictures, albedo as sRGB, other shares as greys."""
    if PASSES[name].components == 1:
        return np.repeat((np.clip(array, 0, 1) * 255).round().astype(np.uint8)[..., None], 3, axis=2)
    if name == "albedo":
        return to_bytes(np.clip(array, 0, 1))
    return develop(np.dstack([array, np.ones(array.shape[:2], np.float32)]), None, ViewTransform())


def _drawing(name: str) -> Drawing:
    meaning = PASSES[name].meaning.partition(";")[0]
    return Drawing(name, beside=lambda sample: picture(name, sample.channels[name]), key=((f"{name}: {meaning}", None),))


DRAWINGS = {name: _drawing(name) for name in PASSES if name not in PICTURES}
"""The drawing of each pass except pictures, by its name."""
