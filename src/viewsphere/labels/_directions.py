"""The proof shared by both labels of normals: the values must be unit vectors."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from viewsphere.labels._label import Models, channel_of
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
