"""Maps of all directions: from an equirectangular picture to octahedral maps of what rough surfaces see, and the sky seen.

Octahedral maps (Engelhardt and Dachsbacher 2008) need no trigonometry and have no poles. z is up. The equirectangular picture
is Blender's: its middle lies towards +X, its left quarter towards +Y; the first row is up.
"""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from viewsphere.engines.raster.kernels_texture import FAST
from viewsphere.geometry.jit import njit

f4 = nb.float32
i4 = nb.int32
U = nb.uintp
CHUNK = 128
RX, RY, RZ, RU, RV, TOWARD = range(0, 6 * CHUNK, CHUNK)
SOFT_HORIZON = 0.025  # sine of the elevation within which the ground turns into sky, as mirrored
# Shared exponents (as OpenGL's RGB9_E5): nine bits a colour, five for their exponent.
_STEP = np.array([2.0 ** (k - 24) for k in range(32)], np.float32)
_MOST = 65408.0


@njit(fastmath=FAST)
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


@njit(fastmath=FAST)
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
def octahedral(picture, size, has_ground):
    """The (size, size, 4) map of an equirectangular picture (H, W, 3): colour, and the share that lies below the horizon.

    With ground, that share shows no colour: the ground's light is added when the map is read.
    """
    height, width = picture.shape[0], picture.shape[1]
    out = np.zeros((size, size, 4), np.float32)
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
                most = height // 2 - 1 if has_ground else height - 1  # the horizon's own row is the last of the sky
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
    return out


@njit
def solid_angles(size):
    """Solid angle of each texel of an octahedral map, (size, size)."""
    out = np.empty((size, size), np.float32)
    step = 1.0 / size
    for i in range(size):
        for j in range(size):
            u, v = (2 * j + 1) * step - 1, (2 * i + 1) * step - 1
            # On the octahedron's face the area is that of its projection times sqrt 3, at distance 1 / sqrt 3 from the middle.
            a, b = abs(u), abs(v)
            if a + b > 1:
                a, b = 1 - b, 1 - a
            z = 1 - a - b
            square = a * a + b * b + z * z
            out[i, j] = 4 * step * step / (square * math.sqrt(square))
    return out


@njit(fastmath=FAST)
def gathered(values, size, square):
    """What a wide lobe sees around each direction, (size, size, 4): all texels of a map are counted.

    square: of GGX's alpha; the lobe is that of a ray along the normal times the cosine, so 1 is a matt surface.
    """
    n = values.shape[0]
    area = solid_angles(n)
    source = np.empty((7, n * n), np.float32)
    for i in range(n):
        for j in range(n):
            k = i * n + j
            x, y, z = _direction(f4(2 * j + 1) / f4(n) - f4(1), f4(2 * i + 1) / f4(n) - f4(1))
            source[0, k], source[1, k], source[2, k] = x, y, z
            for c in range(4):
                source[3 + c, k] = values[i, j, c] * area[i, j]
    flat = area.reshape(-1)
    half = f4(0.5) * (f4(square) - f4(1))
    out = np.empty((size, size, 4), np.float32)
    for i in range(size):
        for j in range(size):
            x, y, z = _direction(f4(2 * j + 1) / f4(size) - f4(1), f4(2 * i + 1) / f4(size) - f4(1))
            r, g, b, a, total = f4(0), f4(0), f4(0), f4(0), f4(0)
            for k in range(n * n):
                cosine = max(x * source[0, k] + y * source[1, k] + z * source[2, k], f4(0))
                d = (f4(1) + cosine) * half + f4(1)
                weight = cosine / (d * d)
                r += weight * source[3, k]
                g += weight * source[4, k]
                b += weight * source[5, k]
                a += weight * source[6, k]
                total += weight * flat[k]
            s = f4(1) / total
            out[i, j, 0], out[i, j, 1], out[i, j, 2], out[i, j, 3] = r * s, g * s, b * s, min(a * s, f4(1))
    return out


@njit(fastmath=FAST)
def blurred(texels, levels, samples, size):
    """What a lobe sees around each direction, (size, size, 4).

    texels, levels: bordered maps, each half the size of the one before; samples (S, 5): x, y, z around the lobe's middle,
    weight (they add up to 1) and level.
    """
    out = np.zeros((size, size, 4), np.float32)
    for i in range(size):
        for j in range(size):
            x, y, z = _direction(f4(2 * j + 1) / f4(size) - f4(1), f4(2 * i + 1) / f4(size) - f4(1))
            # Two axes across: Duff et al. 2017.
            sign = f4(1) if z >= f4(0) else -f4(1)
            a = -f4(1) / (sign + z)
            b = x * y * a
            ax, ay, az = f4(1) + sign * x * x * a, sign * b, -sign * x
            bx, by, bz = b, sign + y * y * a, -y
            p0, p1, p2, p3 = f4(0), f4(0), f4(0), f4(0)
            for k in range(samples.shape[0]):
                p, q, r, weight = samples[k, 0], samples[k, 1], samples[k, 2], samples[k, 3]
                level = U(i4(samples[k, 4]))
                start, n = levels[level, 0], levels[level, 1]
                u, v = _coordinates(p * ax + q * bx + r * x, p * ay + q * by + r * y, p * az + q * bz + r * z)
                u, v = (u + f4(1)) * f4(0.5) * f4(n) + f4(0.5), (v + f4(1)) * f4(0.5) * f4(n) + f4(0.5)
                column, row = min(max(i4(u), i4(0)), n), min(max(i4(v), i4(0)), n)
                fx, fy = u - f4(column), v - f4(row)
                first = U(start + row * (n + i4(2)) + column)
                below = first + U(n + i4(2))
                s, t, m, o = texels[first], texels[first + U(1)], texels[below], texels[below + U(1)]
                wo = fx * fy * weight
                wm, wt = fy * weight - wo, fx * weight - wo
                ws = weight - wm - wt - wo
                p0 += s[0] * ws + t[0] * wt + m[0] * wm + o[0] * wo
                p1 += s[1] * ws + t[1] * wt + m[1] * wm + o[1] * wo
                p2 += s[2] * ws + t[2] * wt + m[2] * wm + o[2] * wo
                p3 += s[3] * ws + t[3] * wt + m[3] * wm + o[3] * wo
            out[i, j, 0], out[i, j, 1], out[i, j, 2], out[i, j, 3] = p0, p1, p2, min(p3, f4(1))
    return out


@njit
def packed(picture):
    """A picture (H, W, 3) as (H * W,) uint32 with a shared exponent: to 0.4 % of its brightest colour."""
    out = np.empty(picture.shape[0] * picture.shape[1], np.uint32)
    k = 0
    for i in range(picture.shape[0]):
        for j in range(picture.shape[1]):
            r = min(max(picture[i, j, 0], f4(0)), f4(_MOST))
            g = min(max(picture[i, j, 1], f4(0)), f4(_MOST))
            b = min(max(picture[i, j, 2], f4(0)), f4(_MOST))
            _, exponent = math.frexp(max(r, g, b))
            shared = min(max(exponent + 15, 0), 31)
            if max(r, g, b) / _STEP[shared] >= f4(511.5):
                shared += 1
            step = f4(1) / _STEP[shared]
            out[k] = (
                np.uint32(r * step + f4(0.5))
                | np.uint32(g * step + f4(0.5)) << np.uint32(9)
                | np.uint32(b * step + f4(0.5)) << np.uint32(18)
                | np.uint32(shared) << np.uint32(27)
            )
            k += 1
    return out


@njit(fastmath=FAST)
def _angle(y, x):
    """The angle of a vector in the plane, -pi..pi, to 1e-5."""
    a, b = abs(x), abs(y)
    t = min(a, b) / max(a, b, f4(1e-20))
    s = t * t
    r = f4(0.05265332) - s * f4(0.01172120)
    r = f4(0.99997726) + s * (f4(-0.33262347) + s * (f4(0.19354346) + s * (f4(-0.11643287) + s * r)))
    r *= t
    r = f4(math.pi / 2) - r if b > a else r
    r = f4(math.pi) - r if x < f4(0) else r
    return -r if y < f4(0) else r


@njit(fastmath=FAST)
def _rays(view, start, count, w):
    """World directions RX, RY, RZ of some samples, any length; those of a grid lie in one row."""
    r, lens = view.rotation, view.lens
    r00, r01, r02, r10, r11, r12, r20, r21, r22 = (
        r[0, 0], r[0, 1], r[0, 2], r[1, 0], r[1, 1], r[1, 2], r[2, 0], r[2, 1], r[2, 2],
    )  # fmt: skip
    if view.rays.shape[0] > 0:
        for i in range(count):
            ray = view.rays[U(start + i)]
            w[RX + i], w[RY + i], w[RZ + i] = ray[0], ray[1], ray[2]
    elif view.places.shape[0] > 0:
        for i in range(count):
            px, py = view.places[U(start + i), U(0)], view.places[U(start + i), U(1)]
            w[RX + i] = lens[0, 0] * px + lens[0, 1] * py + lens[0, 2]
            w[RY + i] = lens[1, 0] * px + lens[1, 1] * py + lens[1, 2]
            w[RZ + i] = f4(1)
    else:
        row = start // i4(view.columns)
        first, py = f4(start - row * i4(view.columns)) + f4(0.5), f4(row) + f4(0.5)
        m00, m10 = lens[0, 0], lens[1, 0]
        m01, m11 = lens[0, 1] * py + lens[0, 2], lens[1, 1] * py + lens[1, 2]
        for i in range(count):
            px = first + f4(i)
            w[RX + i], w[RY + i], w[RZ + i] = m00 * px + m01, m10 * px + m11, f4(1)
    for i in range(count):
        x, y, z = w[RX + i], w[RY + i], w[RZ + i]
        w[RX + i], w[RY + i], w[RZ + i] = r00 * x + r10 * y + r20 * z, r01 * x + r11 * y + r21 * z, r02 * x + r12 * y + r22 * z


@njit
def _level(view, surrounding):
    """The level of the picture whose texels are about as large as a pixel."""
    widest = surrounding.picture_levels[0, 1]
    texels = float(view.pixel) * widest / (2 * math.pi)
    level = math.floor(math.log2(max(texels, 1.0)) + 0.5)
    return min(level, surrounding.picture_levels.shape[0] - 1)


@njit(fastmath=FAST)
def _read(t):
    """Red, green and blue of a packed texel."""
    step = _STEP[U(t >> nb.uint32(27))]
    red, green, blue = t & nb.uint32(511), (t >> nb.uint32(9)) & nb.uint32(511), (t >> nb.uint32(18)) & nb.uint32(511)
    return f4(i4(red)) * step, f4(i4(green)) * step, f4(i4(blue)) * step


@njit(fastmath=FAST)
def _look_up(texels, first, width, height, count, w):
    """RX, RY, RZ: the picture's colours at column RU and row RV; bilinear."""
    zero, one = f4(0), f4(1)
    p, q, r, s = (zero, zero, zero), (zero, zero, zero), (zero, zero, zero), (zero, zero, zero)
    last_column, last_row = i4(-2), i4(-2)
    for i in range(count):
        u, v = w[RU + i], min(max(w[RV + i], zero), f4(height - 1))
        c0, r0 = min(max(i4(u + one), i4(0)), width) - i4(1), min(max(i4(v), i4(0)), height - i4(1))
        fx, fy = u - f4(c0), v - f4(r0)
        if c0 != last_column or r0 != last_row:  # neighbouring pixels often lie between the same four texels
            last_column, last_row = c0, r0
            c1 = c0 + i4(1) if c0 + i4(1) < width else i4(0)
            c0 = c0 if c0 >= 0 else width - i4(1)
            upper = first + r0 * width
            lower = first + min(r0 + i4(1), height - i4(1)) * width
            p, q = _read(texels[U(upper + c0)]), _read(texels[U(upper + c1)])
            r, s = _read(texels[U(lower + c0)]), _read(texels[U(lower + c1)])
        ws = fx * fy
        wq, wr = fx - ws, fy - ws
        wp = one - fx - wr
        w[RX + i] = p[0] * wp + q[0] * wq + r[0] * wr + s[0] * ws
        w[RY + i] = p[1] * wp + q[1] * wq + r[1] * wr + s[1] * ws
        w[RZ + i] = p[2] * wp + q[2] * wq + r[2] * wr + s[2] * ws


@njit
def _is_covered(radiance, start, count):
    least = f4(1)
    for i in range(count):
        least = min(least, radiance[U(start + i), U(3)])
    return least >= f4(1)


@njit(fastmath=FAST)
def sky_behind(view, surrounding, radiance):
    """Lay radiance (N, 4), scene-linear and premultiplied, over the sky, in place; no sky where the lens has no ray."""
    zero, one = f4(0), f4(1)
    count = radiance.shape[0]
    w = np.empty(6 * CHUNK, np.float32)
    level = U(_level(view, surrounding))
    levels = surrounding.picture_levels
    first, width, height = levels[level, U(0)], levels[level, U(1)], levels[level, U(2)]
    cosine, sine = surrounding.turn[0], surrounding.turn[1]
    scale, base, sun, glow, disc = surrounding.seen, surrounding.behind, surrounding.sun, surrounding.glow, surrounding.disc
    half, edge = surrounding.half_angle, one / max(view.pixel, f4(1e-6))
    sun_x, sun_y, sun_z = sun[0], sun[1], sun[2]
    s0, s1, s2, b0, b1, b2 = scale[0], scale[1], scale[2], base[0], base[1], base[2]
    columns, is_listed = i4(view.columns), view.places.shape[0] > 0
    start = i4(0)
    while start < count:
        n = min(i4(CHUNK), i4(count) - start)
        n = n if is_listed else min(n, columns - start % columns)
        if _is_covered(radiance, start, n):
            start += n
            continue
        _rays(view, start, n, w)
        for i in range(n):
            east, north, z = w[RX + i], w[RY + i], w[RZ + i]
            x, y = cosine * east + sine * north, cosine * north - sine * east
            w[RU + i] = (f4(0.5) - _angle(y, x) * f4(0.5 / math.pi)) * f4(width) - f4(0.5)
            w[RV + i] = (f4(0.5) - _angle(z, np.sqrt(x * x + y * y)) * f4(1 / math.pi)) * f4(height) - f4(0.5)
            w[TOWARD + i] = (east * sun_x + north * sun_y + z * sun_z) / np.sqrt(x * x + y * y + z * z)
        _look_up(surrounding.picture, first, width, height, n, w)
        for i in range(n):
            toward = w[TOWARD + i]
            if math.isnan(toward):
                continue
            p = radiance[U(start + i)]
            left = max(one - p[3], zero)
            red, green, blue = w[RX + i] * s0 + b0, w[RY + i] * s1 + b1, w[RZ + i] * s2 + b2
            if toward > zero:
                q = toward * toward
                q *= q
                halo = q * f4(0.12) + q * q * q * q * q * q * f4(0.25)
                within = min(max((half - np.sqrt(max(f4(2) - toward - toward, zero))) * edge + f4(0.5), zero), one)
                within = within if half > zero else zero
                red += halo * glow[0] + within * disc[0]
                green += halo * glow[1] + within * disc[1]
                blue += halo * glow[2] + within * disc[2]
            p[0] += left * red
            p[1] += left * green
            p[2] += left * blue
            p[3] += left
        start += n
