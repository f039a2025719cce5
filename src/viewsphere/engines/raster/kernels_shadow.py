"""Shadow maps: what is nearest to a light, drawn once a stage."""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from viewsphere.engines.raster.kernels_filter import opacity
from viewsphere.engines.raster.kernels_material import L_ALPHA, L_CASTS_FROM
from viewsphere.geometry.jit import njit

f4 = nb.float32
U = nb.uintp

# A view maps a homogeneous point to (u w, v w, q w, w): u and v in texels from the map's middle, q growing with
# the distance to the light and linear in u and v on every plane: the distance itself from afar, -1 / distance from near.

SPAN = 8  # texels a side of the smallest cell that has bounds
COARSEST = 16  # texels a side that a map's coarsest level has at least
LEVELS = 12
# Columns of Views.form: four rows of the matrix, then what `kernels_arrive.look` needs: texels per length (at distance 1), the
# bias in q from afar and in shares of q from near, the least q there is, how far from the middle the map is read, half its
# size, whether the light is round, half its size along two axes in texels per q, the matrix from texels to those axes, whether
# wide penumbrae are filtered finely.
TEXELS, BIAS_FAR, BIAS_NEAR, NEAREST, READ, MIDDLE, ROUND, HALF_A, HALF_B, TO_A0, TO_A1, TO_B0, TO_B1, FINE = range(16, 30)
FORM = 30
# Columns of Views.grid: size, where each level of the depths begins, where each level of the bounds begins.
SIZE, DEPTH_AT, BOUNDS_AT = 0, 1, 1 + LEVELS
GRID = 1 + 2 * LEVELS


@njit
def _alpha(surfaces, textures, t, g, h):
    """Alpha of triangle t where its second and third corner weigh g and h."""
    i, j, k = surfaces.triangles[t]
    va, vb, vc = surfaces.vertices[i], surfaces.vertices[j], surfaces.vertices[k]
    m, f = surfaces.material[t], f4(1) - g - h
    u0, v0 = f * va[3] + g * vb[3] + h * vc[3], f * va[4] + g * vb[4] + h * vc[4]
    u1, v1 = f * va[5] + g * vb[5] + h * vc[5], f * va[6] + g * vb[6] + h * vc[6]
    alpha = (f * va[10] + g * vb[10] + h * vc[10]) * surfaces.looks[m, L_ALPHA]
    return alpha * opacity(surfaces, textures, m, u0, v0, u1, v1)


@njit
def _reach(corners, i, j, k, near, axis):
    """Least and greatest place along an axis of a triangle's part in front of the near plane, in texels from the middle."""
    low, high = np.inf, -np.inf
    for step in range(3):
        p, q = (i, j) if step == 0 else ((j, k) if step == 1 else (k, i))
        w, x = corners[p, 3], corners[p, axis]
        if w >= near:
            low, high = min(low, x / w), max(high, x / w)
        if (w >= near) != (corners[q, 3] >= near):
            s = (near - w) / (corners[q, 3] - w)
            x = (x + s * (corners[q, axis] - x)) / near
            low, high = min(low, x), max(high, x)
    return low, high


@njit
def draw_depth(corners, surfaces, textures, near, nearest, farthest):  # noqa: PLR0912, PLR0915, one loop
    """Draw q of all triangles over the texels' centres: the least into nearest (n, n), the greatest into farthest.

    corners (V, 4) float64: the vertices seen from a view. Only what has w >= near is drawn, and only where a surface's alpha
    reaches its material's L_CASTS_FROM. farthest may be (0, 0).
    """
    size = nearest.shape[0]
    half, last = 0.5 * size, size - 1.0
    both = farthest.shape[0] > 0
    triangles, looks, own = surfaces.triangles, surfaces.looks, surfaces.material
    for t in range(triangles.shape[0]):
        threshold = looks[own[t], L_CASTS_FROM]
        if threshold > f4(1):
            continue
        i, j, k = U(triangles[t, 0]), U(triangles[t, 1]), U(triangles[t, 2])
        ax, ay, aw = corners[i, 0], corners[i, 1], corners[i, 3]
        bx, by, bw = corners[j, 0], corners[j, 1], corners[j, 3]
        cx, cy, cw = corners[k, 0], corners[k, 1], corners[k, 3]
        if (ax < -half * aw and bx < -half * bw and cx < -half * cw) or (ax > half * aw and bx > half * bw and cx > half * cw):
            continue
        if (ay < -half * aw and by < -half * bw and cy < -half * cw) or (ay > half * aw and by > half * bw and cy > half * cw):
            continue
        if aw < near and bw < near and cw < near:
            continue
        low_x, high_x, low_y, high_y = min(ax, bx, cx), max(ax, bx, cx), min(ay, by, cy), max(ay, by, cy)
        if min(aw, bw, cw) < 1.0 or max(aw, bw, cw) > 1.0:
            low_x, high_x = _reach(corners, i, j, k, near, 0)
            low_y, high_y = _reach(corners, i, j, k, near, 1)
        left, right = math.ceil(max(low_x + half - 0.5, 0.0)), math.floor(min(high_x + half - 0.5, last))
        top, bottom = math.ceil(max(low_y + half - 0.5, 0.0)), math.floor(min(high_y + half - 0.5, last))
        if left > right or top > bottom:
            continue
        a0, a1, a2 = by * cw - bw * cy, bw * cx - bx * cw, bx * cy - by * cx
        b0, b1, b2 = cy * aw - cw * ay, cw * ax - cx * aw, cx * ay - cy * ax
        c0, c1, c2 = ay * bw - aw * by, aw * bx - ax * bw, ax * by - ay * bx
        det = a0 * ax + a1 * ay + a2 * aw
        if det == 0.0:
            continue
        r = 1.0 / det
        a0, a1, a2, b0, b1, b2, c0, c1, c2 = a0 * r, a1 * r, a2 * r, b0 * r, b1 * r, b2 * r, c0 * r, c1 * r, c2 * r
        aq, bq, cq = corners[i, 2], corners[j, 2], corners[k, 2]
        q0, q1, q2 = a0 * aq + b0 * bq + c0 * cq, a1 * aq + b1 * bq + c1 * cq, a2 * aq + b2 * bq + c2 * cq
        for row in range(top, bottom + 1):
            y = row + 0.5 - half
            for column in range(left, right + 1):
                x = column + 0.5 - half
                ea, eb, ec = a0 * x + a1 * y + a2, b0 * x + b1 * y + b2, c0 * x + c1 * y + c2
                total = ea + eb + ec
                if ea < 0.0 or eb < 0.0 or ec < 0.0 or total * near > 1.0:
                    continue
                q = f4(q0 * x + q1 * y + q2)
                is_near, is_far = q < nearest[U(row), U(column)], both and q > farthest[U(row), U(column)]
                if not (is_near or is_far):
                    continue
                b_share, c_share = f4(eb / total), f4(ec / total)
                if threshold > f4(0) and _alpha(surfaces, textures, t, b_share, c_share) < threshold:
                    continue
                if is_near:
                    nearest[U(row), U(column)] = q
                if is_far:
                    farthest[U(row), U(column)] = q


@njit
def finish_view(grid, depth, bounds):  # noqa: PLR0912, nested loops
    """Fill the coarser levels of a view's drawn map, and its bounds; returns its smallest q.

    A level takes every second texel of the one before in both directions. Bounds are the least and the greatest q of a cell
    of SPAN texels; each further level joins 2 x 2 cells.
    """
    size = grid[SIZE]
    base = depth[grid[DEPTH_AT] : grid[DEPTH_AT] + size * size].reshape(size, size)
    level = 1
    while level < LEVELS and size >> level >= COARSEST:
        n, middle, at = size >> level, 1 << (level - 1), grid[DEPTH_AT + level]
        for y in range(n):
            row = base[(y << level) + middle]
            for x in range(n):
                depth[at + y * n + x] = row[(x << level) + middle]
        level += 1
    n = size // SPAN
    at = grid[BOUNDS_AT]
    for y in range(n):
        for x in range(n):
            low, high = f4(np.inf), f4(-np.inf)
            for v in range(SPAN):
                row = base[U(y * SPAN + v)]
                for u in range(SPAN):
                    z = row[U(x * SPAN + u)]
                    low, high = min(low, z), max(high, z)
            bounds[at + y * n + x, 0], bounds[at + y * n + x, 1] = low, high
    for k in range(1, LEVELS):
        if n == 1:
            break
        m, below = (n + 1) // 2, at
        at = grid[BOUNDS_AT + k]
        for y in range(m):
            for x in range(m):
                low, high = f4(np.inf), f4(-np.inf)
                for v in range(2 * y, min(2 * y + 2, n)):
                    for u in range(2 * x, min(2 * x + 2, n)):
                        low, high = min(low, bounds[below + v * n + u, 0]), max(high, bounds[below + v * n + u, 1])
                bounds[at + y * m + x, 0], bounds[at + y * m + x, 1] = low, high
        n = m
    return bounds[at, 0]
