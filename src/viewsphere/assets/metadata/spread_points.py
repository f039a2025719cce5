"""Points of a surface that lie far apart: named points for models that name none."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]


def spread_points(vertices: Float, count: int) -> Float:
    """Up to `count` of the vertices (N, 3), each the farthest from those before it and from the middle of the box.

    Farthest-point sampling, with the middle as its start, as PVNet picks its keypoints (Peng et al. 2019, section 3.1). Equal
    vertices give equal points, in whatever order they come; of vertices that are equally far the first by x, y, z counts.
    """
    vertices = np.unique(vertices, axis=0)
    away = _squares(vertices - (vertices.min(axis=0) + vertices.max(axis=0)) / 2)
    chosen: list[int] = []
    while len(chosen) < min(count, len(vertices)):
        chosen.append(int(away.argmax()))
        away = np.minimum(away, _squares(vertices - vertices[chosen[-1]]))
    return vertices[chosen]


def _squares(vectors: Float) -> Float:
    x, y, z = vectors.T
    return x * x + y * y + z * z
