"""The share of the sky that a mesh hides from a point, such as a house from a camera inside it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]

DIRECTIONS = 64


def sky_occlusion(vertices: Float, triangles: NDArray[np.int32], point: Float) -> float:
    """Share of the upper hemisphere that a mesh hides from a point (3,); point and vertices in one frame, +Z up.

    1 inside a house, whatever its floor and the thickness of its walls; 0 where no part of the mesh is overhead, as in a street
    or among hills; in between beside a wall or below a tree.
    """
    from viewsphere.truth.kernels_sky_visibility import hits_any

    if not hits_any(vertices, triangles, point, np.array([0.0, 0.0, 1.0])):
        return 0.0
    return sum(hits_any(vertices, triangles, point, d) for d in _upward()) / DIRECTIONS


def _upward() -> Float:
    """Unit vectors spread evenly over the upper hemisphere, on a Fibonacci spiral."""
    z = (np.arange(DIRECTIONS) + 0.5) / DIRECTIONS
    turn = np.arange(DIRECTIONS) * math.pi * (3 - math.sqrt(5))
    level = np.sqrt(1 - z * z)
    return np.stack([level * np.cos(turn), level * np.sin(turn), z], axis=1)
