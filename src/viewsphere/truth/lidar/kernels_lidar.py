"""The places and angles at which a LiDAR's rays meet surfaces."""

from __future__ import annotations

import math

from viewsphere.kernels.jit import njit


@njit
def incidence(rays, normals, chosen, rotation, angle, cosine):
    """Fill `angle` (N,) and `cosine` (N,) with the angle, 0 to pi/2, between rays (N, 3) and the `chosen` normals (N,).

    `rotation` (3, 3) maps normals, of any length, to the rays' axes.
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


@njit
def weights(points, corners, out):
    """Fill (N, 3) with the weights, none of them negative, of the corners (N, 3, 3) of triangles at points (N, 3) of their
    planes.
    """
    for i in range(out.shape[0]):
        a, b, c = corners[i, 0], corners[i, 1], corners[i, 2]
        bx, by, bz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        cx, cy, cz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
        px, py, pz = points[i, 0] - a[0], points[i, 1] - a[1], points[i, 2] - a[2]
        nx, ny, nz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
        second = (py * cz - pz * cy) * nx + (pz * cx - px * cz) * ny + (px * cy - py * cx) * nz
        third = (by * pz - bz * py) * nx + (bz * px - bx * pz) * ny + (bx * py - by * px) * nz
        first = nx * nx + ny * ny + nz * nz - second - third
        first, second, third = max(first, 0.0), max(second, 0.0), max(third, 0.0)
        total = first + second + third
        if total > 0.0:
            out[i, 0], out[i, 1], out[i, 2] = first / total, second / total, third / total
        else:
            out[i, 0], out[i, 1], out[i, 2] = 1.0, 0.0, 0.0
