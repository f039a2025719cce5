"""Ray directions that are evenly distributed over a sphere or a dome."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.raster.records import Float32

Float = NDArray[np.float64]

TURNS = 8
"""Number of rotations of the rays. Neighbours never use the same one, so that a probe and its neighbours together act like one
probe with all of their rays (interleaved sampling, Keller and Heidrich 2001).
"""


def sphere(count: int) -> Float32:
    """Directions distributed evenly over the sphere, (count, 3): a Fibonacci spiral. None is along an axis."""
    z = 1 - (2 * np.arange(count) + 1) / count
    return _around(z, np.arange(count))


def turned(directions: Float32) -> Float32:
    """Directions (K, 3) in `TURNS` nearly uniform rotations, (TURNS, K, 3) (Shoemake 1992)."""
    i = np.arange(1, TURNS + 1)
    u, v, w = ((i * step) % 1.0 for step in (0.8191725134, 0.6710436067, 0.5497004779))  # Roberts' sequence in three dimensions
    a, b = np.sqrt(1 - u), np.sqrt(u)
    x, y, z, r = a * np.sin(2 * np.pi * v), a * np.cos(2 * np.pi * v), b * np.sin(2 * np.pi * w), b * np.cos(2 * np.pi * w)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * r), 2 * (x * z + y * r)],
        [2 * (x * y + z * r), 1 - 2 * (x * x + z * z), 2 * (y * z - x * r)],
        [2 * (x * z - y * r), 2 * (y * z + x * r), 1 - 2 * (x * x + y * y)],
    ]
    turned = np.einsum("ijw,kj->wki", np.array(rows), directions.astype(np.float64))
    return np.ascontiguousarray(turned, np.float32)


def dome(count: int) -> Float32:
    """Directions upwards, with a density proportional to their cosine, (count, 3)."""
    return _around(np.sqrt(1 - (np.arange(count) + 0.5) / count), np.arange(count))


def domes(count: int, ways: int) -> Float:
    """Directions around the third axis, with a density proportional to their cosine, in `ways` rotations, (ways, count, 3)."""
    i, turn = np.arange(count), np.arange(ways)[:, None] * 0.6180339887 % 1.0
    z = np.sqrt(1 - (i + turn) / count)
    angle = (i + turn) * (math.pi * (3 - math.sqrt(5))) + 2 * math.pi * turn
    radius = np.sqrt(1 - z * z)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=-1)


def _around(z: Float, turn: NDArray[np.int_]) -> Float32:
    angle, radius = (turn + 0.5) * math.pi * (3 - math.sqrt(5)), np.sqrt(1 - z * z)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1).astype(np.float32)
