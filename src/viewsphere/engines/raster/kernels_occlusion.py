"""How much of the sky a place can see: a volume around the targets, a map of what they stand on, and reading both.

A cell of the volume holds, for the directions above the horizon and for those below, the visible share of the sphere and the
mean of the visible directions, which are spherical harmonics up to degree 1 (Ramamoorthi and Hanrahan 2001): the cosine-
weighted share that a surface with normal n can see is m + 2 v . n.
"""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from viewsphere.engines.raster.kernels_arrive import DISTANT, FACING, arrive, look
from viewsphere.engines.raster.kernels_block import (
    AO,
    BLOCK,
    BOUNCE,
    GROUND,
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
    OPEN,
    OPENX,
    OPENY,
    OPENZ,
    PIXEL,
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
from viewsphere.geometry.jit import njit

f4 = nb.float32
U = nb.uintp
SKY, LIGHT, WITHIN = LX, LY, LZ  # rows that no light needs yet
COEFFICIENTS = 8
HIDDEN = 0.03  # a cell that sees less lies within something
GAIN = 1.04  # what a plane's own horizon takes from directions that are as wide as a few dozen on the sphere
HORIZON = 0.03  # keeps the share of a sky that a surface hardly faces from being noise


@njit
def mark(surfaces, stop, corner, cells, push, wanted):
    """Mark the points of the volume that samples of the first `stop` triangles will read.

    corner (3,): where point (0, 0, 0) lies; cells: per length; push: how far from the surface the volume is read, in cells.
    """
    for t in range(stop):
        i, j, k = surfaces.triangles[t]
        a, b, c = surfaces.vertices[i], surfaces.vertices[j], surfaces.vertices[k]
        longest = 0.0
        for p, q in ((a, b), (b, c), (c, a)):
            longest = max(longest, (p[11] - q[11]) ** 2 + (p[12] - q[12]) ** 2 + (p[13] - q[13]) ** 2)
        parts = max(1, math.ceil(math.sqrt(longest) * cells * 1.5))
        for r in range(parts + 1):
            for s in range(parts + 1 - r):
                g, h = r / parts, s / parts
                f = 1.0 - g - h
                nx, ny, nz = f * a[0] + g * b[0] + h * c[0], f * a[1] + g * b[1] + h * c[1], f * a[2] + g * b[2] + h * c[2]
                length = push / max(math.sqrt(nx * nx + ny * ny + nz * nz), 1e-6)
                x = (f * a[11] + g * b[11] + h * c[11] - corner[0]) * cells
                y = (f * a[12] + g * b[12] + h * c[12] - corner[1]) * cells
                z = (f * a[13] + g * b[13] + h * c[13] - corner[2]) * cells
                for side in (-1.0, 1.0):
                    u, v, w = x + side * nx * length, y + side * ny * length, z + side * nz * length
                    column, row, layer = int(u), int(v), int(w)
                    if column < 0 or row < 0 or layer < 0:
                        continue
                    for m in range(layer, min(layer + 2, wanted.shape[0])):
                        for n in range(row, min(row + 2, wanted.shape[1])):
                            for o in range(column, min(column + 2, wanted.shape[2])):
                                wanted[m, n, o] = True


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


@njit
def ground_light(lights, corner, step, z, depth, ambient, floor):
    """Fill floor[..., 1], share of all light that reaches the ground, from floor[..., 0], its share of the sky's.

    corner: x and y of the middle of the first cell, step: a cell's width; depth: how far below z lamps are looked for;
    ambient: sum over the three colours of the irradiance that the open ground has from the sky.
    """
    b = np.zeros(ROWS * BLOCK, np.float32)
    n = floor.shape[0]
    for row in range(n):
        for start in range(0, n, BLOCK):
            count = min(BLOCK, n - start)
            for i in range(count):
                b[PX + i], b[PY + i], b[PZ + i] = corner[0] + f4(start + i) * step, corner[1] + f4(row) * step, z
                b[NX + i], b[NY + i], b[NZ + i], b[GX + i], b[GY + i], b[GZ + i] = f4(0), f4(0), f4(1), f4(0), f4(0), f4(1)
                b[PIXEL + i] = f4(2) * step
            for i in range(count):
                floor[row, start + i, 1] = ambient * floor[row, start + i, 0]
            total = np.full(BLOCK, ambient, np.float32)
            for k in range(lights.kind.shape[0]):
                # What lamps give the ground around has their shadows taken off already; what lies on it keeps their light in.
                is_lamp = lights.kind[k] != DISTANT
                for i in range(count):
                    b[PZ + i] = z - depth if is_lamp else z
                arrive(count, lights, k, b)
                for i in range(count):
                    got = (b[IR + i] + b[IG + i] + b[IB + i]) * max(b[LZ + i], f4(0))
                    left = got * b[SHARE + i]
                    floor[row, start + i, 1] += left
                    total[i] += left if is_lamp else got
            for i in range(count):
                most = total[i]
                floor[row, start + i, 1] = min(floor[row, start + i, 1] / most, f4(1)) if most > f4(0) else f4(1)


@njit(fastmath=FAST)
def _read_floor(count, floor, frame, b):
    """SKY and LIGHT, both shares of what the targets stand on, at each sample: from four cells; 1 beyond the map."""
    zero, one, half = f4(0), f4(1), f4(0.5)
    cells, corner_x, corner_y, last = frame[0], frame[1], frame[2], f4(floor.shape[0] - 1)
    for i in range(count):
        # A wall has the light of the ground before it, not of what it stands on.
        u, v = (b[PX + i] - corner_x) * cells + b[NX + i] - half, (b[PY + i] - corner_y) * cells + b[NY + i] - half
        sky, light = one, one
        if u >= zero and v >= zero and u < last and v < last:
            iu, iv = nb.int32(u), nb.int32(v)
            fu, fv = u - f4(iu), v - f4(iv)
            p, q, r, s = (one - fu) * (one - fv), fu * (one - fv), (one - fu) * fv, fu * fv
            x, y = U(iu), U(iv)
            z, w = x + U(1), y + U(1)
            sky = floor[y, x, 0] * p + floor[y, z, 0] * q + floor[w, x, 0] * r + floor[w, z, 0] * s
            light = floor[y, x, 1] * p + floor[y, z, 1] * q + floor[w, x, 1] * r + floor[w, z, 1] * s
        b[SKY + i], b[LIGHT + i] = sky, light


@njit(fastmath=FAST)
def _read_volume(count, volume, frame, b):
    """The volume's coefficients into T0..T7 at each sample: a little off its surface, from the points on its side.

    WITHIN: how far inside the volume that is, 0..1.
    """
    zero, one, half, hidden = f4(0), f4(1), f4(0.5), f4(0.02)
    corner_x, corner_y, corner_z, cells, push = frame[0], frame[1], frame[2], frame[3], frame[4]
    last_x, last_y, last_z = f4(volume.shape[2] - 1), f4(volume.shape[1] - 1), f4(volume.shape[0] - 1)
    for i in range(count):
        nx, ny, nz = b[NX + i], b[NY + i], b[NZ + i]
        px, py, pz = (b[PX + i] - corner_x) * cells, (b[PY + i] - corner_y) * cells, (b[PZ + i] - corner_z) * cells
        x, y, z = px + nx * push, py + ny * push, pz + nz * push
        within = min(max(min(x, last_x - x, y, last_y - y, z, last_z - z) * half, zero), one)
        b[WITHIN + i] = within
        if not within > zero:
            for k in range(COEFFICIENTS):
                b[T0 + k * BLOCK + i] = zero
            continue
        ix, iy, iz = nb.int32(x), nb.int32(y), nb.int32(z)
        fx, fy, fz = x - f4(ix), y - f4(iy), z - f4(iz)
        off = (f4(ix) - px) * nx + (f4(iy) - py) * ny + (f4(iz) - pz) * nz
        # A point behind the surface sees other things than the surface does.
        w0 = (one - fx) * (one - fy) * (one - fz) * min(max(off, hidden), one)
        w1 = fx * (one - fy) * (one - fz) * min(max(off + nx, hidden), one)
        w2 = (one - fx) * fy * (one - fz) * min(max(off + ny, hidden), one)
        w3 = fx * fy * (one - fz) * min(max(off + nx + ny, hidden), one)
        off += nz
        w4 = (one - fx) * (one - fy) * fz * min(max(off, hidden), one)
        w5 = fx * (one - fy) * fz * min(max(off + nx, hidden), one)
        w6 = (one - fx) * fy * fz * min(max(off + ny, hidden), one)
        w7 = fx * fy * fz * min(max(off + nx + ny, hidden), one)
        scale = one / max(w0 + w1 + w2 + w3 + w4 + w5 + w6 + w7, f4(1e-6))
        x0, y0, z0, x1, y1, z1 = U(ix), U(iy), U(iz), U(ix) + U(1), U(iy) + U(1), U(iz) + U(1)
        for k in range(COEFFICIENTS):
            near = w0 * volume[z0, y0, x0, U(k)] + w1 * volume[z0, y0, x1, U(k)]
            near += w2 * volume[z0, y1, x0, U(k)] + w3 * volume[z0, y1, x1, U(k)]
            far = w4 * volume[z1, y0, x0, U(k)] + w5 * volume[z1, y0, x1, U(k)]
            far += w6 * volume[z1, y1, x0, U(k)] + w7 * volume[z1, y1, x1, U(k)]
            b[T0 + k * BLOCK + i] = (near + far) * scale


@njit(fastmath=FAST)
def _shares(count, has_ground, b):
    """OPEN and BOUNCE from the coefficients, and the mean open direction within the surface's half of the sphere."""
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
        mx, my, mz = b[T1 + i] + b[T5 + i], b[T2 + i] + b[T6 + i], b[T3 + i] + b[T7 + i]
        out = min(mx * nx + my * ny + mz * nz, zero) - f4(1e-3)
        mx, my, mz = mx - out * nx, my - out * ny, mz - out * nz
        s = within / np.sqrt(mx * mx + my * my + mz * mz + f4(1e-12))
        mx, my, mz = nx * (one - within) + mx * s, ny * (one - within) + my * s, nz * (one - within) + mz * s
        s = one / np.sqrt(mx * mx + my * my + mz * mz + f4(1e-12))
        b[OPENX + i], b[OPENY + i], b[OPENZ + i] = mx * s, my * s, mz * s


@njit(fastmath=FAST)
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


@njit(fastmath=FAST)
def occlude(count, occlusion, b):
    """Fill OPEN, BOUNCE and OPENX..OPENZ of a block of the ground's samples or of others (row GROUND of its first).

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
            b[OPEN + i] = b[SKY + i] if is_ground and grounded else one
            b[BOUNCE + i], b[OPENX + i], b[OPENY + i], b[OPENZ + i] = one, b[NX + i], b[NY + i], b[NZ + i]
    if grounded and not is_ground:
        _near_floor(count, occlusion.floor_frame, b)
    for i in range(count):
        b[OPEN + i] *= b[AO + i]
        b[BOUNCE + i] *= b[AO + i]
