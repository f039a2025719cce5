"""What a shadow map leaves of its light, for the samples of a block.

Percentage-closer soft shadows (Fernando 2005), where a texel blocks only if it lies between the sample and some part of the
light, as in backprojection (Guennebaud et al. 2006); the filter is a window of the map's own texels, on a coarser level the
wider it is, so that nothing is random. Samples that bounds of the depths show to be lit or dark are not filtered.
"""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from viewsphere.engines.raster.kernels_block import (
    GX,
    GY,
    GZ,
    IB,
    IG,
    IR,
    PIXEL,
    PX,
    PY,
    PZ,
    SHARE,
    T1,
    T2,
    T3,
    T4,
    T5,
    T6,
    T7,
)  # fmt: skip
from viewsphere.engines.raster.kernels_shadow import (
    A_U,
    A_V,
    A_W,
    B_U,
    B_V,
    B_W,
    BIAS_FAR,
    BIAS_NEAR,
    COARSEST,
    DEPTH_AT,
    FINE,
    HIGHS_AT,
    LOWS_AT,
    MIDDLE,
    NEAREST,
    READ,
    ROUND,
    SIZE,
    SLANT,
    TEXELS,
    WIDE,
)  # fmt: skip
from viewsphere.engines.raster.kernels_texture import FAST
from viewsphere.geometry.jit import njit

f4 = nb.float32
i4 = nb.int32
U = nb.uintp
# Rows while a view is looked at; the irradiance comes after. RADIUS holds at first how many texels the light is wide per q.
U_, V_, Q_, DU, DV, NEAR, SOFT, RADIUS, STATE, FACING = T1, T2, T3, T4, T5, T6, T7, IR, IG, IB
SHARPEST, BLUNTEST = 1.2, 16.0  # texels: least half width of a filter, and most that a pixel's size asks for


@njit(fastmath=FAST)
def _project(count, form, k, b):
    """Where a view sees the samples: U and V in texels, Q, its slopes, Q less the bias, the least filter; RADIUS; STATE."""
    zero, one, half, tiny = f4(0), f4(1), f4(0.5), f4(1e-6)
    m00, m01, m02, m03 = form[k, 0], form[k, 1], form[k, 2], form[k, 3]
    m10, m11, m12, m13 = form[k, 4], form[k, 5], form[k, 6], form[k, 7]
    m20, m21, m22, m23 = form[k, 8], form[k, 9], form[k, 10], form[k, 11]
    m30, m31, m32, m33 = form[k, 12], form[k, 13], form[k, 14], form[k, 15]
    texels, reach, middle = form[k, TEXELS], form[k, READ], form[k, MIDDLE]
    far_bias, near_bias, slant, is_round = form[k, BIAS_FAR], form[k, BIAS_NEAR], form[k, SLANT], form[k, ROUND]
    au, av, aw, bu, bv, bw = form[k, A_U], form[k, A_V], form[k, A_W], form[k, B_U], form[k, B_V], form[k, B_W]
    per = one / (texels * texels)
    for i in range(count):
        x, y, z, gx, gy, gz = b[PX + i], b[PY + i], b[PZ + i], b[GX + i], b[GY + i], b[GZ + i]
        w = m30 * x + m31 * y + m32 * z + m33
        inverse = one / max(w, tiny)
        u, v = (m00 * x + m01 * y + m02 * z + m03) * inverse, (m10 * x + m11 * y + m12 * z + m13) * inverse
        q = (m20 * x + m21 * y + m22 * z + m23) * inverse
        facing = b[FACING + i]
        slope = per / max(facing, tiny)
        du, dv = (gx * m00 + gy * m01 + gz * m02) * slope, (gx * m10 + gy * m11 + gz * m12) * slope
        b[U_ + i], b[V_ + i], b[Q_ + i], b[DU + i], b[DV + i] = u + middle, v + middle, q, du, dv
        b[NEAR + i] = q - far_bias - near_bias * abs(q) - f4(0.6) * (abs(du) + abs(dv))
        b[SOFT + i] = min(max(b[PIXEL + i] * texels * inverse * half, f4(SHARPEST)), f4(BLUNTEST))
        x, y = u * slant, v * slant
        width = max(abs(au - x * aw) + abs(bu - x * bw), abs(av - y * aw) + abs(bv - y * bw))
        longer = np.sqrt(one + (x * x + y * y) * is_round)
        b[RADIUS + i] = width * longer
        b[STATE + i] = -one if max(abs(u), abs(v)) <= reach and w > tiny and facing > zero else f4(-2)


@njit(fastmath=FAST)
def _fetch(source, start, stride, rows, window):
    """Copy rows of WIDE numbers."""
    at, to = U(start), U(0)
    for _ in range(rows):
        for c in range(WIDE):
            window[to + U(c)] = source[at + U(c)]
        to += U(WIDE)
        at += U(stride)


@njit(fastmath=FAST)
def _hits(window, cells, x, y, cell, most, q, pad, near, du, dv):
    """How many cells, in rows of WIDE, may by their least q hide part of the light; no less than the greatest distance in q."""
    zero, one = f4(0), f4(1)
    hits, total = zero, zero
    for i in range(cells):
        n = i4(i)
        dx, dy = x + f4(n & i4(WIDE - 1)) * cell, y + f4(n >> i4(3)) * cell
        z = window[U(i)]
        gap = min(max(q - z, f4(-1e9)), f4(1e9))
        reach = most * gap + pad
        hit = one if z < near + du * dx + dv * dy else zero
        hit *= one if dx * dx + dy * dy <= reach * reach else zero
        hits += hit
        gap *= hit
        gap *= gap
        total += gap * gap
    return hits, np.sqrt(np.sqrt(total))


@njit(fastmath=FAST)
def _is_dark(window, cells, x, y, cell, beyond, near, du, dv):
    """Whether even the greatest q of all cells within reach is nearer than the plane."""
    zero, one = f4(0), f4(1)
    lit = zero
    for i in range(cells):
        n = i4(i)
        dx, dy = x + f4(n & i4(WIDE - 1)) * cell, y + f4(n >> i4(3)) * cell
        inside = one if dx * dx + dy * dy <= beyond * beyond else zero
        lit += zero if window[U(i)] < near + du * dx + dv * dy else inside
    return lit == zero


@njit(fastmath=FAST)
def _decide(count, form, grid, bounds, k, window, b):
    """STATE of samples that bounds show to be lit (1) or dark (0); of others the RADIUS to search stays."""
    zero, one = f4(0), f4(1)
    nearest, middle, size = form[k, NEAREST], form[k, MIDDLE], i4(grid[k, SIZE])
    for i in range(count):
        if b[STATE + i] != -one:
            continue
        u, v, q, near, softest, most = b[U_ + i], b[V_ + i], b[Q_ + i], b[NEAR + i], b[SOFT + i], b[RADIUS + i]
        if near <= nearest:
            b[STATE + i] = one
            continue
        du, dv = b[DU + i], b[DV + i]
        tilt = f4(0.5) * (abs(du) + abs(dv))
        radius = min(most * (q - nearest) + softest, middle)
        for _ in range(4):
            level, cell, n = 1, f4(2), (size + i4(1)) >> i4(1)
            while radius + radius > f4(WIDE - 1) * cell and n > i4(WIDE):
                level, cell, n = level + 1, cell + cell, (n + i4(1)) >> i4(1)
            per, stride = one / cell, max(n, i4(WIDE))
            left, top = min(i4(max((u - radius) * per, zero)), stride - i4(WIDE)), i4(max((v - radius) * per, zero))
            rows = min(i4((v + radius) * per), n - i4(1)) - top + i4(1)
            cells, offset = rows * i4(WIDE), nb.int64(top) * stride + left
            x, y = (f4(left) + f4(0.5)) * cell - u, (f4(top) + f4(0.5)) * cell - v
            # Texels' centres lie a texel less apart than their cells are wide.
            margin, around = tilt * (cell - one), f4(0.71) * cell
            _fetch(bounds, grid[k, U(LOWS_AT + level)] + offset, stride, rows, window)
            hits, gap = _hits(window, cells, x, y, cell, most, q, softest + around, near + margin, du, dv)
            if hits == zero:
                b[STATE + i] = one
                break
            if hits + hits >= f4(rows * rows):
                _fetch(bounds, grid[k, U(HIGHS_AT + level)] + offset, stride, rows, window)
                if _is_dark(window, cells, x, y, cell, radius + around, near - margin, du, dv):
                    b[STATE + i] = zero
                    break
            tight = min(most * gap + softest, radius)
            is_tight = tight > f4(0.6) * radius
            radius = tight
            if is_tight:
                break
        b[RADIUS + i] = radius


@njit(fastmath=FAST)
def _axes(form, k, u, v):
    """Half the light's size along two axes in texels per q, whether it is round, the matrix from texels to those axes; how far
    the light reaches along u or v, in texels per q.

    Of a part of the light at s, in the view's axes, a blocker hides what lies f (s_u - x s_w) texels per q from the sample that
    is seen at the tangent x. A ball looks like an ellipse away from the middle: its longer axis is shrunk to a disc.
    """
    one = f4(1)
    x, y = (u - form[k, MIDDLE]) * form[k, SLANT], (v - form[k, MIDDLE]) * form[k, SLANT]
    if form[k, ROUND] > f4(0):
        longer = np.sqrt(one + x * x + y * y)
        s = -one / (longer * (one + longer))
        half = form[k, A_U]
        return (half, half, one, one + s * x * x, s * x * y, s * x * y, one + s * y * y), half * longer
    au, av = form[k, A_U] - x * form[k, A_W], form[k, A_V] - y * form[k, A_W]
    bu, bv = form[k, B_U] - x * form[k, B_W], form[k, B_V] - y * form[k, B_W]
    most = max(abs(au) + abs(bu), abs(av) + abs(bv))
    half_a, half_b = np.sqrt(au * au + av * av + f4(1e-12)), np.sqrt(bu * bu + bv * bv + f4(1e-12))
    au, av, bu, bv = au / half_a, av / half_a, bu / half_b, bv / half_b
    det = au * bv - av * bu
    # Seen along its plane a rectangle is a line.
    r = one / (max(det, f4(0.2)) if det >= f4(0) else min(det, f4(-0.2)))
    return (half_a, half_b, f4(0), bv * r, -bu * r, -av * r, au * r), most


@njit(fastmath=FAST)
def _blockers(window, rows, x, y, step, axes, q, near, du, dv, softest):
    """Number of texels in rows of 8 that hide part of the light, and the sum of their distances in q.

    (x, y) is the window's corner from the sample and `step` a texel's width, in the map's texels.
    """
    zero, one = f4(0), f4(1)
    half_a, half_b, is_round, a0, a1, b0, b1 = axes
    softest += step * f4(0.75)
    count, total = zero, zero
    for i in range(nb.int32(8) * rows):
        k = nb.int32(i)
        dx, dy = x + f4(k & nb.int32(7)) * step, y + f4(k >> nb.int32(3)) * step
        z = window[U(i)]
        gap = min(max(q - z, f4(-1e9)), f4(1e9))
        a, b = a0 * dx + a1 * dy, b0 * dx + b1 * dy
        reach_a, reach_b = half_a * gap + softest, half_b * gap + softest
        hit = one if z < near + du * dx + dv * dy else zero
        hit *= one if a * a + b * b * is_round <= reach_a * reach_a else zero
        hit *= one if b * b <= reach_b * reach_b else zero
        count += hit
        total += hit * gap
    return count, total


@njit(fastmath=FAST)
def _filtered(window, log, x, y, step, axes, q, near, du, dv, softest, radius_a, radius_b):
    """Share of the texels within a filter of these half widths (texels of the map) that hide nothing of the light."""
    zero, one, half = f4(0), f4(1), f4(0.5)
    half_a, half_b, is_round, a0, a1, b0, b1 = axes
    mask = (nb.int32(1) << log) - nb.int32(1)
    per = one / step
    soft_a, soft_b = radius_a * per + half, radius_b * per + half
    # A disc's edge is one texel wide: near its rim (1 - d^2 / r^2) r / 2 is r - d.
    rim, fall = (soft_a + half) * half, half * per / radius_a
    softest += step
    # What lies deep behind others that are nearer to the light hides more than its own penumbra tells.
    half_a, half_b = half_a * f4(3), half_b * f4(3)
    lit, whole = zero, zero
    for i in range(nb.int32(1) << (log + log)):
        k = nb.int32(i)
        dx, dy = x + f4(k & mask) * step, y + f4(k >> log) * step
        z = window[U(i)]
        gap = min(max(q - z, f4(-1e9)), f4(1e9))
        a, b = abs(a0 * dx + a1 * dy), abs(b0 * dx + b1 * dy)
        reach_a, reach_b = half_a * gap + softest, half_b * gap + softest
        hit = one if z < near + du * dx + dv * dy else zero
        hit *= one if a * a + b * b * is_round <= reach_a * reach_a else zero
        hit *= one if b * b <= reach_b * reach_b else zero
        disc = min(max(rim - (a * a + b * b) * fall, zero), one)
        square = min(max(soft_a - a * per, zero), one) * min(max(soft_b - b * per, zero), one)
        weight = square + (disc - square) * is_round
        whole += weight
        lit += weight - weight * hit
    return lit / max(whole, f4(1e-6))


@njit(fastmath=FAST)
def _level_for(radius, most, size):
    """The finest level of a map on which a radius is at most so many texels."""
    level = nb.int32(0)
    while radius > most and size >> (level + nb.int32(1)) >= nb.int32(COARSEST):
        level += nb.int32(1)
        radius *= f4(0.5)
    return level


@njit(fastmath=FAST)
def _search(count, form, grid, depth, k, window, b):
    """STATE of the other samples: within RADIUS for blockers, then within their penumbra."""
    one, half = f4(1), f4(0.5)
    size, fine = nb.int32(grid[k, SIZE]), form[k, FINE] > f4(0)
    for i in range(count):
        if b[STATE + i] != -one:
            continue
        u, v, q, near, du, dv = b[U_ + i], b[V_ + i], b[Q_ + i], b[NEAR + i], b[DU + i], b[DV + i]
        softest, radius = b[SOFT + i], b[RADIUS + i]
        axes, most = _axes(form, k, u, v)
        share, radius_a, radius_b = one, softest, softest
        for filtering in range(2):
            # Blockers are sought on 8 x 8 texels or 4 x 8, a wide penumbra is filtered on 16 x 16.
            log = nb.int32(4) if filtering == 1 and fine and radius > f4(2.5) else nb.int32(3)
            level = _level_for(radius, f4(2.25) if log == nb.int32(3) else f4(6.5), size)
            step, middle, n = f4(1 << level), half + f4(1 << level >> 1), size >> level
            x, y = (u - middle) / step, (v - middle) / step
            wide = nb.int32(1) << log
            rows = nb.int32(4) if filtering == 0 and radius <= f4(1.5) else wide
            left = min(max(nb.int32(math.floor(x)) - (wide >> 1) + nb.int32(1), nb.int32(0)), n - wide)
            top = min(max(nb.int32(math.floor(y)) - (rows >> 1) + nb.int32(1), nb.int32(0)), n - rows)
            at, to = U(grid[k, U(DEPTH_AT) + U(level)] + nb.int64(top) * n + left), U(0)
            for _r in range(rows):
                for part in range(0, wide, 8):
                    for c in range(8):
                        window[to + U(c)] = depth[at + U(part) + U(c)]
                    to += U(8)
                at += U(n)
            dx, dy = (f4(left) - x) * step, (f4(top) - y) * step
            if filtering == 0:
                found, total = _blockers(window, rows, dx, dy, step, axes, q, near, du, dv, softest)
                if found == f4(0):
                    break
                gap = total / found
                radius_a, radius_b = max(axes[0] * gap, softest), max(axes[1] * gap, softest)
                radius = max(most * gap, softest)
            else:
                share = _filtered(window, log, dx, dy, step, axes, q, near, du, dv, softest, radius_a, radius_b)
        b[STATE + i] = share


@njit(fastmath=FAST)
def look(count, form, grid, depth, bounds, k, window, b):
    """Multiply SHARE by what view k (uintp) of these `Views` leaves of its light, where the samples are on its map.

    FACING holds the cosine between the surface and the light, times the distance to a light at a place; it becomes 0 where
    this view has told; where it is not above 0, nothing changes. (GX, GY, GZ) may be zero where there is no surface. window
    (256,) float32: scratch.
    """
    zero, one = f4(0), f4(1)
    _project(count, form, k, b)
    _decide(count, form, grid, bounds, k, window, b)
    _search(count, form, grid, depth, k, window, b)
    for i in range(count):
        told = b[STATE + i] >= zero
        b[SHARE + i] *= b[STATE + i] if told else one
        b[FACING + i] = zero if told else b[FACING + i]
