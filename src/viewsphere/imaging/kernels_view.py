"""View transforms, composite and the sRGB curve, a block of pixels at a time."""

from __future__ import annotations

import numba as nb
import numpy as np

from viewsphere.geometry.jit import njit

f4 = nb.float32
U = nb.uintp
FAST = {"contract", "arcp", "nsz", "afn", "reassoc"}
BLOCK = 256
STANDARD, FILMIC, AGX = 0, 1, 2

KNEE = f4(0.6)
GREY_IN = f4(0.723223)  # Narkowicz' curve takes 0.18 times this to 0.18
INSET, OUTSET = f4(0.8), f4(1.25)
SHARE_R, SHARE_G, SHARE_B = f4(0.04235), f4(0.07845), f4(0.0792)  # of red, green and blue in what AgX adds to all three


@njit(fastmath=FAST)
def expose(radiance, first, count, matrix, p):
    """Unpremultiplied, balanced, exposed light in rows 0 to 2 of the block and alpha in row 3; the largest alpha.

    Where light exceeds what its coverage can show, as a glint on clear glass, it covers more: it outshines what is behind.
    """
    most = f4(0)
    for i in range(count):
        r, g, b, a = radiance[first + i, 0], radiance[first + i, 1], radiance[first + i, 2], radiance[first + i, 3]
        x = max(f4(0), matrix[0, 0] * r + matrix[0, 1] * g + matrix[0, 2] * b)
        y = max(f4(0), matrix[1, 0] * r + matrix[1, 1] * g + matrix[1, 2] * b)
        z = max(f4(0), matrix[2, 0] * r + matrix[2, 1] * g + matrix[2, 2] * b)
        a = min(f4(1), max(a, x, y, z))
        most = max(most, a)
        s = f4(1) / max(a, f4(1e-6))
        p[0, i], p[1, i], p[2, i], p[3, i] = x * s, y * s, z * s, a
    return most


@njit(fastmath=FAST)
def _standard(count, p):
    for c in range(3):
        for i in range(count):
            over = max(p[c, i] - KNEE, f4(0)) / (f4(1) - KNEE)
            p[c, i] = min(p[c, i], KNEE) + (f4(1) - KNEE) * over / (f4(1) + over)


@njit(fastmath=FAST)
def _narkowicz(x):
    t = min(x, f4(100)) * GREY_IN
    return min(t * (f4(2.51) * t + f4(0.03)) / (t * (f4(2.43) * t + f4(0.59)) + f4(0.14)), f4(1))


@njit(fastmath=FAST)
def _filmic(count, p):
    for i in range(count):
        r, g, b = p[0, i], p[1, i], p[2, i]
        high, low = max(r, g, b), min(r, g, b)
        top, bottom = _narkowicz(high), _narkowicz(low)
        scale = (top - bottom) / max(high - low, f4(1e-12))
        p[0, i] = bottom + (r - low) * scale
        p[1, i] = bottom + (g - low) * scale
        p[2, i] = bottom + (b - low) * scale


@njit(fastmath=FAST)
def _agx(count, p, sigmoid, decoded):
    """`sigmoid` has 256 values for each power of two from 2^-13: a float's own bits say between which two it lies."""
    bits = p.view(np.int32)
    first = nb.int32((127 - 13) << 8)
    for i in range(count):
        shared = SHARE_R * p[0, i] + SHARE_G * p[1, i] + SHARE_B * p[2, i]
        for c in range(3):
            p[c, i] = min(max(INSET * p[c, i] + shared, f4(0.0001221)), f4(31.99))
    for c in range(3):
        for i in range(count):
            at = U((bits[c, i] >> 15) - first)
            rest = f4(bits[c, i] & nb.int32(0x7FFF)) * f4(1 / 32768)
            p[c, i] = sigmoid[at] + (sigmoid[at + U(1)] - sigmoid[at]) * rest
    top = f4(decoded.shape[0] - 2)
    for i in range(count):
        shared = SHARE_R * p[0, i] + SHARE_G * p[1, i] + SHARE_B * p[2, i]
        for c in range(3):
            x = min(max(OUTSET * (p[c, i] - shared), f4(0)), f4(1)) * top
            at = U(nb.int32(x))
            p[c, i] = decoded[at] + (decoded[at + U(1)] - decoded[at]) * (x - f4(nb.int32(x)))


@njit(fastmath=FAST)
def shown(radiance, first, count, matrix, transform, sigmoid, decoded, p):
    """Display-linear foreground in rows 0 to 2, alpha in row 3; the largest alpha, at 0 the rows 0 to 2 are not filled."""
    most = expose(radiance, first, count, matrix, p)
    if most == f4(0):
        return most
    if transform == STANDARD:
        _standard(count, p)
    elif transform == FILMIC:
        _filmic(count, p)
    elif transform == AGX:
        _agx(count, p, sigmoid, decoded)
    else:
        for c in range(3):
            for i in range(count):
                p[c, i] = min(p[c, i], f4(1))
    return most


@njit(fastmath=FAST)
def _byte(x, curve):
    return curve[U(nb.int32(x * f4(65535) + f4(0.5)))]


@njit(fastmath=FAST)
def develop(radiance, background, matrix, transform, sigmoid, decoded, curve, out):
    """Radiance (N, 4) over the background (N or 1, 3) to bytes (N, 3), or without background to straight alpha (N, 4)."""
    n = radiance.shape[0]
    p = np.zeros((4, BLOCK), np.float32)
    step = 0 if background.shape[0] == 1 else 1
    for first in range(0, n, BLOCK):
        count = min(BLOCK, n - first)
        most = shown(radiance, first, count, matrix, transform, sigmoid, decoded, p)
        if out.shape[1] == 4:
            for i in range(count):
                for c in range(3):
                    out[first + i, c] = _byte(p[c, i], curve) if p[3, i] > f4(0) else 0
                out[first + i, 3] = nb.uint8(nb.int32(p[3, i] * f4(255) + f4(0.5)))
        elif most == f4(0):
            for i in range(first, first + count):
                for c in range(3):
                    out[i, c] = _byte(background[i * step, c], curve)
        else:
            for i in range(count):
                for c in range(3):
                    under = background[(first + i) * step, c]
                    out[first + i, c] = _byte(under + (p[c, i] - under) * p[3, i], curve)


@njit(fastmath=FAST)
def display(radiance, background, matrix, transform, sigmoid, decoded, out):
    """As `develop`, display-linear float32; (N, 4) is premultiplied."""
    n = radiance.shape[0]
    p = np.zeros((4, BLOCK), np.float32)
    step = 0 if background.shape[0] == 1 else 1
    for first in range(0, n, BLOCK):
        count = min(BLOCK, n - first)
        shown(radiance, first, count, matrix, transform, sigmoid, decoded, p)
        for i in range(count):
            a = p[3, i]
            for c in range(3):
                under = background[(first + i) * step, c] if out.shape[1] == 3 else f4(0)
                out[first + i, c] = under + (p[c, i] - under) * a
            if out.shape[1] == 4:
                out[first + i, 3] = a


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
