"""Runs: consecutive triangles of one part and one material, which exporters write as one primitive."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import Mesh


@dataclass(frozen=True, eq=False)
class Run:
    """Triangles of one part and material, starting at the mesh's triangle `first`, with their own vertices.

    `vertices` (n,) int32 index the mesh's vertices; `triangles` (t, 3) int32 index `vertices`.
    """

    first: int
    part: int
    material: int
    vertices: NDArray[np.int32]
    triangles: NDArray[np.int32]


def runs(mesh: Mesh) -> Iterator[Run]:
    """Runs of the mesh's triangles, in order; a new run begins when the part or material changes."""
    change = np.diff(mesh.triangle_part) | np.diff(mesh.triangle_material)
    starts = [0, *(np.flatnonzero(change) + 1).tolist(), len(mesh.triangles)]
    for start, stop in pairwise(starts):
        used, local = np.unique(mesh.triangles[start:stop], return_inverse=True)
        yield Run(
            first=start,
            part=int(mesh.triangle_part[start]),
            material=int(mesh.triangle_material[start]),
            vertices=used.astype(np.int32),
            triangles=local.reshape(-1, 3).astype(np.int32),
        )
