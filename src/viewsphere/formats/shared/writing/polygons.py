"""Masks as single rings, for formats with one polygon for each object."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray


def one_ring(polygons: Sequence[Sequence[float]]) -> NDArray[np.float64]:
    """The corners (N, 2) of several rings as one ring. A line between their nearest corners joins each ring to the next and
    returns, so the even-odd area is unchanged.
    """
    rings = [np.array(polygon, np.float64).reshape(-1, 2) for polygon in polygons]
    joined = rings[0]
    for ring in rings[1:]:
        apart = np.linalg.norm(joined[:, None] - ring[None], axis=2)
        i, j = np.unravel_index(int(apart.argmin()), apart.shape)
        there_and_back = np.concatenate([ring[j:], ring[: j + 1]])
        joined = np.concatenate([joined[: i + 1], there_and_back, joined[i:]])
    return joined
