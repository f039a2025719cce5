"""Openings of garments: a closed surface is cut along a line and its edge turned inwards, so that it stays closed but looks
open.

Vertices may have further columns after their positions: attributes that are interpolated along with them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from viewsphere_zoo.shapes.cut import cut
from viewsphere_zoo.shapes.solids import Float, Solid, join


def opened(solid: Solid, level: Float, depth: float, thick: float) -> Solid:
    """The part of a closed surface where level (V,) is at most 0. Hems of `thick` metres close it; they lead `depth` metres
    into it and end in a cap.
    """
    kept, away = cut(solid, level)
    if not len(kept.triangles) or not len(away.triangles):
        return kept
    kept = welded(kept)
    return join(kept, *(_hem(kept, ring, depth, thick) for ring in rings(kept)))


def welded(solid: Solid) -> Solid:
    """The solid with vertices at the same position merged."""
    _, first, index = np.unique(np.round(solid.vertices[:, :3], 7), axis=0, return_index=True, return_inverse=True)
    triangles = index.reshape(-1)[solid.triangles]
    a, b, c = triangles.T
    return Solid(solid.vertices[first], triangles[(a != b) & (b != c) & (c != a)])


def rings(solid: Solid) -> list[NDArray[np.int64]]:
    """The open edges of a surface as loops of vertices, along the triangles' own direction."""
    t = solid.triangles
    edges = np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]])
    count = len(solid.vertices)
    is_open = ~np.isin(edges[:, 0] * count + edges[:, 1], edges[:, 1] * count + edges[:, 0])
    after = dict(sorted(map(tuple, edges[is_open].tolist())))
    found = list[NDArray[np.int64]]()
    while after:
        start = min(after)
        ring, now = [start], after.pop(start)
        while now != start and now in after:
            ring.append(now)
            now = after.pop(now)
        if len(ring) > 2:
            found.append(np.array(ring))
    return found


def _hem(solid: Solid, ring: NDArray[np.int64], depth: float, thick: float) -> Solid:
    """A hem from an open edge inwards by `thick` and back into the garment by `depth`, with a cap."""
    more = solid.vertices[ring, 3:]
    edge = solid.vertices[ring, :3]
    middle = edge.mean(axis=0)
    back = _inside(solid, ring)
    out = edge - middle
    out = out - (out * back).sum(axis=1)[:, None] * back
    length = np.sqrt((out * out).sum(axis=1))[:, None]
    inner = edge - out / np.maximum(length, 1e-9) * np.minimum(thick, 0.5 * length)
    deep = inner + depth * back
    n = len(ring)
    i = np.arange(n)
    j = (i + 1) % n
    walls = [np.stack(t, axis=1) for k in (0, n) for t in ((j + k, i + k, i + k + n), (j + k, i + k + n, j + k + n))]
    cap = np.stack([j + 2 * n, i + 2 * n, np.full(n, 3 * n)], axis=1)
    places = np.concatenate([edge, inner, deep, deep.mean(axis=0)[None]])
    known = np.concatenate([more, more, more, more.mean(axis=0)[None]])
    return Solid(np.concatenate([places, known], axis=1), np.concatenate([*walls, cap]))


def _inside(solid: Solid, ring: NDArray[np.int64]) -> Float:
    """A unit vector (3,) from an open edge along the surface into the garment."""
    on = np.isin(solid.triangles, ring)
    one = solid.triangles[on.any(axis=1) & ~on.all(axis=1)]
    rest = np.setdiff1d(np.unique(one), ring)
    edge = solid.vertices[ring, :3]
    area = np.cross(edge - edge.mean(axis=0), np.roll(edge, -1, axis=0) - edge.mean(axis=0)).sum(axis=0)
    area = area / np.sqrt((area * area).sum())
    return area if float(((solid.vertices[rest, :3] - edge.mean(axis=0)) * area).sum()) > 0 else -area
