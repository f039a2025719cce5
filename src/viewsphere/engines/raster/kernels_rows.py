"""What of the shading kernels' vertices changes where something moves."""

from __future__ import annotations

import math

import numpy as np

from viewsphere.kernels.jit import njit


@njit
def place_rows(vertices, normals, origin, unit, rows):
    """Write positions (V, 3) from `origin` in `unit`s, and normals (V, 3), in rows of `Surfaces.vertices`; 0 for no number."""
    for i in range(rows.shape[0]):
        for r in range(3):
            normal, place = normals[i, r], np.float32((vertices[i, r] - origin[r]) / unit)
            rows[i, r] = normal if math.isfinite(normal) else np.float32(0)
            rows[i, 11 + r] = place if math.isfinite(place) else np.float32(0)
