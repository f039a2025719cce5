"""Shadow maps: the surface nearest to a light in each direction, drawn once per stage."""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from viewsphere.engines.raster.materials.kernels_filter import opacity
from viewsphere.engines.raster.materials.kernels_material import L_ALPHA, L_CASTS_FROM
from viewsphere.kernels.jit import inner, njit
from viewsphere.kernels.lanes import FAST

f4 = nb.float32
U = nb.uintp

# A view maps a homogeneous point to (u w, v w, q w, w): u and v in texels from the map's middle; q grows with the distance
# to the light and is linear in u and v on every plane: the distance itself for a distant light, -1 / distance for a near one.

STEP = 4  # texels from one of the finest cells to the next; each cell is two steps wide
COARSEST = 16  # minimum texels per side of a map's coarsest level
LEVELS = 12  # levels of depths: a map of 16 texels, doubled eleven times, is 32,768 texels wide, more than any map
GAP = 16  # unused texels between rows: without them the rows of a window would push each other out of the cache
STEEP = 15.0  # biases: steeper slopes in a cell are given up. Chosen with the biases, not measured alone
WIDE = 16  # texels of a row above which computing the covered part is worthwhile
ROUNDING = 1e-14  # some 50 units in the last place of a double: the error of the few sums before it
# Columns of Views.form: four rows of the matrix, then those that `kernels_direct_light.look` reads: texels per length (at
# distance 1), the bias in q of a distant light and in shares of q of a near one, the least q in the map, how far from the
# middle the map is read, half its size, whether the light is round, how an ellipse grows with the squared texels from the
# middle; a rectangle's half sides along the view's axes, or the radius and zeros: texels per q, the third per q alone; bounds
# of the light's half width and height in texels per q, how these grow per texel from the middle, whether wide penumbrae are
# filtered finely; the least half width of a filter in texels, and the factor for what such a filter hides.
TEXELS, BIAS_FAR, BIAS_NEAR, NEAREST, READ, MIDDLE, ROUND, TILT, SIDES = range(16, 25)
SPAN_U, SPAN_V, MORE, FINE, SHARPEST, DARKER = range(SIDES + 6, SIDES + 12)
FORM = SIDES + 12
# Columns of Views.grid: size, where the view's bounds begin, cells a side (a power of two), where each level of depths begins.
SIZE, BOUNDS_AT, CELLS, DEPTH_AT = 0, 1, 2, 3
GRID = 3 + LEVELS
# Columns of Views.bounds: everything in a cell lies between two parallel planes; q of both in the cell's middle, slopes per
# texel.
LOW, HIGH, ACROSS, DOWN = range(4)


@inner
def _alpha(surfaces, textures, t, g, h):
    """Alpha of triangle t at the weights g and h of its second and third corner."""
    i, j, k = surfaces.triangles[t]
    va, vb, vc = surfaces.vertices[i], surfaces.vertices[j], surfaces.vertices[k]
    m, f = surfaces.material[t], f4(1) - g - h
    u0, v0 = f * va[3] + g * vb[3] + h * vc[3], f * va[4] + g * vb[4] + h * vc[4]
    u1, v1 = f * va[5] + g * vb[5] + h * vc[5], f * va[6] + g * vb[6] + h * vc[6]
    alpha = (f * va[10] + g * vb[10] + h * vc[10]) * surfaces.looks[m, L_ALPHA]
    return alpha * opacity(surfaces, textures, m, u0, v0, u1, v1)


@njit
def see_vertices(vertices, base, matrix, corners):
    """(N, 4): a view's matrix times the places of `Surfaces.vertices` from `base` on, N of them. It does not use BLAS, whose
    threads wait for one another on busy cores.
    """
    for i in range(U(corners.shape[0])):
        v = U(base) + i
        x, y, z = vertices[v, U(11)], vertices[v, U(12)], vertices[v, U(13)]
        for k in range(U(4)):
            corners[i, k] = matrix[k, U(0)] * x + matrix[k, U(1)] * y + matrix[k, U(2)] * z + matrix[k, U(3)]


@inner
def _reach(corners, i, j, k, near, axis):
    """Lowest and highest place along an axis of a triangle's part in front of the near plane, in texels from the middle."""
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


@inner
def _between(a, b, c, low, high):
    """The part of [low, high] in which a x + b + c may be 0 or more, including rounding errors."""
    if a == 0.0:
        return low, high
    at = -(b + c) / a
    slack = ROUNDING * (abs(b) + abs(c)) / abs(a)
    if a > 0.0:
        return max(low, at - slack), high
    return low, min(high, at + slack)


@njit
def draw_depth(corners, base, surfaces, textures, begin, tilt, nearest, farthest):  # noqa: PLR0912, PLR0915, one loop
    """Draw q of all triangles at the texels' centres: the minimum into nearest (n, n + GAP), the maximum into farthest.

    corners (N, 4) float64: the vertices from `base` on in the axes of a view. Only points with w >= begin are drawn; if `tilt`
    is one over the squared texels per length, only points at least that far from the eye. In addition, a surface's alpha must
    reach its material's L_CASTS_FROM. farthest may be (0, 0) if it is not needed.
    """
    size = nearest.shape[0]
    half, last = 0.5 * size, size - 1.0
    near = begin / math.sqrt(1.0 + 2.0 * half * half * tilt)
    both = farthest.shape[0] > 0
    triangles, looks, own = surfaces.triangles, surfaces.looks, surfaces.material
    for t in range(triangles.shape[0]):
        threshold = looks[own[t], L_CASTS_FROM]
        if threshold > f4(1):
            continue
        i, j, k = U(triangles[t, 0]) - U(base), U(triangles[t, 1]) - U(base), U(triangles[t, 2]) - U(base)
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
            first, stop = left, right + 1
            if stop - first > WIDE:
                low, high = _between(a0, a1 * y, a2, -half, half)
                low, high = _between(b0, b1 * y, b2, low, high)
                low, high = _between(c0, c1 * y, c2, low, high)
                first, stop = max(first, math.floor(low + half) - 1), min(stop, math.ceil(high + half) + 1)
            for column in range(first, stop):
                x = column + 0.5 - half
                ea, eb, ec = a0 * x + a1 * y + a2, b0 * x + b1 * y + b2, c0 * x + c1 * y + c2
                total = ea + eb + ec
                if ea < 0.0 or eb < 0.0 or ec < 0.0 or (total * begin) * (total * begin) > 1.0 + (x * x + y * y) * tilt:
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
def finish_view(grid, form, depth, bounds):
    """Fill the bounds of a view's drawn map; return its smallest q.

    bounds (M, 4) are (inf, -inf, 0, 0) before: empty cells.
    """
    _find_slopes(grid, depth, form[BIAS_FAR] * f4(STEEP), form[BIAS_NEAR] * f4(STEEP), bounds)
    nearest = _enclose(grid, depth, bounds)
    _join(grid, bounds)
    return nearest


@inner
def _find_slopes(grid, depth, far, near, bounds):
    """ACROSS and DOWN of the finest cells: slopes of the first STEP x STEP texels if they may be one surface, otherwise NaN."""
    size, side, stride, last = grid[SIZE], grid[CELLS], grid[SIZE] + GAP, STEP - 1
    for y in range(0, size, STEP):
        for x in range(0, size, STEP):
            at, cell = grid[DEPTH_AT] + y * stride + x, U(grid[BOUNDS_AT] + (y * 2 * side + x) // STEP)
            for column in range(ACROSS, DOWN + 1):
                along, beside = (1, stride) if column == ACROSS else (stride, 1)
                total, count = f4(0), f4(0)
                for k in range(STEP):
                    z = depth[U(at + k * beside)]
                    step = depth[U(at + k * beside + last * along)] - z
                    if abs(step) < far + near * abs(z):
                        total, count = total + step, count + f4(last)
                bounds[cell, U(column)] = total / count


@inner(fastmath=FAST)
def _mean_slope(bounds, cell, right, below):
    """Mean ACROSS and DOWN of a cell and of its neighbours to the right and below, if these are known."""
    across, down, n, m = f4(0), f4(0), f4(0), f4(0)
    for k in range(4):
        own = U(cell + (k & 1) * right + (k >> 1) * below)
        x, y = bounds[own, U(ACROSS)], bounds[own, U(DOWN)]
        if abs(x) < f4(np.inf):
            across, n = across + x, n + f4(1)
        if abs(y) < f4(np.inf):
            down, m = down + y, m + f4(1)
    return across / max(n, f4(1)), down / max(m, f4(1))


@inner(fastmath=FAST)
def _enclose(grid, depth, bounds):
    """Fill all columns of the finest cells, given their slopes; return the smallest q."""
    size, side, stride = grid[SIZE], grid[CELLS], grid[SIZE] + GAP
    nearest, middle = f4(np.inf), f4(STEP - 0.5)
    for y in range(0, size, STEP):
        for x in range(0, size, STEP):
            at, cell = grid[DEPTH_AT] + y * stride + x, grid[BOUNDS_AT] + (y * 2 * side + x) // STEP
            wide, high = min(2 * STEP, size - x), min(2 * STEP, size - y)
            across, down = _mean_slope(bounds, cell, 1 if wide > STEP else 0, 2 * side if high > STEP else 0)
            low, top = f4(np.inf), f4(-np.inf)
            for j in range(high):
                off = down * (f4(j) - middle)
                for i in range(wide):
                    z = depth[U(at + i)]
                    nearest = min(nearest, z)
                    z -= off + across * (f4(i) - middle)
                    low, top = min(low, z), max(top, z)
                at += stride
            own = U(cell)
            bounds[own, U(LOW)], bounds[own, U(HIGH)], bounds[own, U(ACROSS)], bounds[own, U(DOWN)] = low, top, across, down
    return nearest


@inner(fastmath=FAST)
def _join(grid, bounds):
    """Fill the coarser cells, each from four adjacent cells of the previous level."""
    width, n, half, first = 2 * grid[CELLS], grid[CELLS] >> 1, f4(STEP), grid[BOUNDS_AT]
    at = first + 2 * n
    while n > 0:
        for y in range(n):
            for x in range(n):
                # Beyond the last cell there are no texels.
                right, below = 2 if x < n - 1 else 0, 2 if y < n - 1 else 0
                child = first + 2 * y * width + 2 * x
                across, down = _mean_slope(bounds, child, right, below * width)
                low, top = f4(np.inf), f4(-np.inf)
                for k in range(4):
                    i, j = (k & 1) * right, (k >> 1) * below
                    own = U(child + j * width + i)
                    a, b = bounds[own, U(ACROSS)], bounds[own, U(DOWN)]
                    off = (across * f4(i - 1) + down * f4(j - 1)) * half
                    slack = (abs(a - across) + abs(b - down)) * half
                    low, top = min(low, bounds[own, U(LOW)] - off - slack), max(top, bounds[own, U(HIGH)] - off + slack)
                own = U(at + y * width + x)
                bounds[own, U(LOW)], bounds[own, U(HIGH)], bounds[own, U(ACROSS)], bounds[own, U(DOWN)] = low, top, across, down
        first, at, n, half = at, at + n, n >> 1, half + half
