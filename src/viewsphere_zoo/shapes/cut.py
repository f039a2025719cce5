"""A solid's surface cut in two along a level line, so that each side can have its own paint."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from viewsphere_zoo.shapes.solids import Float, Solid

Index = NDArray[np.int64]
SNAP = 1e-4
"""Vertices nearer to the level than this count as on it, to avoid slivers."""


def cut(solid: Solid, level: Float) -> tuple[Solid, Solid]:
    """The surface where level (V,), linear between vertices, is at most 0, and the rest; the cut stays open."""
    d = np.where(np.abs(level) < SNAP, 0.0, level)
    above = (d > 0)[solid.triangles]
    count = above.sum(axis=1)
    mixed = (count == 1) | (count == 2)
    lone = np.where(count == 1, above.argmax(axis=1), above.argmin(axis=1))[mixed]
    a, b, c = (solid.triangles[mixed, (lone + k) % 3] for k in range(3))
    start, n = len(solid.vertices), len(a)
    p, q = start + np.arange(n), start + n + np.arange(n)
    vertices = np.concatenate([solid.vertices, _crossing(solid.vertices, d, a, b), _crossing(solid.vertices, d, a, c)])
    tip = np.stack([a, p, q], axis=1)
    rest = np.concatenate([np.stack([p, b, c], axis=1), np.stack([p, c, q], axis=1)])
    up = d[a] > 0
    twice = np.concatenate([up, up])
    low = np.concatenate([solid.triangles[count == 0], tip[~up], rest[twice]])
    high = np.concatenate([solid.triangles[count == 3], tip[up], rest[~twice]])
    return _compact(vertices, low), _compact(vertices, high)


def _crossing(vertices: Float, d: Float, a: Index, b: Index) -> Float:
    """The points where the level is 0 between vertices a and b; the same bits from either side."""
    i, j = np.minimum(a, b), np.maximum(a, b)
    share = d[i] / (d[i] - d[j])
    return vertices[i] + (vertices[j] - vertices[i]) * share[:, None]


def _compact(vertices: Float, triangles: Index) -> Solid:
    """The solid with only the vertices that its triangles use."""
    used, index = np.unique(triangles, return_inverse=True)
    return Solid(vertices[used], index.reshape(-1, 3))
