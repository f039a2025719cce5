"""Points that a LiDAR's rays meet."""

from __future__ import annotations

import math

from viewsphere.kernels.jit import njit


@njit
def incidence(triangle, rays, normals, rotation, out):
    """Fill out (N,) with the angle, 0 to pi/2, between rays (N, 3) in sensor axes and the normals of triangles (N,) in world
    axes; rotation (3, 3) takes these to the sensor's.
    """
    for i in range(out.shape[0]):
        n = normals[triangle[i]]
        dx, dy, dz = rays[i, 0], rays[i, 1], rays[i, 2]
        nx = rotation[0, 0] * n[0] + rotation[0, 1] * n[1] + rotation[0, 2] * n[2]
        ny = rotation[1, 0] * n[0] + rotation[1, 1] * n[1] + rotation[1, 2] * n[2]
        nz = rotation[2, 0] * n[0] + rotation[2, 1] * n[1] + rotation[2, 2] * n[2]
        x, y, z = ny * dz - nz * dy, nz * dx - nx * dz, nx * dy - ny * dx
        out[i] = math.atan2(math.sqrt(x * x + y * y + z * z), abs(nx * dx + ny * dy + nz * dz))
