"""Angles at which a LiDAR's rays meet surfaces."""

from __future__ import annotations

import math

from viewsphere.kernels.jit import njit


@njit
def incidence(rays, normals, chosen, rotation, angle, cosine):
    """Fill (N,) each with the angle, 0 to pi/2, between rays (N, 3) and the `chosen` normals (N,), and its cosine; rotation
    (3, 3) takes normals, of any length, to the rays' axes.
    """
    for i in range(angle.shape[0]):
        dx, dy, dz = rays[i, 0], rays[i, 1], rays[i, 2]
        n = normals[chosen[i]]
        nx = rotation[0, 0] * n[0] + rotation[0, 1] * n[1] + rotation[0, 2] * n[2]
        ny = rotation[1, 0] * n[0] + rotation[1, 1] * n[1] + rotation[1, 2] * n[2]
        nz = rotation[2, 0] * n[0] + rotation[2, 1] * n[1] + rotation[2, 2] * n[2]
        x, y, z = ny * dz - nz * dy, nz * dx - nx * dz, nx * dy - ny * dx
        across, along = math.sqrt(x * x + y * y + z * z), abs(nx * dx + ny * dy + nz * dz)
        length = math.sqrt(across * across + along * along)
        angle[i] = math.atan2(across, along)
        cosine[i] = along / length if length > 0.0 else 0.0
