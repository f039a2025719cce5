"""Filtered look-ups in bundles of textures: the part of a texture that a pixel covers, and the mean over that part.

A pixel's footprint is an ellipse. One to eight trilinear probes are placed along its longer axis, at the mip level that suits
its shorter axis (Schilling, Knittel and Strasser, Texram, 1996). Work is done in chunks of samples: first all places in memory,
which are prefetched if the texture is large, then the sums.
"""

from __future__ import annotations

import math

import numba as nb
from llvmlite import ir
from numba.core import cgutils
from numba.extending import intrinsic

from viewsphere.kernels.jit import inner
from viewsphere.kernels.lanes import (
    FAST,
    REAL,
    Lanes,
    clamp,
    lanewise,
    least,
    load,
    most,
    root,
    scatter,
    size,
    spread,
    store,
    where,
)
from viewsphere.kernels.prefetching import prefetch

f4 = nb.float32
i4 = nb.int32
u4 = nb.uint32
U = nb.uintp

REPEAT, CLAMP, MIRROR = 0, 1, 2  # the content beyond a picture's edge

CHUNK = 32
PROBES = 8  # maximum number of probes along a footprint's longer axis
SPACING = 0.8  # probes per width of the footprint: a trilinear probe is wider than its level's texel
SNAP = 0.2  # fraction of a mip level: closer to one level than this, the next level is not read
QUADS = CHUNK * PROBES * 2 + 8  # and room for values written beyond the last quad
PLANES = 3  # planes that are summed at once
NEAR = 1 << 18  # words of a mip level that still fits into the processor's caches

# Rows of a chunk: how u and v change from pixel to pixel, across and down; the coordinates; the mip level, the number of probes
# and the step between them; the sharper of two levels, each probe's share of either level; the texels' sums, plane by plane.
UX, UY, VX, VY, U_AT, V_AT, LEVEL, COUNT, STEP_U, STEP_V, LOW, SHARE, NEXT_SHARE, TEXEL = range(0, 14 * CHUNK, CHUNK)
ROWS = 13 + 4 * PLANES
# Rows of quads, four texels each: coordinates, then the second neighbour's weight; share of the sum; texels' weights.
Q_U, Q_V, Q_SHARE, W0, W1, W2, W3 = range(0, 7 * QUADS, QUADS)
QUAD_ROWS = 7
# Rows of integers: level's size and first word; neighbours along u and v; texels' first words; each sample's first quad.
Q_WIDTH, Q_HEIGHT, Q_START, X0, X1, Y0, Y1, P0, P1, P2, P3, FIRST = range(0, 12 * QUADS, QUADS)
PLACE_ROWS = 12


def _sums(*parts):
    """A function that sums neighbouring channels as vectors of these widths: the compiler would not vectorise the sums."""

    @intrinsic
    def add_up(typing, texels, channel, q, places, begin, end, c, i):
        """Weighted sums, over the quads from `begin` to `end`, of the channels from `channel` on, to the rows from TEXEL on."""
        return nb.void(texels, nb.uintp, q, places, nb.uintp, nb.uintp, c, nb.uintp), code

    def code(context, builder, signature, arguments):
        words, weights, at, sums = (
            context.make_array(signature.args[k])(context, builder, arguments[k]).data for k in (0, 2, 3, 6)
        )
        channel, begin, end, i = (arguments[k] for k in (1, 4, 5, 7))
        starts = [sum(parts[:k]) for k in range(len(parts))]
        totals = [cgutils.alloca_once_value(builder, ir.Constant(ir.VectorType(REAL, n), None)) for n in parts]
        with cgutils.for_range_slice(builder, begin, end, end.type(1)) as (k, _):
            for corner in range(4):
                place = builder.load(builder.gep(at, [builder.add(k, k.type(P0 + corner * QUADS))]))
                weight = builder.load(builder.gep(weights, [builder.add(k, k.type(W0 + corner * QUADS))]))
                first = builder.add(builder.zext(place, channel.type), channel)
                for n, start, total in zip(parts, starts, totals, strict=True):
                    value = load(builder, words, builder.add(first, first.type(start)), n).widened().real()
                    found = Lanes(builder, builder.load(total)) + value * spread(builder, weight, n)
                    builder.store(found.value, total)
        for n, start, total in zip(parts, starts, totals, strict=True):
            scatter(sums, i, {k: TEXEL + (start + k) * CHUNK for k in range(n)}, Lanes(builder, builder.load(total)))
        return context.get_dummy_value()

    return add_up


_add_plane, _add_planes = _sums(4), _sums(8, 4)


@lanewise
def footprints(width, height, c):
    """Rows LEVEL, COUNT, STEP_U and STEP_V of a chunk from its gradients, for a texture whose level 0 has this size."""
    ux, uy, vx, vy = c.get(UX, UY, VX, VY)
    ax, ay, bx, by = ux * width, uy * width, vx * height, vy * height
    across, down, mixed = ax * ax + bx * bx, ay * ay + by * by, ax * ay + bx * by
    half = (across - down) * 0.5
    way = root(half * half + mixed * mixed)
    # NaN counts as a small footprint.
    major = most((across + down) * 0.5 + way, 1)
    area = ax * by - ay * bx
    minor = most(area * area / major, 1)
    probes = least(root(major / minor) * SPACING + 0.999, PROBES).whole().real()
    squared = most(minor, major * (SPACING / PROBES) ** 2)
    # log2 of the square, within 0.0001: exponent and a polynomial of the mantissa.
    bits = squared.bits()
    m = (bits & 0x7FFFFF).real() * (1 / 8388608)
    fraction = m * (1.44187 + m * (-0.70905 + m * (0.41596 + m * (-0.19453 + m * 0.04575))))
    c[LEVEL] = 0.5 * (((bits >> 23) - 127).real() + fraction)
    c[COUNT] = probes
    # The ellipse's longer axis is the image of this direction on the screen.
    ex, ey = where(half >= 0, way + half, mixed), where(half >= 0, mixed, way - half)
    scale = 1 / (root(ex * ex + ey * ey + 1e-30) * probes)
    du, dv = (ux * ex + uy * ey) * scale, (vx * ex + vy * ey) * scale
    c[STEP_U], c[STEP_V] = where(size(du) < 1e6, du, 0), where(size(dv) < 1e6, dv, 0)


@lanewise
def _choose_levels(last, c):
    """Rows LOW, SHARE and NEXT_SHARE, and the coordinates of each sample's first probe. Only one mip level is read if the other
    one would hardly count.
    """
    level, probes = least(c[LEVEL], last), c[COUNT]
    low = level.whole().real()
    fraction = clamp((level - low - SNAP) * (1 / (1 - 2 * SNAP)))
    is_next = where(fraction >= 1, 1, 0)
    fraction = fraction - is_next
    c[LOW] = low + is_next
    c[SHARE], c[NEXT_SHARE] = (1 - fraction) / probes, fraction / probes
    middle = 0.5 * (probes - 1)
    c[U_AT], c[V_AT] = c[U_AT] - c[STEP_U] * middle, c[V_AT] - c[STEP_V] * middle


@intrinsic
def _pair(typing, array, at, first, second):
    """Store two numbers side by side."""

    def code(context, builder, signature, arguments):
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        pair = ir.Constant(ir.VectorType(data.type.pointee, 2), ir.Undefined)
        for k in range(2):
            pair = builder.insert_element(pair, arguments[2 + k], ir.IntType(32)(k))
        store(data, arguments[1], Lanes(builder, pair))
        return context.get_dummy_value()

    return nb.void(array, nb.uintp, array.dtype, array.dtype), code


@inner(fastmath=FAST)
def _lay_out(count, levels, c, q, places):
    """Lay out every probe's quads: coordinates, share, level; the quads of sample i begin at FIRST + i. Return the number of
    quads.

    Quads of both mip levels are always written; if one level is enough, the next probe's quad overwrites the second one.
    """
    n = U(0)
    for i in range(U(count)):
        places[U(FIRST) + i] = n
        u, v, du, dv = c[U(U_AT) + i], c[U(V_AT) + i], c[U(STEP_U) + i], c[U(STEP_V) + i]
        share, next_share = c[U(SHARE) + i], c[U(NEXT_SHARE) + i]
        low = U(u4(c[U(LOW) + i]))
        start, width, height = levels[low, U(0)], levels[low, U(1)], levels[low, U(2)]
        low += U(1)
        next_start, next_width, next_height = levels[low, U(0)], levels[low, U(1)], levels[low, U(2)]
        step = U(2) if next_share > f4(0) else U(1)
        for _ in range(i4(c[U(COUNT) + i])):
            _pair(q, U(Q_U) + n, u, u)
            _pair(q, U(Q_V) + n, v, v)
            _pair(q, U(Q_SHARE) + n, share, next_share)
            _pair(places, U(Q_START) + n, start, next_start)
            _pair(places, U(Q_WIDTH) + n, width, next_width)
            _pair(places, U(Q_HEIGHT) + n, height, next_height)
            n += step
            u += du
            v += dv
    places[U(FIRST) + U(count)] = n
    return n


@inner(fastmath=FAST)
def place(texels, levels, mode, count, c, q, places):
    """Lay out the quads of a chunk's probes and prefetch them; the quads of sample i begin at FIRST + i.

    levels (16, 3) and mode (14,): a bundle's rows of `Textures`.
    """
    _choose_levels(count, f4(mode[0] - 1), c)
    quads = _lay_out(count, levels, c, q, places)
    _neighbours(quads, mode[1], mode[3], U(Q_U), U(Q_WIDTH), U(X0), q, places)
    _neighbours(quads, mode[2], mode[3], U(Q_V), U(Q_HEIGHT), U(Y0), q, places)
    channels = i4(4) * mode[5]
    _corners(quads, channels, q, places)
    level = U(u4(c[LOW]))  # neighbouring samples read about the same level
    if levels[level, 1] * levels[level, 2] * channels > NEAR:
        for k in range(quads):
            prefetch(texels, U(u4(places[U(P0) + k])))
            prefetch(texels, U(u4(places[U(P2) + k])))


@lanewise
def _neighbours(wrap, is_nearest, coordinate, length, first, q, places):
    """The two texels beside each coordinate, wrapped by the mode `wrap`; the second texel's weight replaces the coordinate."""
    repeats, mirrors, clamps = wrap.equals(REPEAT), wrap.equals(MIRROR), wrap.equals(CLAMP)
    x = q[coordinate]
    # Mirrored, a texture repeats after twice its length.
    x = where(mirrors, x * 0.5 + 0.5, x)
    whole = x.whole().real()
    x = x - where(clamps, 0, where(whole > x, whole - 1, whole))
    # NaN, and coordinates too large for an integer, end somewhere in the texture.
    x = clamp(x)
    x = where(mirrors, size(x + x - 1), x)
    width = places[length]
    last = width - 1
    x = x * width.real() + 0.5
    second = x.whole()
    part = x - second.real()
    q[coordinate] = where(is_nearest.equals(1), where(part >= 0.5, 1, 0), part)
    places[first] = where(second > 0, second - 1, where(repeats, last, 0))
    places[first, QUADS] = where(second < width, second, where(repeats, 0, last))


@lanewise
def _corners(channels, q, places):
    """First words of the texels of quads, and their weights."""
    start, line = places[Q_START], places[Q_WIDTH] * channels
    top, bottom = start + places[Y0] * line, start + places[Y1] * line
    left, right = places[X0] * channels, places[X1] * channels
    places.put((P0, P1, P2, P3), (top + left, top + right, bottom + left, bottom + right))
    across, share = q[Q_U], q[Q_SHARE]
    lower = share * q[Q_V]
    upper = share - lower
    q.put((W0, W1, W2, W3), (upper - upper * across, upper * across, lower - lower * across, lower * across))


@inner
def mix(texels, count, first_plane, planes, q, places, c):
    """Weighted sums of the channels of up to PLANES planes of a chunk's samples, into rows TEXEL and on."""
    channel = U(4 * first_plane)
    for i in range(U(count)):
        begin, end = U(u4(places[U(FIRST) + i])), U(u4(places[U(FIRST + 1) + i]))
        if planes == 1:
            _add_plane(texels, channel, q, places, begin, end, c, i)
        else:
            _add_planes(texels, channel, q, places, begin, end, c, i)


@inner(fastmath=FAST)
def opacity(surfaces, textures, m, u0, v0, u1, v1):
    """Alpha of a material's base colour texture at coordinates in both uv sets: the alpha of the nearest texel, as for
    labels.
    """
    for n in range(U(surfaces.bundles.shape[1])):
        if surfaces.bundles[m, n] < 0:
            break
        bundle = U(surfaces.bundles[m, n])
        mode, f = textures.modes[bundle], textures.transforms[bundle]
        if mode[6] != 0:
            continue
        s, r = (u1, v1) if mode[4] == 1 else (u0, v0)
        width, height = textures.levels[bundle, U(0), U(1)], textures.levels[bundle, U(0), U(2)]
        x = _nearest(f[0] * s + f[1] * r + f[2], width, mode[1])
        y = _nearest(f[3] * s + f[4] * r + f[5], height, mode[2])
        at = textures.levels[bundle, U(0), U(0)] + (y * width + x) * i4(4) * mode[5]
        return f4(textures.texels[U(u4(at)) + U(3)]) * f4(1 / 65535.0)
    return f4(1)


@inner(fastmath=FAST)
def _nearest(x, size, wrap):
    """The texel that contains a coordinate."""
    if wrap == REPEAT:
        x = x - f4(math.floor(x))
    elif wrap != CLAMP:
        x = f4(1) - abs(x - f4(2) * f4(math.floor(x * f4(0.5))) - f4(1))
    return min(max(i4(x * f4(size)), i4(0)), i4(size) - i4(1))
