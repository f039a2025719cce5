"""Points attached to triangles: their barycentrics, and their places after the corners have moved."""

from __future__ import annotations

import numpy as np

from viewsphere.kernels.jit import njit
from viewsphere.truth.raster.kernels_channels import weights_at
from viewsphere.truth.raster.kernels_draw import NEVER, hits_surface

A, B, C = np.uintp(0), np.uintp(1), np.uintp(2)


@njit
def weights(triangles, chosen, q, rays, out):
    """Barycentrics (N, 3) of the rays (N, 3) in the `chosen` triangles (N,); q: see `raster.visibility.homogeneous`."""
    for i in range(chosen.shape[0]):
        ui, t = np.uintp(i), np.uintp(chosen[i])
        i0, i1, i2 = np.uintp(triangles[t, A]), np.uintp(triangles[t, B]), np.uintp(triangles[t, C])
        b0, b1, b2 = weights_at(q, i0, i1, i2, rays[ui, A], rays[ui, B], rays[ui, C])
        out[ui, A], out[ui, B], out[ui, C] = b0, b1, b2


@njit
def stick(corners, chosen, barycentrics, out):
    """Write the points (N, 3) that have these barycentrics (N, 3) in triangles with these corners (N, 3, 3), skipping points
    whose triangle `chosen` (N,) is -1.
    """
    for i in range(chosen.shape[0]):
        ui = np.uintp(i)
        if chosen[ui] < 0:
            continue
        b0, b1, b2 = barycentrics[ui, A], barycentrics[ui, B], barycentrics[ui, C]
        for c in range(3):
            uc = np.uintp(c)
            out[ui, uc] = b0 * corners[ui, A, uc] + b1 * corners[ui, B, uc] + b2 * corners[ui, C, uc]


@njit
def on_surface(chosen, barycentrics, cutout, alpha_masks, out):
    """Fill out (N,) with whether these points of the `chosen` triangles (N,) are surface; see `kernels_draw.hits_surface`."""
    for i in range(chosen.shape[0]):
        row, b = cutout[chosen[i]], barycentrics[i]
        out[i] = row != NEVER and hits_surface(alpha_masks, row, b[0], b[1], b[2])
