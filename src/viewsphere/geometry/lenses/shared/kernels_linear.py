"""Compiled loops over vertices and triangles: the box of a projected model."""

from __future__ import annotations

import numpy as np

from viewsphere.kernels.jit import njit

U = np.uintp


@njit(_nrt=True)
def cut_bounds(vertices, triangles, first, last, base, stop, k, r, t, near):
    """Bounds (u0, v0, u1, v1) in pixels of the part with w >= near of triangles [first, last), and whether all of them have w
    >= near.

    The corners are vertices [base, stop). Triangles that cross the plane w = near are cut there. The bounds are (inf, inf,
    -inf, -inf) if nothing is in front of that plane.
    """
    u0, v0, u1, v1 = np.inf, np.inf, -np.inf, -np.inf
    whole, front = True, True
    q = np.empty((stop - base, 3))
    uv = np.empty((stop - base, 2))
    for i in range(base, stop):
        x, y, z = vertices[i, 0], vertices[i, 1], vertices[i, 2]
        a = r[0, 0] * x + r[0, 1] * y + r[0, 2] * z + t[0]
        b = r[1, 0] * x + r[1, 1] * y + r[1, 2] * z + t[1]
        w = r[2, 0] * x + r[2, 1] * y + r[2, 2] * z + t[2]
        j = i - base
        q[j, 0] = k[0, 0] * a + k[0, 1] * b + k[0, 2] * w
        q[j, 1] = k[1, 1] * b + k[1, 2] * w
        q[j, 2] = w
        uv[j, 0] = q[j, 0] / w
        uv[j, 1] = q[j, 1] / w
        front &= w >= near
    used = np.zeros(stop - base, np.bool_)
    for f in range(first, last):
        for c in range(3):
            j = triangles[f, c] - base
            used[np.uintp(j)] = True
            if not front and q[j, 2] < near:
                whole = False
                for other in range(1, 3):
                    o = triangles[f, (c + other) % 3] - base
                    if q[o, 2] >= near:
                        s = (near - q[j, 2]) / (q[o, 2] - q[j, 2])
                        u = (q[j, 0] + s * (q[o, 0] - q[j, 0])) / near
                        v = (q[j, 1] + s * (q[o, 1] - q[j, 1])) / near
                        u0, v0, u1, v1 = min(u0, u), min(v0, v), max(u1, u), max(v1, v)
    for j in range(stop - base):
        if used[j] and q[j, 2] >= near:
            u, v = uv[j, 0], uv[j, 1]
            u0, v0, u1, v1 = min(u0, u), min(v0, v), max(u1, u), max(v1, v)
    return u0, v0, u1, v1, whole


@njit
def whole_bounds(vertices, used, base, k, r, t, near):
    """Bounds (u0, v0, u1, v1) in pixels of the `used` (n,) vertices from `base` on, and whether all of them have w >= near. If
    not, the bounds are arbitrary.
    """
    u0, v0, u1, v1, front = np.inf, np.inf, -np.inf, -np.inf, True
    for j in range(U(used.shape[0])):
        if used[j]:
            i = U(base) + j
            x, y, z = vertices[i, U(0)], vertices[i, U(1)], vertices[i, U(2)]
            a = r[0, 0] * x + r[0, 1] * y + r[0, 2] * z + t[0]
            b = r[1, 0] * x + r[1, 1] * y + r[1, 2] * z + t[1]
            w = r[2, 0] * x + r[2, 1] * y + r[2, 2] * z + t[2]
            front &= w >= near
            u, v = (k[0, 0] * a + k[0, 1] * b + k[0, 2] * w) / w, (k[1, 1] * b + k[1, 2] * w) / w
            u0, v0, u1, v1 = min(u0, u), min(v0, v), max(u1, u), max(v1, v)
    return u0, v0, u1, v1, front
