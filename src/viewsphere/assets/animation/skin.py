"""Body parts: the bone of the skin that moves each triangle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from viewsphere.assets.mesh import Mesh

Int = NDArray[np.int64]

NONE = -1
"""The bone of a triangle that no bone moves."""


def strongest(bones: Int, weights: NDArray[np.float64], triangles: Int) -> Int:
    """The bone of each triangle (T,): the one with the largest sum of weights at its corners, and so with the largest weight at
    its middle. Among equal bones the first counts; if all weights are 0, the result is `NONE`.

    `bones` and `weights` (V, K) belong to the vertices; `triangles` (T, 3) index vertices.
    """
    found = np.full(len(triangles), NONE, np.int64)
    if not bones.size or not triangles.size:
        return found
    count = int(bones.max()) + 1
    corners = np.arange(len(triangles))[:, None] * count + bones[triangles].reshape(len(triangles), -1)
    pairs, at = np.unique(corners, return_inverse=True)
    sums = np.bincount(at.reshape(-1), np.nan_to_num(weights[triangles]).reshape(-1), len(pairs))
    triangle, bone = np.divmod(pairs, count)
    order = np.lexsort((bone, -sums, triangle))
    best = order[np.unique(triangle[order], return_index=True)[1]]
    return np.where(sums[best] > 0, bone[best], found)


def grouped(mesh: Mesh, parts: Mapping[str, Sequence[str]]) -> Mesh:
    """The mesh with its bones grouped into these named body parts; bones in none of them become 0. All named bones must be the
    mesh's.
    """
    numbers = {bone: i for i, bones in enumerate(parts.values(), 1) for bone in bones}
    table = np.array([0, *(numbers.get(name, 0) for name in mesh.body_parts)], np.int32)
    assert mesh.triangle_body_part is not None
    return replace(mesh, body_parts=tuple(parts), triangle_body_part=table[mesh.triangle_body_part])
