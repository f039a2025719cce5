"""Filtered look-up in bundles of textures: what a pixel covers of them, and the mean of that.

A pixel's footprint is an ellipse. Trilinear probes, one or up to eight, stand along its longer axis and are as sharp as its
shorter axis lets them be (Schilling, Knittel and Strasser, Texram, 1996). Work is done in chunks of samples: first all places
in memory, which are fetched early, then the sums.
"""

from __future__ import annotations

import math

import numba as nb
import numpy as np
from llvmlite import ir
from numba.extending import intrinsic

from viewsphere.engines.raster.kernels_texture import CLAMP, FAST, REPEAT
from viewsphere.geometry.jit import njit

f4 = nb.float32
i4 = nb.int32
u4 = nb.uint32
U = nb.uintp

CHUNK = 32
PROBES = 8  # at most, along a footprint's longer axis
SPACING = 0.8  # probes per width of the footprint: a trilinear probe is wider than its level's texel
SNAP = 0.2  # of a level: as near as that to one, the next is not looked at
QUADS = CHUNK * PROBES * 2

# Rows of a chunk: how u and v change from pixel to pixel, across and down; the coordinates; the mip level, the number of probes
# and the step between them.
UX, UY, VX, VY, U_AT, V_AT, LEVEL, COUNT, STEP_U, STEP_V = range(0, 10 * CHUNK, CHUNK)
ROWS = 10
# Rows of quads, four texels each: coordinates, level, share of the sum; then texels' weights.
Q_U, Q_V, Q_SHARE, Q_ACROSS, Q_DOWN, W0, W1, W2, W3 = range(0, 9 * QUADS, QUADS)
QUAD_ROWS = 9
# Rows of whole numbers: level's first word and size; neighbours along u and v; then texels' first words.
Q_LEVEL, Q_START, Q_WIDTH, Q_HEIGHT, X0, X1, Y0, Y1, P0, P1, P2, P3 = range(0, 12 * QUADS, QUADS)
PLACE_ROWS = 12


@intrinsic
def _bits(typing, x):
    """The bits of a float32 as int32."""

    def code(context, builder, signature, arguments):
        return builder.bitcast(arguments[0], ir.IntType(32))

    return nb.int32(nb.float32), code


@intrinsic
def _fetch(typing, array, index):
    """Ask for a word of an array to be brought near."""

    def code(context, builder, signature, arguments):
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        word = builder.bitcast(builder.gep(data, [arguments[1]]), ir.IntType(8).as_pointer())
        flag = ir.IntType(32)
        function = builder.module.declare_intrinsic(
            "llvm.prefetch.p0", fnty=ir.FunctionType(ir.VoidType(), [word.type, flag, flag, flag])
        )
        builder.call(function, [word, flag(0), flag(3), flag(1)])
        return context.get_dummy_value()

    return nb.void(array, nb.uintp), code


@njit(fastmath=FAST)
def footprints(count, width, height, c):
    """Rows LEVEL, COUNT, STEP_U and STEP_V of a chunk from its gradients, for a level 0 of this size."""
    zero, one, widest = f4(0), f4(1), f4((PROBES / SPACING) ** 2)
    for i in range(count):
        ux, uy, vx, vy = c[UX + i], c[UY + i], c[VX + i], c[VY + i]
        ax, ay, bx, by = ux * width, uy * width, vx * height, vy * height
        across, down, mixed = ax * ax + bx * bx, ay * ay + by * by, ax * ay + bx * by
        half = (across - down) * f4(0.5)
        root = np.sqrt(half * half + mixed * mixed)
        # What is no number counts as small.
        major = (across + down) * f4(0.5) + root
        major = major if major > one else one
        area = ax * by - ay * bx
        minor = area * area / major
        minor = minor if minor > one else one
        ratio = np.sqrt(major / minor)
        probes = f4(i4(min(ratio * f4(SPACING) + f4(0.999), f4(PROBES))))
        squared = max(minor, major / widest)
        # log2 of the square, within 0.0001: exponent and a polynomial of the mantissa.
        bits = _bits(squared)
        m = f4(bits & i4(0x7FFFFF)) * f4(1 / 8388608.0)
        log = f4((bits >> i4(23)) - i4(127)) + m * (
            f4(1.44187) + m * (f4(-0.70905) + m * (f4(0.41596) + m * (f4(-0.19453) + m * f4(0.04575))))
        )
        c[LEVEL + i] = f4(0.5) * log
        c[COUNT + i] = probes
        # The ellipse's longer axis is the image of this direction on the screen.
        ex = root + half if half >= zero else mixed
        ey = mixed if half >= zero else root - half
        scale = one / (np.sqrt(ex * ex + ey * ey + f4(1e-30)) * probes)
        du, dv = (ux * ex + uy * ey) * scale, (vx * ex + vy * ey) * scale
        c[STEP_U + i], c[STEP_V + i] = du if abs(du) < f4(1e6) else zero, dv if abs(dv) < f4(1e6) else zero


@njit(fastmath=FAST)
def place(textures, bundle, count, c, q, places, first):
    """Lay out the quads of a chunk's probes and fetch them; those of sample i are first[i] to first[i + 1]."""
    last = f4(textures.modes[bundle, U(0)] - 1)
    n = U(0)
    for i in range(count):
        first[i] = n
        level, probes = min(c[LEVEL + i], last), c[COUNT + i]
        low = max(i4(level), i4(0))
        # One level will do where the other would hardly count.
        fraction = min(max((level - f4(low) - f4(SNAP)) * f4(1 / (1 - 2 * SNAP)), f4(0)), f4(1))
        low, fraction = (low + i4(1), f4(0)) if fraction == f4(1) else (low, fraction)
        share = f4(1) / probes
        du, dv = c[STEP_U + i], c[STEP_V + i]
        middle = f4(0.5) * (probes - f4(1))
        u, v = c[U_AT + i] - du * middle, c[V_AT + i] - dv * middle
        for _ in range(i4(probes)):
            q[U(Q_U) + n], q[U(Q_V) + n] = u, v
            q[U(Q_SHARE) + n] = share * (f4(1) - fraction)
            places[U(Q_LEVEL) + n] = low
            n += U(1)
            if fraction > f4(0):
                q[U(Q_U) + n], q[U(Q_V) + n] = u, v
                q[U(Q_SHARE) + n] = share * fraction
                places[U(Q_LEVEL) + n] = low + i4(1)
                n += U(1)
            u += du
            v += dv
    first[count] = n
    quads = i4(n)
    levels = textures.levels
    for k in range(quads):
        level = U(places[Q_LEVEL + k])
        places[Q_START + k] = levels[bundle, level, U(0)]
        places[Q_WIDTH + k] = levels[bundle, level, U(1)]
        places[Q_HEIGHT + k] = levels[bundle, level, U(2)]
    is_nearest = textures.modes[bundle, U(3)] != 0
    _neighbours(quads, textures.modes[bundle, U(1)], is_nearest, Q_U, Q_ACROSS, Q_WIDTH, X0, q, places)
    _neighbours(quads, textures.modes[bundle, U(2)], is_nearest, Q_V, Q_DOWN, Q_HEIGHT, Y0, q, places)
    channels = i4(4) * textures.modes[bundle, U(5)]
    for k in range(quads):
        width = places[Q_WIDTH + k]
        top = places[Q_START + k] + places[Y0 + k] * width * channels
        bottom = places[Q_START + k] + places[Y1 + k] * width * channels
        left, right = places[X0 + k] * channels, places[X1 + k] * channels
        places[P0 + k], places[P1 + k] = top + left, top + right
        places[P2 + k], places[P3 + k] = bottom + left, bottom + right
        across, share = q[Q_ACROSS + k], q[Q_SHARE + k]
        lower = share * q[Q_DOWN + k]
        upper = share - lower
        q[W0 + k], q[W1 + k] = upper - upper * across, upper * across
        q[W2 + k], q[W3 + k] = lower - lower * across, lower * across
    for k in range(quads):
        _fetch(textures.texels, U(u4(places[P0 + k])))
        _fetch(textures.texels, U(u4(places[P2 + k])))


@njit(fastmath=FAST)
def _neighbours(quads, wrap, is_nearest, coordinate, weight, size, first, q, places):
    """The two texels beside each coordinate and the second one's weight; -1 and `size` wrap as `wrap` says."""
    zero, one = f4(0), f4(1)
    for k in range(quads):
        x = q[coordinate + k]
        if wrap == CLAMP:
            x = min(max(x, zero), one)
        else:
            x = x if wrap == REPEAT else x * f4(0.5) + f4(0.5)
            whole = f4(i4(x))
            whole = whole - one if whole > x else whole
            x = x - whole
            x = x if wrap == REPEAT else abs(x + x - one)
        width = places[size + k]
        x = x * f4(width) + f4(0.5)
        second = i4(x)
        # What is too large for a whole number ends somewhere in the texture.
        part = x - f4(second)
        part = part if abs(part) < one else zero
        q[weight + k] = (one if part >= f4(0.5) else zero) if is_nearest else part
        before = second - i4(1)
        if wrap == REPEAT:
            before = width - i4(1) if before < i4(0) else before
            second = second if second < width else i4(0)
        places[first + k] = min(max(before, i4(0)), width - i4(1))
        places[first + QUADS + k] = min(max(second, i4(0)), width - i4(1))


@njit(fastmath={"contract", "nsz"})
def mix(t, count, channel, q, places, first, texel):
    """Weighted sums of four channels of a chunk's samples, into rows of `texel` (4 * CHUNK,).

    Sums are kept in order, as the compiler then works on four channels at once.
    """
    for i in range(count):
        a0, a1, a2, a3 = f4(0), f4(0), f4(0), f4(0)
        for k in range(first[i], first[i + 1]):
            for corner in range(4):
                at, w = U(u4(places[U(P0) + k + U(corner * QUADS)])) + channel, q[U(W0) + k + U(corner * QUADS)]
                a0 += f4(i4(t[at])) * w
                a1 += f4(i4(t[at + U(1)])) * w
                a2 += f4(i4(t[at + U(2)])) * w
                a3 += f4(i4(t[at + U(3)])) * w
        texel[i], texel[CHUNK + i], texel[2 * CHUNK + i], texel[3 * CHUNK + i] = a0, a1, a2, a3


@njit(fastmath=FAST)
def opacity(surfaces, textures, m, u0, v0, u1, v1):
    """Alpha of a material's base colour texture at these coordinates of both sets, of the nearest texel as labels have it."""
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


@njit(fastmath=FAST)
def _nearest(x, size, wrap):
    """The texel that a coordinate lies in."""
    if wrap == REPEAT:
        x = x - f4(math.floor(x))
    elif wrap != CLAMP:
        x = f4(1) - abs(x - f4(2) * f4(math.floor(x * f4(0.5))) - f4(1))
    return min(max(i4(x * f4(size)), i4(0)), i4(size) - i4(1))
