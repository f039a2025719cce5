"""Meshes placed in the world: written out, because BLAS rounds differently from processor to processor."""

from __future__ import annotations

import math

import numpy as np

from viewsphere.kernels.jit import njit

FLAT = 1e-5  # greatest difference of a corner's normal from its triangle's where the triangle counts as flat


@njit
def place(m, own, own_normals, is_used, vertices, normals, bounds):
    """World vertices (V, 3) float64 and normals (V, 3) float32 of a mesh in the pose m (4, 4).

    bounds (2, 3) is filled with the lowest and the highest of its used vertices, infinite where no vertex is used.
    """
    for i in range(own.shape[0]):
        x, y, z = np.float64(own[i, 0]), np.float64(own[i, 1]), np.float64(own[i, 2])
        a, b, c = np.float64(own_normals[i, 0]), np.float64(own_normals[i, 1]), np.float64(own_normals[i, 2])
        for r in range(3):
            vertices[i, r] = m[r, 0] * x + m[r, 1] * y + m[r, 2] * z + m[r, 3]
            normals[i, r] = np.float32(m[r, 0] * a + m[r, 1] * b + m[r, 2] * c + m[r, 3] * 0.0)
    for r in range(3):
        low, high = np.inf, -np.inf
        for i in range(own.shape[0]):
            if is_used[i]:
                low, high = min(low, vertices[i, r]), max(high, vertices[i, r])
        bounds[0, r], bounds[1, r] = low, high


@njit
def face(vertices, normals, triangles, own, side):
    """Normals (T, 3) float32 and sides (T,) int8 of triangles, as `geometry.Geometry` has them."""
    for t in range(triangles.shape[0]):
        i, j, k = np.uintp(triangles[t, 0]), np.uintp(triangles[t, 1]), np.uintp(triangles[t, 2])
        ux, uy, uz = vertices[j, 0] - vertices[i, 0], vertices[j, 1] - vertices[i, 1], vertices[j, 2] - vertices[i, 2]
        vx, vy, vz = vertices[k, 0] - vertices[i, 0], vertices[k, 1] - vertices[i, 1], vertices[k, 2] - vertices[i, 2]
        x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        largest = max(abs(x), abs(y), abs(z))
        if largest > 0.0:  # keeps the squares of tiny triangles from vanishing
            x, y, z = x / largest, y / largest, z / largest
        length = math.sqrt(x * x + y * y + z * z)
        if length > 0.0:
            x, y, z = x / length, y / length, z / length
        a, b, c = np.float32(x), np.float32(y), np.float32(z)
        own[t, 0], own[t, 1], own[t, 2] = a, b, c
        n0, n1, n2 = normals[i, 0], normals[i, 1], normals[i, 2]
        p0, p1, p2 = normals[j, 0], normals[j, 1], normals[j, 2]
        q0, q1, q2 = normals[k, 0], normals[k, 1], normals[k, 2]
        along = (n0 + p0 + q0) * a + (n1 + p1 + q1) * b + (n2 + p2 + q2) * c
        sign = -1 if along < np.float32(0) else 1
        is_even = n0 == p0 and n0 == q0 and n1 == p1 and n1 == q1 and n2 == p2 and n2 == q2
        off0, off1, off2 = np.float64(n0) - sign * a, np.float64(n1) - sign * b, np.float64(n2) - sign * c
        is_flat = is_even and abs(off0) < FLAT and abs(off1) < FLAT and abs(off2) < FLAT
        side[t] = 2 * sign if is_flat else sign
