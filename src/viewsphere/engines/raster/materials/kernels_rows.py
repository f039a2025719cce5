"""The update of the shading kernels' vertices when a thing moves."""

from __future__ import annotations

import math

import numpy as np

from viewsphere.kernels.jit import njit
from viewsphere.truth.raster.kernels_place import there, turned


@njit
def place_rows(m, own, own_normals, origin, unit, rows):
    """Place a mesh with the pose m (4, 4) in rows of `Surfaces.vertices`: positions (V, 3) from `origin` in `unit`s, and
    normals (V, 3). Values that are not finite become 0.
    """
    for i in range(rows.shape[0]):
        world = there(m, own[i, 0], own[i, 1], own[i, 2])
        for r in range(3):
            normal = turned(m, r, own_normals[i, 0], own_normals[i, 1], own_normals[i, 2])
            place = np.float32((world[r] - origin[r]) / unit)
            rows[i, r] = normal if math.isfinite(normal) else np.float32(0)
            rows[i, 11 + r] = place if math.isfinite(place) else np.float32(0)
