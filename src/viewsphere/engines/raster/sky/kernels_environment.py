"""Maps of all directions: octahedral maps for rough surfaces, made from an equirectangular picture, and the visible sky.

Octahedral maps (Engelhardt and Dachsbacher 2008) need no trigonometry and have no poles. z is up. The equirectangular picture
follows Blender: its middle is towards +X, its left quarter towards +Y; the first row is up.
"""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from viewsphere.kernels.jit import inner, njit
from viewsphere.kernels.lanes import FAST, clamp, dot, lanewise, least, most, root, size, where

f4 = nb.float32
i4 = nb.int32
U = nb.uintp
CHUNK = 128
# Directions, then colours; places in the picture; cosines to the sun; four packed texels around a place, and its offset from
# the first of them.
RX, RY, RZ, RU, RV, TOWARD, P, Q, R, S, FX, FY = range(0, 12 * CHUNK, CHUNK)
ROWS = 12
# Rows of `Surrounding.light`.
SCALE, ABOVE, BELOW, LAMPS, TURN, BEHIND = range(6)
SOFT_HORIZON = 0.025  # sine of the elevation within which the ground turns into sky, as mirrored


@inner(fastmath=FAST)
def _direction(x, y):
    """The unit direction at octahedral coordinates in -1..1."""
    z = f4(1) - abs(x) - abs(y)
    if z < f4(0):
        x, y = (
            (f4(1) - abs(y)) * (f4(1) if x >= f4(0) else -f4(1)),
            (f4(1) - abs(x)) * (f4(1) if y >= f4(0) else -f4(1)),
        )
    s = f4(1) / f4(math.sqrt(x * x + y * y + z * z))
    return x * s, y * s, z * s


@inner(fastmath=FAST)
def _coordinates(x, y, z):
    """Octahedral coordinates in -1..1 of a direction of any length."""
    s = f4(1) / (abs(x) + abs(y) + abs(z) + f4(1e-20))
    x, y = x * s, y * s
    if z < f4(0):
        x, y = (
            (f4(1) - abs(y)) * (f4(1) if x >= f4(0) else -f4(1)),
            (f4(1) - abs(x)) * (f4(1) if y >= f4(0) else -f4(1)),
        )
    return x, y


@njit
def octahedral(picture, has_ground, out):
    """Add the octahedral map of an equirectangular picture (H, W, 3) to `out` (N, N, 4), which is 0 before.

    Columns: colour, and the share below the horizon.

    With a ground, that share has no colour: the ground's light is added when the map is read.
    """
    height, width, size = picture.shape[0], picture.shape[1], out.shape[0]
    for i in range(size):
        for j in range(size):
            for k in range(4):
                u = (f4(j) + f4(0.25) + f4(0.5) * f4(k & 1)) * f4(2) / f4(size) - f4(1)
                v = (f4(i) + f4(0.25) + f4(0.5) * f4(k >> 1)) * f4(2) / f4(size) - f4(1)
                x, y, z = _direction(u, v)
                t = min(max(z / f4(2 * SOFT_HORIZON) + f4(0.5), f4(0)), f4(1))
                share = f4(1) - t * t * (f4(3) - t - t)
                column = (f4(0.5) - f4(math.atan2(y, x)) * f4(0.5 / math.pi)) * f4(width) - f4(0.5)
                row = (f4(0.5) - f4(math.asin(min(max(z, f4(-1)), f4(1)))) * f4(1 / math.pi)) * f4(height) - f4(0.5)
                most = height // 2 - 1 if has_ground else height - 1  # the row at the horizon is the sky's last
                row = min(max(row, f4(0)), f4(most))
                r0 = i4(row)
                r1 = min(r0 + 1, height - 1)
                c0 = i4(math.floor(column))
                fx, fy = column - f4(c0), row - f4(r0)
                c1 = (c0 + 1) % width
                c0 = (c0 + width) % width
                weight = f4(0.25) * (f4(1) - share) if has_ground else f4(0.25)
                for c in range(3):
                    upper = picture[r0, c0, c] * (f4(1) - fx) + picture[r0, c1, c] * fx
                    lower = picture[r1, c0, c] * (f4(1) - fx) + picture[r1, c1, c] * fx
                    out[i, j, c] += (upper * (f4(1) - fy) + lower * fy) * weight
                out[i, j, 3] += share * f4(0.25)


@njit(fastmath=FAST)
def gathered(source, half, targets, out):
    """Write the light that a wide lobe around each of `targets` (M, 3) receives into out (M, 4).

    The light is a sum over all texels of a map. source (8, K): directions of texels, their four numbers times their solid
    angle, that angle. half: half of (GGX's alpha squared less 1); the lobe is that of a ray along the normal times the
    cosine, so that half = 0 is a matt surface.
    """
    for i in range(U(targets.shape[0])):
        x, y, z = targets[i, 0], targets[i, 1], targets[i, 2]
        r, g, b, a, total = f4(0), f4(0), f4(0), f4(0), f4(0)
        for k in range(U(source.shape[1])):
            cosine = max(x * source[0, k] + y * source[1, k] + z * source[2, k], f4(0))
            d = (f4(1) + cosine) * half + f4(1)
            weight = cosine / (d * d)
            r += weight * source[3, k]
            g += weight * source[4, k]
            b += weight * source[5, k]
            a += weight * source[6, k]
            total += weight * source[7, k]
        s = f4(1) / total
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = r * s, g * s, b * s, min(a * s, f4(1))


@njit(fastmath={"contract", "nsz"})
def blurred(texels, levels, samples, frames, out):
    """Write the light that a lobe around each direction receives into out (M, 4).

    texels, levels: bordered maps, each half the size of the one before; samples (S, 5): x, y, z around the lobe's middle,
    weight (all add up to 1) and mip level; frames (M, 9): two axes across the lobe's middle, and that middle. The four sums are
    added in order, since the compiler then works on four numbers at once.
    """
    one, half = f4(1), f4(0.5)
    for i in range(U(frames.shape[0])):
        f = frames[i]
        p0, p1, p2, p3 = f4(0), f4(0), f4(0), f4(0)
        for k in range(U(samples.shape[0])):
            p, q, r, weight = samples[k, 0], samples[k, 1], samples[k, 2], samples[k, 3]
            level = U(i4(samples[k, 4]))
            start, n = levels[level, 0], levels[level, 1]
            u, v = _coordinates(p * f[0] + q * f[3] + r * f[6], p * f[1] + q * f[4] + r * f[7], p * f[2] + q * f[5] + r * f[8])
            u, v = (u + one) * half * f4(n) + half, (v + one) * half * f4(n) + half
            column, row = min(max(i4(u), i4(0)), n), min(max(i4(v), i4(0)), n)
            fx, fy = u - f4(column), v - f4(row)
            first = U(start + row * (n + i4(2)) + column)
            for corner in range(4):
                texel = texels[first + (U(n + i4(2)) if corner > 1 else U(0)) + U(corner & 1)]
                share = weight * (fx if corner & 1 else one - fx) * (fy if corner > 1 else one - fy)
                p0 += texel[0] * share
                p1 += texel[1] * share
                p2 += texel[2] * share
                p3 += texel[3] * share
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = p0, p1, p2, min(p3, one)


def _angle(y, x):
    """The angle of a vector in the plane, -pi..pi, to 1e-5."""
    a, b = size(x), size(y)
    t = least(a, b) / most(most(a, b), 1e-20)
    s = t * t
    r = 0.05265332 - s * 0.01172120
    r = 0.99997726 + s * (-0.33262347 + s * (0.19354346 + s * (-0.11643287 + s * r)))
    r = r * t
    r = where(b > a, math.pi / 2 - r, r)
    r = where(x < 0, math.pi - r, r)
    return where(y < 0, -r, r)


@inner(fastmath=FAST)
def _read_texels(texels, first, width, height, count, w):
    """P to S: the four texels around column RU and row RV; FX, FY: the offset of that place from the first texel."""
    zero, one, packed = f4(0), f4(1), w.view(np.uint32)
    for i in range(U(count)):
        u, v = w[U(RU) + i], min(max(w[U(RV) + i], zero), f4(height - 1))
        c0, r0 = min(max(i4(u + one), i4(0)), width) - i4(1), min(max(i4(v), i4(0)), height - i4(1))
        w[U(FX) + i], w[U(FY) + i] = u - f4(c0), v - f4(r0)
        c1 = c0 + i4(1) if c0 + i4(1) < width else i4(0)
        c0 = c0 if c0 >= 0 else width - i4(1)
        upper = first + r0 * width
        lower = upper + (width if r0 + i4(1) < height else i4(0))
        packed[U(P) + i], packed[U(Q) + i] = texels[U(upper + c0)], texels[U(upper + c1)]
        packed[U(R) + i], packed[U(S) + i] = texels[U(lower + c0)], texels[U(lower + c1)]


@lanewise
def _blend_texels(w):
    """RX, RY, RZ: the picture's colours, bilinear. Its texels are packed as RGB9_E5, see `environment._packed`."""
    fx, fy = w[FX], w[FY]
    both = fx * fy
    totals = None
    for row, weight in ((P, 1 - fx - fy + both), (Q, fx - both), (R, fy - both), (S, both)):
        texel = w[row].bits()
        share = weight * (((texel >> 27) & 31) + 103).exponent()  # 2 ** (k - 24)
        colors = [((texel >> 9 * k) & 511).real() * share for k in range(3)]
        totals = colors if totals is None else [t + c for t, c in zip(totals, colors, strict=True)]
    w.put((RX, RY, RZ), totals)


@inner(fastmath=FAST)
def _rays(listed, columns, start, count, w):
    """RX, RY, RZ: directions of some samples, or their places in the image; samples of a grid are in one row."""
    if listed.shape[1] == 3:
        for i in range(count):
            ray = listed[U(start + i)]
            w[RX + i], w[RY + i], w[RZ + i] = ray[0], ray[1], ray[2]
    elif listed.shape[0] > 0:
        for i in range(count):
            place = listed[U(start + i)]
            w[RX + i], w[RY + i], w[RZ + i] = place[0], place[1], f4(1)
    else:
        row = start // columns
        across, down = f4(start - row * columns) + f4(0.5), f4(row) + f4(0.5)
        for i in range(count):
            w[RX + i], w[RY + i], w[RZ + i] = across + f4(i), down, f4(1)


@lanewise
def _aim(numbers, width, height, w):
    """RU, RV: the places in the picture where the rays end; TOWARD: cosines of their angles to the sun."""
    ray = w.get(RX, RY, RZ)
    x, y, z = (dot(tuple(numbers.one(3 * row + k) for k in range(3)), ray) for row in range(3))
    flat = x * x + y * y
    w[RU] = (0.5 - _angle(y, x) * (0.5 / math.pi)) * width - 0.5
    w[RV] = (0.5 - _angle(z, root(flat)) * (1 / math.pi)) * height - 0.5
    w[TOWARD] = dot((x, y, z), tuple(numbers.one(9 + k) for k in range(3))) / root(flat + z * z)


@lanewise
def _add_sun(numbers, w):
    """RX, RY, RZ: radiance of the sky with its sun, from the picture's radiance."""
    toward, half, edge = w[TOWARD], numbers.one(24), numbers.one(25)
    q = most(toward, 0)
    q = q * q
    q = q * q
    halo = q * 0.12 + q * q * q * q * q * q * 0.25
    within = clamp((half - root(most(2 - toward - toward, 0))) * edge + 0.5)
    within = where(half > 0, within, 0)
    for c, row in enumerate((RX, RY, RZ)):
        w[row] = w[row] * numbers.one(12 + c) + numbers.one(15 + c) + halo * numbers.one(18 + c) + within * numbers.one(21 + c)


@njit(fastmath=FAST)
def lay_over_sky(listed, columns, numbers, picture, first, width, height, w, radiance):
    """Composite radiance (N, 4), scene-linear and premultiplied, over the sky, in place; there is no sky if the lens has no
    ray.

    listed: rays (N, 3) or places (N, 2) of the samples; empty, (0, 2), for a grid of `columns` columns. numbers: (26,), put
    together by `environment.sky_behind`. picture: `Surrounding.picture`; first, width, height: the mip level to read. w:
    scratch of ROWS * CHUNK.
    """
    count, is_listed, one = i4(radiance.shape[0]), listed.shape[0] > 0, f4(1)
    start = i4(0)
    while start < count:
        n = min(i4(CHUNK), count - start)
        n = n if is_listed else min(n, columns - start % columns)
        open_ = 0
        for i in range(n):
            open_ += 1 if radiance[U(start + i), U(3)] < one else 0
        if open_ > 0:
            _rays(listed, columns, start, n, w)
            _aim(n, numbers, f4(width), f4(height), w)
            _read_texels(picture, first, width, height, n, w)
            _blend_texels(n, w)
            _add_sun(n, numbers, w)
            for i in range(n):
                if not math.isnan(w[TOWARD + i]):
                    p = radiance[U(start + i)]
                    left = max(one - p[3], f4(0))
                    for c in range(3):
                        p[c] += left * w[RX + c * CHUNK + i]
                    p[3] += left
        start += n
