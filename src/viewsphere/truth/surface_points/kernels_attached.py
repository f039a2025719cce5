"""Points that stick to triangles: their barycentrics, and where these are when the corners are elsewhere."""

from __future__ import annotations

import math

import numpy as np

from viewsphere.geometry.kernels_lens import invert_radial, scan_ray, undistort_brown
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
    """Write the points (N, 3) that have these barycentrics (N, 3) in triangles of these corners (N, 3, 3); none where the
    triangle `chosen` (N,) is -1.
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


@njit
def rays_brown(k, limit, matrix, xy, out):
    """Rays (N, 3), z = 1, through the pixels xy (N, 2) of a Brown-Conrady lens; NaN where it has none."""
    for i in range(xy.shape[0]):
        v = (xy[i, 1] - matrix[1, 2]) / matrix[1, 1]
        u = (xy[i, 0] - matrix[0, 2] - matrix[0, 1] * v) / matrix[0, 0]
        x, y = undistort_brown(k, limit, u, v)
        out[i, 0], out[i, 1], out[i, 2] = x, y, np.nan if math.isnan(x) else 1.0


@njit
def rays_fisheye(k, limit, matrix, xy, out):
    """Unit rays (N, 3) through the pixels xy (N, 2) of a fisheye; NaN where it has none."""
    for i in range(xy.shape[0]):
        v = (xy[i, 1] - matrix[1, 2]) / matrix[1, 1]
        u = (xy[i, 0] - matrix[0, 2] - matrix[0, 1] * v) / matrix[0, 0]
        radius = math.sqrt(u * u + v * v)
        theta = invert_radial(k, True, radius, limit) if radius > 0.0 else 0.0
        sine = math.sin(theta) / radius if radius > 0.0 else 0.0
        out[i, 0], out[i, 1], out[i, 2] = u * sine, v * sine, math.cos(theta)


@njit
def rays_scan(k, limit, matrix, xy, out):
    """Unit rays (N, 3) through the pixels xy (N, 2) of a scan; NaN where it has none."""
    for i in range(xy.shape[0]):
        v = (xy[i, 1] - matrix[1, 2]) / matrix[1, 1]
        u = (xy[i, 0] - matrix[0, 2] - matrix[0, 1] * v) / matrix[0, 0]
        out[i, 0], out[i, 1], out[i, 2] = scan_ray(k, u, v)
