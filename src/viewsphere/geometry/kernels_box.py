"""Compiled loops over triangles: the box of a projected model, and what lies in a plane."""

from __future__ import annotations

import numpy as np

from viewsphere.geometry.jit import njit


@njit
def projected_bounds(vertices, triangles, first, last, base, stop, k, r, t, near):
    """Bounds (u0, v0, u1, v1) in pixels of the part with w >= near of triangles [first, last), and whether
    all of them is.

    Their corners are vertices [base, stop). Triangles that cross the plane w = near are cut there. (inf,
    inf, -inf, -inf) where nothing is in front of it.
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
def lies_below(vertices, triangles, first, last, z):
    """Whether any triangle of [first, last) has all its corners at or below the height z."""
    for f in range(first, last):
        if vertices[triangles[f, 0], 2] <= z and vertices[triangles[f, 1], 2] <= z and vertices[triangles[f, 2], 2] <= z:
            return True
    return False


@njit
def instance_map(triangle, triangle_object, count):
    """Ids (H, W) int32 of the objects seen, visible pixels (count + 1,), tight half-open boxes (count +
    1, 4) by id.
    """
    height, width = triangle.shape
    ids = np.zeros((height, width), np.int32)
    area = np.zeros(count + 1, np.int64)
    box = np.zeros((count + 1, 4), np.int64)
    box[:, 0], box[:, 1] = width, height
    for y in range(height):
        for x in range(width):
            face = triangle[y, x]
            if face < 0:
                continue
            i = triangle_object[face]
            if i == 0:
                continue
            ids[y, x] = i
            area[i] += 1
            box[i, 0] = min(box[i, 0], x)
            box[i, 1] = min(box[i, 1], y)
            if x >= box[i, 2]:
                box[i, 2] = x + 1
            box[i, 3] = y + 1
    return ids, area, box
