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


def joined(pieces: Sequence[tuple[tuple[str, ...], Int | None, int]]) -> tuple[tuple[str, ...], NDArray[np.int32] | None]:
    """The names of all bones of some pieces, each once, and the bone number of each triangle, from 1, 0 for none; None if no
    piece has bones. Each piece gives the names of its bones, the bone of each triangle (None: no bones), and its number of
    triangles.
    """
    names = tuple(dict.fromkeys(name for own, _, _ in pieces for name in own))
    if not names:
        return (), None
    number = {name: i for i, name in enumerate(names, 1)}
    parts = [
        np.zeros(count, np.int32) if bone is None else np.array([*(number[name] for name in own), 0], np.int32)[bone]
        for own, bone, count in pieces
    ]
    return names, np.concatenate(parts)


def grouped(mesh: Mesh, parts: Mapping[str, Sequence[str]]) -> Mesh:
    """The mesh with its bones grouped into these named body parts; bones in none of them become 0. All named bones must be the
    mesh's.
    """
    numbers = {bone: i for i, bones in enumerate(parts.values(), 1) for bone in bones}
    table = np.array([0, *(numbers.get(name, 0) for name in mesh.body_parts)], np.int32)
    assert mesh.triangle_body_part is not None
    return replace(mesh, body_parts=tuple(parts), triangle_body_part=table[mesh.triangle_body_part])
