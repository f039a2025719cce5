"""How much of each light arrives at the samples of a block: distance, cone, and shadows that soften with distance.

Soft shadows: percentage-closer soft shadows (Fernando 2005), where a texel blocks only if it lies between the sample and some
part of the light, as in backprojection (Guennebaud et al. 2006); the filter is a window of the map's own texels, on a
coarser level the wider it is, so that nothing is random. Area lights: the light vector of a polygon (Lambert 1760).
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
    LX,
    LY,
    LZ,
    NX,
    NY,
    NZ,
    PIXEL,
    PX,
    PY,
    PZ,
    SHARE,
    T0,
    T1,
    T2,
    T3,
    T4,
    T5,
    T6,
    T7,
    WIDTH,
)  # fmt: skip
from viewsphere.engines.raster.kernels_shadow import (
    BIAS_FAR,
    BIAS_NEAR,
    BOUNDS_AT,
    COARSEST,
    DEPTH_AT,
    FINE,
    HALF_A,
    HALF_B,
    MIDDLE,
    NEAREST,
    READ,
    ROUND,
    SIZE,
    SPAN,
    TEXELS,
    TO_A0,
    TO_A1,
    TO_B0,
    TO_B1,
)  # fmt: skip
from viewsphere.engines.raster.kernels_texture import FAST
from viewsphere.geometry.jit import njit

f4 = nb.float32
U = nb.uintp
DISTANT, POINT, SPOT, AREA = 0, 1, 2, 3
# Rows while a view is looked at; the irradiance comes after.
U_, V_, Q_, DU, DV, NEAR, SOFT, RADIUS, STATE, FACING = T1, T2, T3, T4, T5, T6, T7, IR, IG, IB
SHARPEST, BLUNTEST = 1.2, 16.0  # texels: least half width of a filter, and most that a pixel's size asks for
GRAZING = 0.02  # a plane's slope in a map is limited to that of a light this far above it


@njit(fastmath=FAST)
def _is_any_nearer(window, rows, log, x, y, step, near, du, dv):
    """Whether any texel in rows of 2^log lies before the plane: on most surfaces none does, and that is quickly told."""
    hits, mask = nb.int32(0), (nb.int32(1) << log) - nb.int32(1)
    for i in range(rows << log):
        k = nb.int32(i)
        dx, dy = x + f4(k & mask) * step, y + f4(k >> log) * step
        hits += nb.int32(1) if window[U(i)] < near + du * dx + dv * dy else nb.int32(0)
    return hits > nb.int32(0)


@njit(fastmath=FAST)
def _blockers(window, rows, log, x, y, step, axes, q, near, du, dv, softest):
    """Number of texels in rows of 2^log that hide part of the light, and the sum of their distances in q.

    (x, y) is the window's corner from the sample and `step` a texel's width, in the map's texels.
    """
    zero, one = f4(0), f4(1)
    half_a, half_b, is_round, a0, a1, b0, b1 = axes
    mask = (nb.int32(1) << log) - nb.int32(1)
    softest += step * f4(0.75)
    count, total = zero, zero
    for i in range(rows << log):
        k = nb.int32(i)
        dx, dy = x + f4(k & mask) * step, y + f4(k >> log) * step
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
def _project(count, form, k, b):
    """Where a view sees the samples: U and V in texels, Q, its slopes, Q less the bias, the least filter; STATE."""
    zero, one, half, tiny = f4(0), f4(1), f4(0.5), f4(1e-6)
    m00, m01, m02, m03 = form[k, 0], form[k, 1], form[k, 2], form[k, 3]
    m10, m11, m12, m13 = form[k, 4], form[k, 5], form[k, 6], form[k, 7]
    m20, m21, m22, m23 = form[k, 8], form[k, 9], form[k, 10], form[k, 11]
    m30, m31, m32, m33 = form[k, 12], form[k, 13], form[k, 14], form[k, 15]
    texels, reach, middle = form[k, TEXELS], form[k, READ], form[k, MIDDLE]
    far_bias, near_bias = form[k, BIAS_FAR], form[k, BIAS_NEAR]
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
        b[STATE + i] = -one if max(abs(u), abs(v)) <= reach and w > tiny and facing > zero else f4(-2)


@njit(fastmath=FAST)
def _bound(count, form, grid, bounds, k, b):
    """STATE of samples that bounds show to be lit (1) or dark (0); of others the RADIUS to search stays."""
    zero, one = f4(0), f4(1)
    nearest, most, half = form[k, NEAREST], max(form[k, HALF_A], form[k, HALF_B]), form[k, MIDDLE]
    cells = nb.int32(grid[k, SIZE]) // nb.int32(SPAN)
    for i in range(count):
        if b[STATE + i] != -one:
            continue
        u, v, q, near, softest = b[U_ + i], b[V_ + i], b[Q_ + i], b[NEAR + i], b[SOFT + i]
        if near <= nearest:
            b[STATE + i] = one
            continue
        tilt = abs(b[DU + i]) + abs(b[DV + i])
        radius = min(most * (q - nearest) + softest, half)
        for _ in range(3):
            n, level, cell = cells, nb.int32(0), f4(SPAN)
            while cell < radius + radius and n > nb.int32(1):
                level += nb.int32(1)
                cell += cell
                n = (n + nb.int32(1)) >> nb.int32(1)
            per, last = one / cell, n - nb.int32(1)
            x0 = min(max(nb.int32((u - radius) * per), nb.int32(0)), last)
            x1 = min(max(nb.int32((u + radius) * per), nb.int32(0)), last)
            y0 = min(max(nb.int32((v - radius) * per), nb.int32(0)), last)
            y1 = min(max(nb.int32((v + radius) * per), nb.int32(0)), last)
            at = nb.int64(grid[k, U(BOUNDS_AT) + U(level)])
            c00, c01, c10, c11 = U(at + y0 * n + x0), U(at + y0 * n + x1), U(at + y1 * n + x0), U(at + y1 * n + x1)
            low = min(bounds[c00, 0], bounds[c01, 0], bounds[c10, 0], bounds[c11, 0])
            if near + tilt * radius <= low:
                b[STATE + i] = one
                break
            high = max(bounds[c00, 1], bounds[c01, 1], bounds[c10, 1], bounds[c11, 1])
            if near - tilt * radius > high:
                b[STATE + i] = zero
                break
            tight = min(most * max(q - low, zero) + softest, radius)
            if tight > f4(0.6) * radius:
                radius = tight
                break
            radius = tight
        b[RADIUS + i] = radius


@njit(fastmath=FAST)
def _search(count, form, grid, depth, k, window, b):
    """STATE of the other samples: within RADIUS for blockers, then within their penumbra."""
    one, half = f4(1), f4(0.5)
    axes = (
        form[k, HALF_A], form[k, HALF_B], form[k, ROUND],
        form[k, TO_A0], form[k, TO_A1], form[k, TO_B0], form[k, TO_B1],
    )  # fmt: skip
    size, fine = nb.int32(grid[k, SIZE]), form[k, FINE] > f4(0)
    for i in range(count):
        if b[STATE + i] != -one:
            continue
        u, v, q, near, du, dv = b[U_ + i], b[V_ + i], b[Q_ + i], b[NEAR + i], b[DU + i], b[DV + i]
        softest, radius = b[SOFT + i], b[RADIUS + i]
        share, radius_a, radius_b = one, softest, softest
        for filtering in range(2):
            # Blockers are sought on 8 x 8 texels or 4 x 8, those of a wide light and a wide penumbra on 16 x 16.
            log = nb.int32(4) if fine and radius > (f4(2.5) if filtering == 1 else f4(9)) else nb.int32(3)
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
                if not _is_any_nearer(window, rows, log, dx, dy, step, near, du, dv):
                    break
                found, total = _blockers(window, rows, log, dx, dy, step, axes, q, near, du, dv, softest)
                if found == f4(0):
                    break
                gap = total / found
                radius_a, radius_b = max(axes[0] * gap, softest), max(axes[1] * gap, softest)
                radius = max(radius_a, radius_b)
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
    _project(count, form, k, b)
    _bound(count, form, grid, bounds, k, b)
    _search(count, form, grid, depth, k, window, b)
    zero, one = f4(0), f4(1)
    for i in range(count):
        told = b[STATE + i] >= zero
        b[SHARE + i] *= b[STATE + i] if told else one
        b[FACING + i] = zero if told else b[FACING + i]


@njit(fastmath=FAST)
def _edge(ax, ay, az, bx, by, bz):
    """One edge's part of a polygon's light vector: the arc's length about the plane through both unit vectors."""
    one = f4(1)
    c = ax * bx + ay * by + az * bz
    y = min(abs(c), one)
    # Arc cosine: Abramowitz and Stegun 4.4.45.
    arc = np.sqrt(one - y) * (f4(1.5707288) + y * (f4(-0.2121144) + y * (f4(0.0742610) + y * f4(-0.0187293))))
    arc = arc if c >= f4(0) else f4(math.pi) - arc
    s = arc / np.sqrt(max(one - y * y, f4(1e-12)))
    s = s if y < f4(0.999999) else one
    return (ay * bz - az * by) * s, (az * bx - ax * bz) * s, (ax * by - ay * bx) * s


@njit(fastmath=FAST)
def _from_area(count, lights, k, b):
    """Direction and size (into T0) of the irradiance of a rectangle of unit strength."""
    zero, one = f4(0), f4(1)
    cx, cy, cz = lights.place[k, 0], lights.place[k, 1], lights.place[k, 2]
    wx, wy, wz = lights.axis[k, 0], lights.axis[k, 1], lights.axis[k, 2]
    rx, ry, rz = lights.right[k, 0], lights.right[k, 1], lights.right[k, 2]
    ux, uy, uz = lights.up[k, 0], lights.up[k, 1], lights.up[k, 2]
    radius = lights.radius[k]
    across, along = rx * rx + ry * ry + rz * rz, ux * ux + uy * uy + uz * uz
    scale = f4(0.125) / max(f4(math.sqrt(across * along)), f4(1e-12))
    size = f4(math.sqrt(across + along))
    for i in range(count):
        x, y, z = cx - b[PX + i], cy - b[PY + i], cz - b[PZ + i]
        squared = x * x + y * y + z * z + f4(1e-12)
        inverse = one / np.sqrt(squared)
        lx, ly, lz = x * inverse, y * inverse, z * inverse
        front = max(-(lx * wx + ly * wy + lz * wz), zero)
        far = front / max(squared, radius * radius * f4(0.01))
        close = min(max(size * inverse * f4(10) - f4(0.5), zero), one)  # 0 below a twentieth, 1 from 0.15
        ax, ay, az = x - rx - ux, y - ry - uy, z - rz - uz
        dx, dy, dz = x + rx - ux, y + ry - uy, z + rz - uz
        ex, ey, ez = x + rx + ux, y + ry + uy, z + rz + uz
        gx, gy, gz = x - rx + ux, y - ry + uy, z - rz + uz
        s = one / np.sqrt(ax * ax + ay * ay + az * az + f4(1e-12))
        ax, ay, az = ax * s, ay * s, az * s
        s = one / np.sqrt(dx * dx + dy * dy + dz * dz + f4(1e-12))
        dx, dy, dz = dx * s, dy * s, dz * s
        s = one / np.sqrt(ex * ex + ey * ey + ez * ez + f4(1e-12))
        ex, ey, ez = ex * s, ey * s, ez * s
        s = one / np.sqrt(gx * gx + gy * gy + gz * gz + f4(1e-12))
        gx, gy, gz = gx * s, gy * s, gz * s
        px, py, pz = _edge(ax, ay, az, dx, dy, dz)
        qx, qy, qz = _edge(dx, dy, dz, ex, ey, ez)
        sx, sy, sz = _edge(ex, ey, ez, gx, gy, gz)
        tx, ty, tz = _edge(gx, gy, gz, ax, ay, az)
        px, py, pz = (px + qx + sx + tx) * scale, (py + qy + sy + ty) * scale, (pz + qz + sz + tz) * scale
        s = f4(-1) if px * lx + py * ly + pz * lz < zero else one
        # In the rectangle's own plane rounding would decide between all of its light and none.
        s = s * close if front > size * inverse * f4(1e-3) else zero
        px, py, pz = px * s + lx * far * (one - close), py * s + ly * far * (one - close), pz * s + lz * far * (one - close)
        strength = np.sqrt(px * px + py * py + pz * pz)
        s = one / max(strength, f4(1e-20))
        dark = strength <= f4(1e-20)
        b[LX + i] = lx if dark else px * s
        b[LY + i] = ly if dark else py * s
        b[LZ + i] = lz if dark else pz * s
        b[T0 + i] = strength
        b[WIDTH + i] = min(radius * inverse, f4(0.5 * math.pi))


@njit(fastmath=FAST)
def _from_place(count, lights, k, b):
    """Direction and size (into T0) of the irradiance of a point or spot of unit strength."""
    zero, one = f4(0), f4(1)
    cx, cy, cz = lights.place[k, 0], lights.place[k, 1], lights.place[k, 2]
    wx, wy, wz = lights.axis[k, 0], lights.axis[k, 1], lights.axis[k, 2]
    radius, outer, ramp = lights.radius[k], lights.cone[k, 0], lights.cone[k, 1]
    for i in range(count):
        x, y, z = cx - b[PX + i], cy - b[PY + i], cz - b[PZ + i]
        squared = x * x + y * y + z * z + f4(1e-12)
        inverse = one / np.sqrt(squared)
        x, y, z = x * inverse, y * inverse, z * inverse
        inside = min(max((-(x * wx + y * wy + z * wz) - outer) * ramp, zero), one)
        b[LX + i], b[LY + i], b[LZ + i] = x, y, z
        b[T0 + i] = inside * inside * (f4(3) - inside - inside) / max(squared, radius * radius)
        b[WIDTH + i] = min(radius * inverse, f4(0.5 * math.pi))


@njit(fastmath=FAST)
def _shadows(count, lights, k, b):
    """Multiply SHARE by what the light's views see: for each sample the first of them that it is on."""
    zero, one = f4(0), f4(1)
    distant = one if lights.kind[k] == DISTANT else zero
    cx, cy, cz = lights.place[k, 0], lights.place[k, 1], lights.place[k, 2]
    left = zero
    for i in range(count):
        # The views look from a rectangle's middle, which is not where most of its light comes from.
        x, y, z = cx - b[PX + i] * (one - distant), cy - b[PY + i] * (one - distant), cz - b[PZ + i] * (one - distant)
        facing = b[GX + i] * x + b[GY + i] * y + b[GZ + i] * z
        facing = max(facing, f4(GRAZING) * np.sqrt(x * x + y * y + z * z))
        b[FACING + i] = facing if b[SHARE + i] > zero else zero
        left += b[FACING + i]
    views = lights.views
    window = np.empty(256, np.float32)
    for which in range(lights.first[k], lights.first[k + U(1)]):
        if left > zero:
            look(count, views.form, views.grid, views.depth, views.bounds, U(which), window, b)
            left = zero
            for i in range(count):
                left += b[FACING + i]


@njit(fastmath=FAST)
def arrive(count, lights, k, b):
    """Fill LX..LZ, IR..IB, SHARE and WIDTH of a block for light k.

    The irradiance faces the light and has no shadows in it; SHARE is the share they leave. Where normals are smooth a facet
    that is turned away a little has light like its neighbours: far away from it, bumps have none.
    """
    zero, one = f4(0), f4(1)
    k = U(k)
    if lights.kind[k] == DISTANT:
        lx, ly, lz, width = lights.place[k, 0], lights.place[k, 1], lights.place[k, 2], lights.radius[k]
        for i in range(count):
            b[LX + i], b[LY + i], b[LZ + i], b[T0 + i], b[WIDTH + i] = lx, ly, lz, one, width
    elif lights.kind[k] == AREA:
        _from_area(count, lights, k, b)
    else:
        _from_place(count, lights, k, b)
    for i in range(count):
        lx, ly, lz = b[LX + i], b[LY + i], b[LZ + i]
        facing = b[GX + i] * lx + b[GY + i] * ly + b[GZ + i] * lz
        turned = b[NX + i] * lx + b[NY + i] * ly + b[NZ + i] * lz
        share = min(max(f4(1.6) + f4(4) * facing, zero), one) if turned > zero else zero
        b[SHARE + i] = share if b[T0 + i] > zero else zero
    if lights.first[k] < lights.first[k + U(1)]:
        _shadows(count, lights, k, b)
    red, green, blue = lights.color[k, 0], lights.color[k, 1], lights.color[k, 2]
    for i in range(count):
        arrives = b[T0 + i]
        b[IR + i], b[IG + i], b[IB + i] = red * arrives, green * arrives, blue * arrives
