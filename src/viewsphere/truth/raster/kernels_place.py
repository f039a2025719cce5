"""Meshes placed in the world. The products are written out, because BLAS rounds differently from processor to processor."""

from __future__ import annotations

import math

import numpy as np

from viewsphere.kernels.jit import inner, njit

FLAT = 1e-5  # maximum difference between a corner's normal and its triangle's for a triangle that counts as flat


@inner
def there(m, x, y, z):
    """The world point of a place in a thing's axes, for the pose m (4, 4)."""
    x, y, z = np.float64(x), np.float64(y), np.float64(z)
    return (
        m[0, 0] * x + m[0, 1] * y + m[0, 2] * z + m[0, 3],
        m[1, 0] * x + m[1, 1] * y + m[1, 2] * z + m[1, 3],
        m[2, 0] * x + m[2, 1] * y + m[2, 2] * z + m[2, 3],
    )


@inner
def turned(m, r, a, b, c):
    """World coordinate r of a direction in a thing's axes."""
    a, b, c = np.float64(a), np.float64(b), np.float64(c)
    return np.float32(m[r, 0] * a + m[r, 1] * b + m[r, 2] * c + m[r, 3] * 0.0)


@njit
def place(m, own, vertices):
    """World vertices (V, 3) float64 of a mesh with the pose m (4, 4)."""
    for i in range(own.shape[0]):
        vertices[i, 0], vertices[i, 1], vertices[i, 2] = there(m, own[i, 0], own[i, 1], own[i, 2])


@njit
def turn(m, own, normals):
    """World normals (V, 3) float32 of a mesh with the pose m (4, 4)."""
    for i in range(own.shape[0]):
        for r in range(3):
            normals[i, r] = turned(m, r, own[i, 0], own[i, 1], own[i, 2])


@njit
def bound(m, own, is_used, bounds):
    """Fill bounds (2, 3) with the lowest and the highest world coordinates of a mesh's used vertices, infinite if none is
    used.
    """
    for r in range(3):
        bounds[0, r], bounds[1, r] = np.inf, -np.inf
    for i in range(own.shape[0]):
        if is_used[i]:
            x, y, z = there(m, own[i, 0], own[i, 1], own[i, 2])
            bounds[0, 0], bounds[1, 0] = min(bounds[0, 0], x), max(bounds[1, 0], x)
            bounds[0, 1], bounds[1, 1] = min(bounds[0, 1], y), max(bounds[1, 1], y)
            bounds[0, 2], bounds[1, 2] = min(bounds[0, 2], z), max(bounds[1, 2], z)


@njit
def corners(chosen, triangles, own, starts, poses, ground, out):
    """World corners (n, 3, 3) of the chosen triangles (n,), not written for -1. Thing i has the vertices from starts[i] on, the
    ground those from the last but one entry on.
    """
    i = 0
    for k in range(chosen.shape[0]):
        if chosen[k] < 0:
            continue
        for c in range(3):
            v = triangles[chosen[k], c]
            if v < starts[i] or v >= starts[i + 1]:
                i = np.searchsorted(starts, v, side="right") - 1
            if i == poses.shape[0]:
                for r in range(3):
                    out[k, c, r] = ground[v - starts[i], r]
            else:
                out[k, c, 0], out[k, c, 1], out[k, c, 2] = there(poses[i], own[v, 0], own[v, 1], own[v, 2])


@njit
def project(own, start, poses, m, base, stop, homogeneous):
    """The result of `kernels_draw.transform` for the vertices [base, stop) of things with these poses, whose vertices begin at
    `start`.
    """
    for i in range(poses.shape[0]):
        for v in range(max(start[i], base), min(start[i + 1], stop)):
            x, y, z = there(poses[i], own[v, 0], own[v, 1], own[v, 2])
            homogeneous[v - base, 0] = m[0, 0] * x + m[0, 1] * y + m[0, 2] * z + m[0, 3]
            homogeneous[v - base, 1] = m[1, 0] * x + m[1, 1] * y + m[1, 2] * z + m[1, 3]
            w = m[2, 0] * x + m[2, 1] * y + m[2, 2] * z + m[2, 3]
            homogeneous[v - base, 2], homogeneous[v - base, 3] = w, 1.0 / w if w > 0.0 else np.inf


@njit
def face(vertices, normals, triangles, base, own, side):
    """Normals (T, 3) float32 and sides (T,) int8 of triangles, whose vertices count from `base`, as defined in `Geometry`."""
    for t in range(triangles.shape[0]):
        i, j, k = np.uintp(triangles[t, 0] - base), np.uintp(triangles[t, 1] - base), np.uintp(triangles[t, 2] - base)
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
