"""View transforms, composite and the sRGB curve, each for a block of pixels, so that only the transform in use is compiled.

A block p is flat, with BLOCK values each of red, green, blue and alpha, so that the compiler sees that its rows do not overlap.
"""

from __future__ import annotations

import numba as nb
import numpy as np

from viewsphere.kernels.jit import inner, njit

f4 = nb.float32
U = nb.uintp
FAST = {"contract", "arcp", "nsz", "afn", "reassoc"}
BLOCK = 8192
GREEN, BLUE, ALPHA = BLOCK, 2 * BLOCK, 3 * BLOCK

KNEE = f4(0.6)  # highlights above this are compressed; below, the picture is linear
GREY_IN = f4(0.723223)  # Narkowicz' curve maps 0.18 times this to 0.18
INSET, OUTSET = f4(0.8), f4(1.25)
SHARE_R, SHARE_G, SHARE_B = f4(0.04235), f4(0.07845), f4(0.0792)  # weights of the grey that AgX mixes in


@njit(fastmath=FAST)
def expose(radiance, matrix, p):
    """Fill p with unpremultiplied, balanced, exposed light and alpha from radiance (4 n,), which is flat so that its pixels are
    adjacent.

    If light is too bright for its coverage, as in a glint on clear glass, its alpha grows: the light outshines the background.
    """
    zero, one, a, b, c = f4(0), f4(1), U(0), U(1), U(2)
    xr, xg, xb = matrix[a, a], matrix[a, b], matrix[a, c]
    yr, yg, yb = matrix[b, a], matrix[b, b], matrix[b, c]
    zr, zg, zb = matrix[c, a], matrix[c, b], matrix[c, c]
    for i in range(U(radiance.shape[0] // 4)):
        j = U(4) * i
        red, green, blue, alpha = radiance[j], radiance[j + U(1)], radiance[j + U(2)], radiance[j + U(3)]
        x, y, z = xr * red + xg * green + xb * blue, yr * red + yg * green + yb * blue, zr * red + zg * green + zb * blue
        x, y, z = x if x > zero else zero, y if y > zero else zero, z if z > zero else zero
        alpha = x if x > alpha else alpha
        alpha = y if y > alpha else alpha
        alpha = z if z > alpha else alpha
        alpha = alpha if alpha < one else one
        s = one / (alpha if alpha > f4(1e-6) else f4(1e-6))
        p[i], p[U(GREEN) + i], p[U(BLUE) + i], p[U(ALPHA) + i] = x * s, y * s, z * s, alpha


@njit(fastmath=FAST)
def standard(p):
    """See `view`."""
    for i in range(U(3 * BLOCK)):
        over = max(p[i] - KNEE, f4(0))
        p[i] = min(p[i], KNEE) + (f4(1) - KNEE) * over / (f4(1) - KNEE + over)


@inner(fastmath=FAST)
def _narkowicz(x):
    t = min(x, f4(100)) * GREY_IN
    return min(t * (f4(2.51) * t + f4(0.03)) / (t * (f4(2.43) * t + f4(0.59)) + f4(0.14)), f4(1))


@njit(fastmath=FAST)
def filmic(p):
    """See `view`."""
    for i in range(U(BLOCK)):
        r, g, b = p[i], p[U(GREEN) + i], p[U(BLUE) + i]
        high, low = max(r, g, b), min(r, g, b)
        top, bottom = _narkowicz(high), _narkowicz(low)
        scale = (top - bottom) / max(high - low, f4(1e-12))
        p[i], p[U(GREEN) + i] = bottom + (r - low) * scale, bottom + (g - low) * scale
        p[U(BLUE) + i] = bottom + (b - low) * scale


@njit(fastmath=FAST)
def agx(p, sigmoid, decoded):
    """See `view`. `sigmoid` has 256 values for each power of two from 2^-13; a float's bits index the two nearest values."""
    bits = p.view(np.int32)
    first = nb.int32((127 - 13) << 8)
    for i in range(U(BLOCK)):
        shared = SHARE_R * p[i] + SHARE_G * p[U(GREEN) + i] + SHARE_B * p[U(BLUE) + i]
        for c in range(U(3)):
            j = c * U(BLOCK) + i
            p[j] = min(max(INSET * p[j] + shared, f4(0.0001221)), f4(31.99))
    for i in range(U(3 * BLOCK)):
        at = U((bits[i] >> 15) - first)
        rest = f4(bits[i] & nb.int32(0x7FFF)) * f4(1 / 32768)
        p[i] = sigmoid[at] + (sigmoid[at + U(1)] - sigmoid[at]) * rest
    top = f4(decoded.shape[0] - 2)
    for i in range(U(BLOCK)):
        shared = SHARE_R * p[i] + SHARE_G * p[U(GREEN) + i] + SHARE_B * p[U(BLUE) + i]
        for c in range(U(3)):
            j = c * U(BLOCK) + i
            x = min(max(OUTSET * (p[j] - shared), f4(0)), f4(1)) * top
            at = U(nb.int32(x))
            p[j] = decoded[at] + (decoded[at + U(1)] - decoded[at]) * (x - f4(nb.int32(x)))


@inner(fastmath=FAST)
def _byte(x, curve):
    return curve[U(nb.int32(x * f4(65535) + f4(0.5)))]


@njit(fastmath=FAST)
def over_bytes(p, background, curve, out):
    """A block over the background (n or 1, 3), as bytes (n, 3). The block's colours become indices into the curve."""
    step = U(0) if background.shape[0] == 1 else U(1)
    at = p.view(np.int32)
    for c in range(U(3)):
        row = c * U(BLOCK)
        for i in range(U(out.shape[0])):
            under = background[i * step, c]
            at[row + i] = nb.int32((under + (p[row + i] - under) * p[U(ALPHA) + i]) * f4(65535) + f4(0.5))
    for i in range(U(out.shape[0])):
        red, green, blue = at[i], at[U(GREEN) + i], at[U(BLUE) + i]
        out[i, U(0)], out[i, U(1)], out[i, U(2)] = curve[U(red)], curve[U(green)], curve[U(blue)]


@njit(fastmath=FAST)
def standard_bytes(radiance, matrix, background, curve, p, out):
    """The bytes (N, 3) of nearly all pictures in one call: `expose`, `standard` and `over_bytes`, block by block."""
    for first in range(0, out.shape[0], BLOCK):
        stop = min(first + BLOCK, out.shape[0])
        low, high = (0, 1) if background.shape[0] == 1 else (first, stop)
        expose(radiance[4 * first : 4 * stop], matrix, p)
        standard(p)
        over_bytes(p, background[low:high], curve, out[first:stop])


@njit(fastmath=FAST)
def straight_bytes(p, curve, out):
    """A block as bytes (n, 4), straight alpha."""
    for i in range(U(out.shape[0])):
        alpha = p[U(ALPHA) + i]
        for c in range(U(3)):
            out[i, c] = _byte(p[c * U(BLOCK) + i], curve) if alpha > f4(0) else 0
        out[i, U(3)] = nb.uint8(nb.int32(alpha * f4(255) + f4(0.5)))


@njit(fastmath=FAST)
def over(p, background, out):
    """A block over the background (n or 1, 3), display-linear, (n, 3); or without a background (n, 4), premultiplied."""
    step = U(0) if background.shape[0] == 1 else U(1)
    for i in range(U(out.shape[0])):
        alpha = p[U(ALPHA) + i]
        for c in range(U(3)):
            under = background[i * step, c] if out.shape[1] == 3 else f4(0)
            out[i, c] = under + (p[c * U(BLOCK) + i] - under) * alpha
        if out.shape[1] == 4:
            out[i, U(3)] = alpha


@njit(fastmath=FAST)
def encode(picture, curve, out):
    """sRGB bytes of display-linear values (N, 3), or of premultiplied (N, 4) as straight alpha."""
    for i in range(picture.shape[0]):
        scale = f4(1)
        if picture.shape[1] == 4:
            a = min(f4(1), max(f4(0), picture[i, 3]))
            scale = f4(1) / a if a > f4(0) else f4(0)
            out[i, 3] = nb.uint8(nb.int32(a * f4(255) + f4(0.5)))
        for c in range(3):
            out[i, c] = _byte(min(f4(1), max(f4(0), picture[i, c] * scale)), curve)
