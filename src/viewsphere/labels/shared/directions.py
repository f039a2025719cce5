"""The shared parts of both labels of normals: the proof of unit length, and the picture."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from viewsphere.labels.shared.spec import Array, Drawing, Models, Picture, channel_of
from viewsphere.model.sample import Sample

TOLERANCE = 1e-5


def unit_proof(name: str) -> Callable[[Sample, Models], Iterator[str]]:
    """The proof that a channel of directions holds unit vectors, or 0 where nothing is seen."""

    def prove(sample: Sample, models: Models) -> Iterator[str]:
        array = channel_of(sample, name)
        if array is None:
            return
        square = np.einsum("...k,...k", array, array)
        wrong = ~((np.abs(square - 1) < 2 * TOLERANCE) | (square == 0))
        if wrong.any():
            yield f"expected directions of length 1, or 0 where there is none; found others at {wrong.sum()} pixels"

    return prove


def picture(normals: Array) -> Picture:
    """Normals as a picture (H, W, 3) uint8, as normal maps have them: red to the right, green up, blue towards the camera."""
    right, down, away = np.moveaxis(normals.astype(np.float64), -1, 0)
    shares = (np.stack([right, -down, -away], axis=-1) + 1) / 2
    is_seen = (right != 0) | (down != 0) | (away != 0)
    return np.where(is_seen[..., None], shares * 255, 0).round().astype(np.uint8)


def drawing(name: str) -> Drawing:
    """The drawing of a channel of directions."""
    key = ((f"{name}: red to the right, green up, blue towards the camera", None),)
    return Drawing(name, beside=lambda sample: picture(sample.channels[name]), key=key)
