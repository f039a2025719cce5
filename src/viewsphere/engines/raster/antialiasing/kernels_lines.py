"""Pixels in which a thin line passes between the centres, in a surface or just on it, which `kernels_edges` does not find.

A panel's seam is as far away as the paint beside it, so it is not in front of the surfaces at the centres. Candidates are
narrow triangles that look different from the surface in a vertex's pixel and have that vertex at about the same distance.
"""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from viewsphere.engines.raster.antialiasing.kernels_edges import span
from viewsphere.kernels.jit import inner, njit
from viewsphere.truth.raster.kernels_draw import NEVER, plane

f4 = nb.float32
U = nb.uintp
BEFORE = f4(0.01)  # relative difference of 1/z of a vertex and its pixel's centre: nearer vertices are left to `kernels_edges`
BEHIND = f4(0.005)  # likewise for a vertex farther than the centre: enough for steep surfaces, too
FLUSH = 0.001  # share of 1/z: how far a line may be behind the plane of the visible surface
WIDE = 8  # pixels: in wider boxes the part of each row that the triangle covers is computed first
FOUND = 2  # in `marks`: a pixel marked by this module
NARROW = 1.0  # pixels: a line this wide is visible at some centre


@njit
def on_others(q, triangles, runs, cutout, owner, triangle, depth, shown, lines):
    """Mark in `lines` (T,) the triangles with a vertex on a visible surface of another owner that hides the vertex slightly or
    not at all.

    shown (V,) int32 is scratch; `runs` are those of `kernels_edges.with_corners_before`.
    """
    height, width = triangle.shape
    a, b, c, d = U(0), U(1), U(2), U(3)
    of_vertices, of_triangles = runs
    for k in range(of_vertices.shape[0]):
        for i in range(U(of_vertices[k, 0]), U(of_vertices[k, 1])):
            x, y = q[i, a] * q[i, d], q[i, b] * q[i, d]
            shown[i] = -1
            if (q[i, c] > 0.0) & (x >= 0.0) & (y >= 0.0) & (x < width) & (y < height):
                row, column = U(np.int64(y)), U(np.int64(x))
                level, t = depth[row, column], triangle[row, column]
                here, o = f4(q[i, d]), owner[U(max(t, np.int32(0)))]
                is_on = (here > level * (f4(1) - BEHIND)) & (here < level * (f4(1) + BEFORE))
                shown[i] = o if is_on else np.int32(-1)
    for k in range(of_triangles.shape[0]):
        for t in range(U(of_triangles[k, 0]), U(of_triangles[k, 1])):
            o = owner[t]
            s0, s1, s2 = shown[U(triangles[t, a])], shown[U(triangles[t, b])], shown[U(triangles[t, c])]
            is_on = ((s0 >= 0) & (s0 != o)) | ((s1 >= 0) & (s1 != o)) | ((s2 >= 0) & (s2 != o))
            lines[t] = is_on & (cutout[t] != NEVER)


@njit
def mark(order, q, triangles, owner, offsets, triangle, depth, marks, wanted):
    """Mark pixels that have a sample on a narrow part of one of these triangles; mark such triangles in `wanted` (T,)."""
    height, width = triangle.shape
    a, b, c, d = U(0), U(1), U(2), U(3)
    lowest, highest = offsets[a, d], offsets[a, b]  # the outermost samples along either axis
    for k in range(U(order.shape[0])):
        t = U(order[k])
        i0, i1, i2 = U(triangles[t, a]), U(triangles[t, b]), U(triangles[t, c])
        w0, w1, w2 = q[i0, d], q[i1, d], q[i2, d]
        high = max(w0, w1, w2)
        if high == np.inf:
            continue
        u0, u1, u2 = q[i0, a] * w0, q[i1, a] * w1, q[i2, a] * w2
        v0, v1, v2 = q[i0, b] * w0, q[i1, b] * w1, q[i2, b] * w2
        ax, ay, bx, by = u1 - u0, v1 - v0, u2 - u0, v2 - v0
        longest = max(ax * ax + ay * ay, bx * bx + by * by, (ax - bx) * (ax - bx) + (ay - by) * (ay - by))
        area = ax * by - ay * bx
        if area * area >= NARROW * NARROW * longest or area == 0.0:
            continue
        xa = math.ceil(max(min(u0, u1, u2) - highest, 0.0))
        ya = math.ceil(max(min(v0, v1, v2) - highest, 0.0))
        xb = math.floor(min(max(u0, u1, u2) - lowest, width - 1.0))
        yb = math.floor(min(max(v0, v1, v2) - lowest, height - 1.0))
        # The shares of corners 1 and 2 at a point, relative to corner 0.
        scale = 1.0 / area
        sx, sy, tx, ty = by * scale, -bx * scale, -ay * scale, ax * scale
        s0, t0 = -(sx * u0 + sy * v0), -(tx * u0 + ty * v0)
        is_wide, o = xb - xa > WIDE, owner[t]
        for y in range(ya, yb + 1):
            left, right = xa, xb
            if is_wide:
                edges = (sx, sy, s0), (tx, ty, t0), (-sx - tx, -sy - ty, 1.0 - s0 - t0)
                left, right = span(edges, y, xa, xb, lowest, highest)
            for x in range(left, right + 1):
                row, column = U(y), U(x)
                p = row * U(width) + column
                if marks[p] == 1 or (marks[p] and wanted[t]):
                    continue
                shown = triangle[row, column]
                if shown < 0 or f4(high) < depth[row, column] * (f4(1) - BEHIND) or owner[U(shown)] == o:
                    continue
                for i in range(U(4)):
                    px, py = float(x) + offsets[a, i], float(y) + offsets[b, i]
                    f1, f2 = sx * px + (sy * py + s0), tx * px + (ty * py + t0)
                    if f1 >= 0.0 and f2 >= 0.0 and f1 + f2 <= 1.0:
                        inverse = w0 + f1 * (w1 - w0) + f2 * (w2 - w0)
                        if inverse >= depth[row, column] or _is_flush(inverse, px, py, U(shown), q, triangles):
                            marks[p], wanted[t] = FOUND, 1
                            break


@inner
def _is_flush(inverse, px, py, t, q, triangles):
    """Return whether 1/z `inverse` at (px, py) is at most slightly behind triangle t's plane."""
    i0, i1, i2 = triangles[t, 0], triangles[t, 1], triangles[t, 2]
    nx, ny, nz, det = plane((q[i0, 0], q[i0, 1], q[i0, 2]), (q[i1, 0], q[i1, 1], q[i1, 2]), (q[i2, 0], q[i2, 1], q[i2, 2]))
    return det != 0.0 and inverse >= (1.0 - FLUSH) * (nx * px + (ny * py + nz)) / det
