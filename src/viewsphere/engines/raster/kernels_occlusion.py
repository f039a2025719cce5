"""How much of the sky a place can see: a volume around the targets, a map of what they stand on, and reading both.

A cell of the volume holds, for the directions above the horizon and for those below, the visible share of the sphere and the
mean of the visible directions, which are spherical harmonics up to degree 1 (Ramamoorthi and Hanrahan 2001): the cosine-
weighted share that a surface with normal n can see is m + 2 v . n.
"""

from __future__ import annotations

import numba as nb
import numpy as np

from viewsphere.engines.raster.kernels_arrive import FACING, look
from viewsphere.engines.raster.kernels_blend import blend
from viewsphere.engines.raster.kernels_block import (
    AO,
    BLOCK,
    BOUNCE,
    GROUND,
    IR,
    LX,
    LY,
    LZ,
    NX,
    NY,
    NZ,
    OPEN,
    PX,
    PY,
    PZ,
    ROWS,
    SCENERY,
    SHARE,
    T0,
    T1,
    T2,
    T3,
    T4,
    T5,
    T6,
    T7,
)  # fmt: skip
from viewsphere.engines.raster.kernels_texture import FAST
from viewsphere.geometry.jit import inner, njit

f4 = nb.float32
i4 = nb.int32
U = nb.uintp
_blend2, _blend8 = blend(2), blend(8)
SKY, LIGHT, WITHIN, PLACE = LX, LY, LZ, IR  # rows that no light needs yet
COEFFICIENTS = 8
HIDDEN = 0.03  # a cell that sees less lies within something
GAIN = 1.04  # what a plane's own horizon takes from directions that are as wide as a few dozen on the sphere
HORIZON = 0.03  # keeps the share of a sky that a surface hardly faces from being noise


@njit
def see(points, views, directions, out):
    """For each point (N, 3) the visible share and mean direction above the horizon and below, into out (N, 8)."""
    b = np.zeros(ROWS * BLOCK, np.float32)
    window = np.empty(256, np.float32)
    per = f4(1.0 / directions.shape[0])
    for start in range(0, points.shape[0], BLOCK):
        count = min(BLOCK, points.shape[0] - start)
        for i in range(count):
            for k in range(3):
                b[PX + k * BLOCK + i] = points[start + i, k]
        for d in range(directions.shape[0]):
            x, y, z = directions[d, 0], directions[d, 1], directions[d, 2]
            for i in range(count):
                b[SHARE + i], b[FACING + i] = f4(1), f4(1)
            look(count, views.form, views.grid, views.depth, views.bounds, U(d), window, b)
            first = 0 if z > f4(0) else 4
            for i in range(count):
                share = b[SHARE + i] * per
                out[start + i, first] += share
                out[start + i, first + 1] += share * x
                out[start + i, first + 2] += share * y
                out[start + i, first + 3] += share * z


@njit
def spread(volume, known):
    """Give unknown points beside known ones their mean, once; returns what is known then."""
    layers, rows, columns = known.shape
    after = known.copy()
    total = np.empty(COEFFICIENTS, np.float32)
    for m in range(layers):
        for n in range(rows):
            for o in range(columns):
                if known[m, n, o]:
                    continue
                count = 0
                total[:] = f4(0)
                for k in range(6):
                    step = 1 if k % 2 else -1
                    p, q, r = m + (step if k < 2 else 0), n + (step if k // 2 == 1 else 0), o + (step if k > 3 else 0)
                    if 0 <= p < layers and 0 <= q < rows and 0 <= r < columns and known[p, q, r]:
                        count += 1
                        for c in range(COEFFICIENTS):
                            total[c] += volume[p, q, r, c]
                if count > 0:
                    for c in range(COEFFICIENTS):
                        volume[m, n, o, c] = total[c] / f4(count)
                    after[m, n, o] = True
    return after


@inner(fastmath=FAST, inline="always")
def _read_floor(count, floor, frame, b):
    """SKY and LIGHT, both shares of what the targets stand on, at each sample: from four cells; 1 beyond the map."""
    zero, one, half = f4(0), f4(1), f4(0.5)
    cells, corner_x, corner_y, last = frame[0], frame[1], frame[2], f4(floor.shape[0] - 1)
    within = 0
    for i in range(count):
        # A wall has the light of the ground before it, not of what it stands on.
        u, v = (b[PX + i] - corner_x) * cells + b[NX + i] - half, (b[PY + i] - corner_y) * cells + b[NY + i] - half
        is_within = u >= zero and v >= zero and u < last and v < last
        within += 1 if is_within else 0
        column, row = f4(i4(u if is_within else zero)), f4(i4(v if is_within else zero))
        fu, fv = u - column, v - row
        right = fu * fv
        b[T0 + i] = row * (last + one) + column + one if is_within else zero
        b[T1 + i], b[T2 + i], b[T3 + i], b[T4 + i] = one - fu - fv + right, fu - right, fv - right, right
        b[SKY + i], b[LIGHT + i] = one, one
    if within > 0:
        across = U(floor.shape[0])
        for i in range(count):
            if b[T0 + i] > zero:
                p = U(i4(b[T0 + i])) - U(1)
                q = p + across
                weights = b[T1 + i], b[T2 + i], b[T3 + i], b[T4 + i]
                _blend2(floor, (p, p + U(1), q, q + U(1)), weights, b, U(SKY) + U(i))


@inner(fastmath=FAST, inline="always")
def _read_volume(count, volume, frame, b):
    """The volume's coefficients into T0..T7 at each sample: a little off its surface, from the points on its side.

    WITHIN: how far inside the volume that is, 0..1.
    """
    zero, one, half, hidden = f4(0), f4(1), f4(0.5), f4(0.02)
    corner_x, corner_y, corner_z, cells, push = frame[0], frame[1], frame[2], frame[3], frame[4]
    columns, rows = f4(volume.shape[2]), f4(volume.shape[1])
    last_x, last_y, last_z = columns - one, rows - one, f4(volume.shape[0] - 1)
    for i in range(count):
        nx, ny, nz = b[NX + i], b[NY + i], b[NZ + i]
        px, py, pz = (b[PX + i] - corner_x) * cells, (b[PY + i] - corner_y) * cells, (b[PZ + i] - corner_z) * cells
        x, y, z = px + nx * push, py + ny * push, pz + nz * push
        within = min(max(min(x, last_x - x, y, last_y - y, z, last_z - z) * half, zero), one)
        b[WITHIN + i] = within
        # What is no number lies at the first point.
        x, y, z = x if within > zero else zero, y if within > zero else zero, z if within > zero else zero
        ix, iy, iz = f4(i4(x)), f4(i4(y)), f4(i4(z))
        fx, fy, fz = x - ix, y - iy, z - iz
        gx, gy, gz = one - fx, one - fy, one - fz
        b[PLACE + i] = (iz * rows + iy) * columns + ix
        off = (ix - px) * nx + (iy - py) * ny + (iz - pz) * nz
        # A point behind the surface sees other things than the surface does.
        w0, w1 = gx * gy * gz * min(max(off, hidden), one), fx * gy * gz * min(max(off + nx, hidden), one)
        w2, w3 = gx * fy * gz * min(max(off + ny, hidden), one), fx * fy * gz * min(max(off + nx + ny, hidden), one)
        off += nz
        w4, w5 = gx * gy * fz * min(max(off, hidden), one), fx * gy * fz * min(max(off + nx, hidden), one)
        w6, w7 = gx * fy * fz * min(max(off + ny, hidden), one), fx * fy * fz * min(max(off + nx + ny, hidden), one)
        scale = one / max(w0 + w1 + w2 + w3 + w4 + w5 + w6 + w7, f4(1e-6))
        b[T0 + i], b[T1 + i], b[T2 + i], b[T3 + i] = w0 * scale, w1 * scale, w2 * scale, w3 * scale
        b[T4 + i], b[T5 + i], b[T6 + i], b[T7 + i] = w4 * scale, w5 * scale, w6 * scale, w7 * scale
    across, layer = U(volume.shape[2]), U(volume.shape[1]) * U(volume.shape[2])
    for i in range(count):
        p = U(i4(b[PLACE + i]))
        q, r = p + across, p + layer
        s = r + across
        near, far = (b[T0 + i], b[T1 + i], b[T2 + i], b[T3 + i]), (b[T4 + i], b[T5 + i], b[T6 + i], b[T7 + i])
        _blend8(volume, (p, p + U(1), q, q + U(1), r, r + U(1), s, s + U(1)), (*near, *far), b, U(T0) + U(i))


@inner(fastmath=FAST, inline="always")
def _shares(count, has_ground, b):
    """OPEN and BOUNCE from the coefficients."""
    zero, one, half, two, eps, gain = f4(0), f4(1), f4(0.5), f4(2), f4(HORIZON), f4(GAIN)
    for i in range(count):
        nx, ny, nz, within = b[NX + i], b[NY + i], b[NZ + i], b[WITHIN + i]
        up = b[T0 + i] + two * (b[T1 + i] * nx + b[T2 + i] * ny + b[T3 + i] * nz)
        down = b[T4 + i] + two * (b[T5 + i] * nx + b[T6 + i] * ny + b[T7 + i] * nz)
        above = min(max((up * gain + eps) / (half + half * nz + eps), zero), one)
        below = min(max((down * gain + eps) / (half - half * nz + eps), zero), one)
        whole = min(max((up + down) * gain, zero), one)
        above, below = whole + (above - whole) * has_ground, whole + (below - whole) * has_ground
        b[OPEN + i], b[BOUNCE + i] = one + (above - one) * within, one + (below - one) * within


@inner(fastmath=FAST, inline="always")
def _near_floor(count, frame, b):
    """What the targets stand on sends up less light beside them; scenery that it is, is as dark as it."""
    zero, one = f4(0), f4(1)
    z, rise = frame[3], one / (f4(0.35) * frame[4])
    for i in range(count):
        height = (b[PZ + i] - z) * rise
        light = b[LIGHT + i]
        b[BOUNCE + i] *= light + (one - light) * f4(0.6) * min(max(height, zero), one)
        # Scenery that faces up about as low as the targets stand is what they stand on.
        close = max(one - abs(height), zero) * max(b[NZ + i], zero) * b[SCENERY + i]
        b[OPEN + i] += (min(b[OPEN + i], b[SKY + i]) - b[OPEN + i]) * close


@inner(fastmath=FAST)
def occlude(count, occlusion, b):
    """Fill OPEN and BOUNCE of a block of the ground's samples or of others (row GROUND of its first).

    With a ground, OPEN is the share of the cosine-weighted upper sky, BOUNCE that of the ground's light; without one both are
    the share of the whole hemisphere above the surface. The occlusion texture (row AO) is in both.
    """
    zero, one = f4(0), f4(1)
    is_ground, grounded = b[GROUND] > zero, occlusion.floor_frame[5] > zero
    if grounded:
        _read_floor(count, occlusion.floor, occlusion.floor_frame, b)
    if occlusion.frame[5] > zero and not is_ground:
        _read_volume(count, occlusion.volume, occlusion.frame, b)
        _shares(count, occlusion.frame[6], b)
    else:
        for i in range(count):
            b[OPEN + i], b[BOUNCE + i] = b[SKY + i] if is_ground and grounded else one, one
    if grounded and not is_ground:
        _near_floor(count, occlusion.floor_frame, b)
    for i in range(count):
        b[OPEN + i] *= b[AO + i]
        b[BOUNCE + i] *= b[AO + i]
