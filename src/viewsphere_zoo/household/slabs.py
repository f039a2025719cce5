"""Flat housings: slabs with round corners and bevelled edges, keys."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from viewsphere_zoo.shapes.solids import Float, Solid, grid, loft


def rounded(width: float, depth: float, radius: float, steps: int = 5) -> Float:
    """A counter-clockwise rectangle about the origin with round corners, (4 steps, 2)."""
    a = np.linspace(0, np.pi / 2, steps)
    corner = np.stack([np.cos(a), np.sin(a)], axis=1)
    ring: list[Float] = []
    for k, (sx, sy) in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1))):
        c, s = np.cos(k * np.pi / 2), np.sin(k * np.pi / 2)
        turned = corner @ np.array([[c, s], [-s, c]])
        ring.append(radius * turned + (sx * (width / 2 - radius), sy * (depth / 2 - radius)))
    return np.concatenate(ring)


def slab(width: float, depth: float, low: float, high: float, radius: float, bevel: float = 0.001) -> Solid:
    """A level slab between two heights; its corners are round and its edges bevelled, metres."""
    b = min(bevel, 0.45 * (high - low))
    levels = ((low, b), (low + b, 0.0), (high - b, 0.0), (high, b))
    rings = [np.column_stack([rounded(width - 2 * i, depth - 2 * i, max(radius - i, 1e-4)), np.full(20, z)]) for z, i in levels]
    return loft(np.array(rings))


def keys(places: Float, low: float, high: float, bevel: float = 0.0012) -> Solid:
    """Caps over rectangles (K, 4) of x, y, width and depth; their tops are smaller by the bevel all around."""
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) / 2
    foot = places[:, None, :2] + corners * places[:, None, 2:]
    top = places[:, None, :2] + corners * (places[:, None, 2:] - 2 * bevel)
    points = np.concatenate([_at(foot, low), _at(top, high)], axis=1)
    i = np.arange(4)
    j = (i + 1) % 4
    faces = np.concatenate([np.stack([i, j, j + 4], 1), np.stack([i, j + 4, i + 4], 1), [(4, 5, 6), (4, 6, 7)]])
    start = 8 * np.arange(len(places))[:, None, None]
    return Solid(points.reshape(-1, 3), (faces + start).reshape(-1, 3))


def _at(points: Float, z: float) -> Float:
    return np.concatenate([points, np.full((*points.shape[:-1], 1), z)], axis=-1)


def upright(x: ArrayLike, low: float, high: float, y: float) -> Solid:
    """A rectangle in the plane y = const that faces -Y, cut at these x (N,)."""
    columns = np.asarray(x, np.float64)
    return grid(np.array([[(a, y, z) for z in (low, high)] for a in columns]))
