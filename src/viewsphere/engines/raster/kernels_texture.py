"""Texture look-up: wrap modes, bilinear between two mip levels."""

from __future__ import annotations

import math

import numba as nb

from viewsphere.geometry.jit import njit

f4 = nb.float32
U = nb.uintp
FAST = {"contract", "arcp", "nsz", "afn", "reassoc"}
REPEAT, CLAMP, MIRROR = 0, 1, 2


@njit(fastmath=FAST)
def _neighbours(coordinate, size, wrap):
    """The two texels beside a coordinate and the second one's weight."""
    if wrap == REPEAT:
        coordinate -= f4(math.floor(coordinate))
    elif wrap == MIRROR:
        coordinate = abs(coordinate - f4(2) * f4(math.floor(coordinate * f4(0.5) + f4(0.5))))
    else:
        coordinate = min(max(coordinate, f4(0)), f4(1))
    x = coordinate * f4(size) - f4(0.5)
    first = nb.int32(math.floor(x))
    weight = x - f4(first)
    second = first + nb.int32(1)
    if wrap == REPEAT:
        first = size - nb.int32(1) if first < 0 else first
        second = nb.int32(0) if second >= size else second
    else:
        first = max(first, nb.int32(0))
        second = min(second, size - nb.int32(1))
    return first, second, weight


@njit(fastmath=FAST)
def _bilinear(textures, slot, level, u, v):
    start = textures.levels[slot, level, U(0)]
    width = textures.levels[slot, level, U(1)]
    x0, x1, fx = _neighbours(u, width, textures.modes[slot, U(1)])
    y0, y1, fy = _neighbours(v, textures.levels[slot, level, U(2)], textures.modes[slot, U(2)])
    if textures.modes[slot, U(3)] != 0:
        fx = f4(1) if fx >= f4(0.5) else f4(0)
        fy = f4(1) if fy >= f4(0.5) else f4(0)
    t = textures.texels
    a = t[U(start + y0 * width + x0)]
    b = t[U(start + y0 * width + x1)]
    c = t[U(start + y1 * width + x0)]
    d = t[U(start + y1 * width + x1)]
    scale = f4(1.0 / 65535.0)
    wa = (f4(1) - fx) * (f4(1) - fy) * scale
    wb = fx * (f4(1) - fy) * scale
    wc = (f4(1) - fx) * fy * scale
    wd = fx * fy * scale
    return (
        f4(a[0]) * wa + f4(b[0]) * wb + f4(c[0]) * wc + f4(d[0]) * wd,
        f4(a[1]) * wa + f4(b[1]) * wb + f4(c[1]) * wc + f4(d[1]) * wd,
        f4(a[2]) * wa + f4(b[2]) * wb + f4(c[2]) * wc + f4(d[2]) * wd,
        f4(a[3]) * wa + f4(b[3]) * wb + f4(c[3]) * wc + f4(d[3]) * wd,
    )


@njit(fastmath=FAST)
def look_up(textures, slot, uv, footprint):
    """Linear RGBA of a texture at these coordinates ((4,): u and v of both sets).

    footprint (4,): squares of a pixel's size in each coordinate; the mip level is that of the mean square in texels.
    """
    slot = U(slot)
    second = textures.modes[slot, U(4)] == 1
    s = uv[2] if second else uv[0]
    t = uv[3] if second else uv[1]
    m = textures.transforms[slot]
    u = m[0] * s + m[1] * t + m[2]
    v = m[3] * s + m[4] * t + m[5]
    ss = footprint[2] if second else footprint[0]
    tt = footprint[3] if second else footprint[1]
    width, height = f4(textures.levels[slot, U(0), U(1)]), f4(textures.levels[slot, U(0), U(2)])
    across = (m[0] * m[0] * ss + m[1] * m[1] * tt) * width * width
    texels = f4(0.5) * (across + (m[3] * m[3] * ss + m[4] * m[4] * tt) * height * height)
    if texels <= f4(1.001):
        return _bilinear(textures, slot, U(0), u, v)
    last = f4(textures.modes[slot, U(0)] - 1)
    lod = min(f4(0.5) * f4(math.log2(texels)), last)
    level = f4(math.floor(lod))
    fraction = lod - level
    a = _bilinear(textures, slot, U(level), u, v)
    if fraction == f4(0):
        return a
    b = _bilinear(textures, slot, U(level) + U(1), u, v)
    return (
        a[0] + (b[0] - a[0]) * fraction,
        a[1] + (b[1] - a[1]) * fraction,
        a[2] + (b[2] - a[2]) * fraction,
        a[3] + (b[3] - a[3]) * fraction,
    )
