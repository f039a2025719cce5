"""Exact rasterisation along a table of rays (distorted lenses): a quadtree over the picture finds a triangle's pixels.

A ray d meets a triangle where all e_i . d have the sign of det, e_i = X_j x X_k in camera axes: the pinhole's test without the
projection, so it holds for rays that look sideways or back. A node of the tree keeps the box of its rays; products and sums are
monotone in floating point too, so the same expression over the box bounds it over the rays, and no hit is lost.
"""

from __future__ import annotations

import math

import numpy as np

from viewsphere.geometry.jit import njit
from viewsphere.truth.kernels import _plane, is_surface

LEAF = 8  # pixels of a leaf's side
SLIVER = 1e-12  # of the corners' distances' product: below it the sign of det is not trusted


@njit
def tree_levels(height, width):
    """Per level, leaves first: index of its first node, rows, columns. (L, 3) int64."""
    rows, columns = (height + LEAF - 1) // LEAF, (width + LEAF - 1) // LEAF
    levels = np.zeros((64, 3), np.int64)
    count, start = 0, 0
    while True:
        levels[count] = (start, rows, columns)
        start += rows * columns
        count += 1
        if rows == 1 and columns == 1:
            return levels[:count].copy()
        rows, columns = (rows + 1) // 2, (columns + 1) // 2


@njit
def build_tree(rays, levels):
    """Box of each node's rays, (N, 6) float64: lowest x, y, z, highest x, y, z; lowest > highest if it has none."""
    height, width = rays.shape[:2]
    boxes = np.empty((levels[-1, 0] + 1, 6))
    boxes[:, :3] = np.inf
    boxes[:, 3:] = -np.inf
    for y in range(height):
        for x in range(width):
            box = boxes[y // LEAF * levels[0, 2] + x // LEAF]
            for k in range(3):
                if rays[y, x, k] == rays[y, x, k]:
                    box[k] = min(box[k], rays[y, x, k])
                    box[k + 3] = max(box[k + 3], rays[y, x, k])
    for level in range(1, len(levels)):
        below, columns_below = levels[level - 1, 0], levels[level - 1, 2]
        for j in range(levels[level - 1, 1]):
            for i in range(columns_below):
                child = boxes[below + j * columns_below + i]
                box = boxes[levels[level, 0] + j // 2 * levels[level, 2] + i // 2]
                for k in range(3):
                    box[k] = min(box[k], child[k])
                    box[k + 3] = max(box[k + 3], child[k + 3])
    return boxes


@njit(inline="always")
def _highest(a, b, c, box):
    return max(a * box[0], a * box[3]) + (max(b * box[1], b * box[4]) + max(c * box[2], c * box[5]))


@njit(inline="always")
def _lowest(a, b, c, box):
    return min(a * box[0], a * box[3]) + (min(b * box[1], b * box[4]) + min(c * box[2], c * box[5]))


@njit
def _bounds(q0, q1, q2, unit):
    """Least and greatest 1/s on a triangle."""
    if not unit and q0[2] > 0.0 and q1[2] > 0.0 and q2[2] > 0.0:
        return 1.0 / max(q0[2], q1[2], q2[2]), 1.0 / min(q0[2], q1[2], q2[2])
    if not unit:
        return 0.0, np.inf
    farthest = max(_distance(q0, 0.0, q0), _distance(q1, 0.0, q1), _distance(q2, 0.0, q2))
    nearest = farthest - max(_distance(q0, 1.0, q1), _distance(q1, 1.0, q2), _distance(q2, 1.0, q0))
    return 1.0 / farthest, 1.0 / nearest if nearest > 0.0 else np.inf


@njit
def _distance(a, s, b):
    x, y, z = a[0] - s * b[0], a[1] - s * b[1], a[2] - s * b[2]
    return math.sqrt(x * x + y * y + z * z)


@njit
def draw(q, triangles, first, last, base, rays, levels, boxes, unit, cutout, texels, layout, levels_alpha, corners, material, nearest, seen):
    """Draw triangles [first, last) into nearest (1/s, 0 where none) and seen (triangle, -1 where none).

    q holds the vertices from `base` on in camera axes; `unit` says that the rays have length 1 rather than z = 1.
    """
    height, width = nearest.shape
    stack = np.empty((4 * 64, 3), np.int64)
    top_level = len(levels) - 1
    for t in range(first, last):
        if cutout[t] == -2:
            continue
        i0, i1, i2 = triangles[t, 0] - base, triangles[t, 1] - base, triangles[t, 2] - base
        q0, q1, q2 = (q[i0, 0], q[i0, 1], q[i0, 2]), (q[i1, 0], q[i1, 1], q[i1, 2]), (q[i2, 0], q[i2, 1], q[i2, 2])
        if not unit and q0[2] <= 0.0 and q1[2] <= 0.0 and q2[2] <= 0.0:
            continue
        nx, ny, nz, det = _plane(q0, q1, q2)
        if det == 0.0:
            continue
        a0, b0, c0 = q1[1] * q2[2] - q1[2] * q2[1], q1[2] * q2[0] - q1[0] * q2[2], q1[0] * q2[1] - q1[1] * q2[0]
        a1, b1, c1 = q2[1] * q0[2] - q2[2] * q0[1], q2[2] * q0[0] - q2[0] * q0[2], q2[0] * q0[1] - q2[1] * q0[0]
        a2, b2, c2 = q0[1] * q1[2] - q0[2] * q1[1], q0[2] * q1[0] - q0[0] * q1[2], q0[0] * q1[1] - q0[1] * q1[0]
        if det < 0.0:
            a0, b0, c0 = -a0, -b0, -c0
            a1, b1, c1 = -a1, -b1, -c1
            a2, b2, c2 = -a2, -b2, -c2
        nx, ny, nz = nx / det, ny / det, nz / det
        sizes = _distance(q0, 0.0, q0) * _distance(q1, 0.0, q1) * _distance(q2, 0.0, q2)
        sliver = abs(det) < SLIVER * sizes
        least, most = _bounds(q0, q1, q2, unit) if sliver else (0.0, np.inf)
        stack[0] = (top_level, 0, 0)
        depth = 1
        while depth > 0:
            depth -= 1
            level, row, column = stack[depth]
            box = boxes[levels[level, 0] + row * levels[level, 2] + column]
            if box[0] > box[3]:
                continue
            outside = _highest(a0, b0, c0, box) < 0.0 or _highest(a1, b1, c1, box) < 0.0 or _highest(a2, b2, c2, box) < 0.0
            if outside and not (
                sliver
                and _lowest(a0, b0, c0, box) <= 0.0
                and _lowest(a1, b1, c1, box) <= 0.0
                and _lowest(a2, b2, c2, box) <= 0.0
            ):
                continue
            if level > 0:
                below = level - 1
                for k in range(4):
                    j, i = 2 * row + (k >> 1), 2 * column + (k & 1)
                    if j < levels[below, 1] and i < levels[below, 2]:
                        stack[depth] = (below, j, i)
                        depth += 1
                continue
            for y in range(row * LEAF, min(row * LEAF + LEAF, height)):
                for x in range(column * LEAF, min(column * LEAF + LEAF, width)):
                    dx, dy, dz = rays[y, x, 0], rays[y, x, 1], rays[y, x, 2]
                    e0 = a0 * dx + (b0 * dy + c0 * dz)
                    e1 = a1 * dx + (b1 * dy + c1 * dz)
                    e2 = a2 * dx + (b2 * dy + c2 * dz)
                    inside = e0 >= 0.0 and e1 >= 0.0 and e2 >= 0.0
                    if not inside and not (sliver and e0 <= 0.0 and e1 <= 0.0 and e2 <= 0.0):
                        continue
                    inverse = min(max(nx * dx + (ny * dy + nz * dz), least), most)
                    if inverse > nearest[y, x]:
                        total = e0 + e1 + e2
                        if cutout[t] >= 0 and (
                            total == 0.0
                            or not is_surface(
                                texels, layout, levels_alpha, corners, material, cutout[t], e0 / total, e1 / total, e2 / total
                            )
                        ):
                            continue
                        nearest[y, x] = inverse
                        seen[y, x] = t
