"""Pixels spread over discs of their own size, in depth order.

Planes and scratch are one flat array each, and lines always have `LINE` pixels, so that the compiler can process eight pixels
at once.
"""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from viewsphere.kernels.jit import inner, njit
from viewsphere.rendering.kernels_view import FAST

f4 = nb.float32
U = nb.uintp
LINE = 64  # pixels in a line; loops over fewer would be unrolled instead of vectorised
LINES = 16
RADIUS, NEAR = 1, 2
BEHIND, FRONT = 0, 1
MADE_UP = f4(0.05)  # weight of colours filled in behind near objects: it matters where little else spreads


@inner(fastmath=FAST)
def _reaches(radius, near, margin, slack, y0, x0, rows):
    """The largest disc that reaches some lines of pixels, and the largest in front of the focus; -1 if none does."""
    largest, nearest = f4(-1), f4(-1)
    for y in range(y0, y0 + rows + 2 * margin):
        down = max(y0 + margin - y, y - (y0 + rows - 1 + margin))
        for x in range(x0, x0 + LINE + 2 * margin):
            across = max(x0 + margin - x, x - (x0 + LINE - 1 + margin))
            if radius[y, x] + slack > f4(max(across, down)):
                largest = max(largest, radius[y, x])
                if near[y, x] > f4(0):
                    nearest = max(nearest, radius[y, x])
    return largest, nearest


@inner(fastmath=FAST)
def _gather(p, plane, width, at, channels, reach, stride, layer, b):
    """Sums of weighted colours, and then of weights, over all discs that reach the line of pixels that begins at `at`.

    Scratch b: a line of weights, then `channels + 1` lines of sums for each layer.
    """
    first = U(LINE) * U(1 + layer * (channels + 1))
    for i in range(LINE * (channels + 1)):
        b[first + U(i)] = f4(0)
    front = f4(1) if layer == FRONT else f4(0)
    made_up = MADE_UP * (f4(1) - front)
    signed, radius, near = U(at), U(at + plane), U(at + 2 * plane)
    scale = f4(1) / f4(stride)
    outermost = (f4(reach) + f4(0.5)) ** 2
    rows = reach // stride * stride
    for dy in range(-rows, rows + 1, stride):
        half = nb.int64(math.sqrt(outermost - f4(dy * dy))) // stride * stride
        for dx in range(-half, half + 1, stride):
            inside = f4(0.5) - f4(math.sqrt(f4(dx * dx + dy * dy))) * scale
            q = at + dy * width + dx
            s, r, n, a, color = U(q), U(q + plane), U(q + 2 * plane), U(q + 3 * plane), U(q + 4 * plane)
            for k in range(LINE):
                i = U(k)
                most = p[radius + i] + p[near + i] * f4(1e3) + front * f4(1e3)
                covered = p[r + i] if p[s + i] >= p[signed + i] else min(p[r + i], most)
                share = min(max(covered * scale + inside, f4(0)), f4(1))
                share += p[near + i] * min(max(p[radius + i] * scale + inside, f4(0)), f4(1)) * made_up
                b[i] = share * p[a + i] * (f4(1) - front + (front + front - f4(1)) * p[n + i])
            for c in range(channels + 1):
                line, total = color + U(c * plane), first + U(c * LINE)
                for k in range(LINE):
                    b[total + U(k)] += b[U(k)] * p[line + U(k)]


@inner(fastmath=FAST)
def _mix(b, channels, has_near, y, x0, out):
    """Lay the layer in front of the focus over the other layer; where the other layer is empty, only the front layer counts."""
    back, front = LINE, LINE * (channels + 2)
    for i in range(min(LINE, out.shape[1] - x0)):
        rest, over = b[back + LINE * channels + i], f4(0)
        if has_near:
            over = b[front + LINE * channels + i]
        cover = min(over, f4(1)) if rest > f4(1e-9) else f4(1)
        for c in range(channels):
            color = b[back + LINE * c + i] / max(rest, f4(1e-9)) * (f4(1) - cover)
            if over > f4(0):
                color += b[front + LINE * c + i] / over * cover
            out[y, x0 + i, c] = color


@njit(fastmath=FAST, _nrt=True)
def spread_discs(planes, margin, stride, out):
    """out (H, W, C) from planes (4 + C + 1, h, w) with a margin and, on the right, `LINE` pixels more.

    Planes: signed radius, radius, whether in front of the focus, 1 / the sum of a disc's weights, the colours, ones. In each
    disc, every `stride`-th pixel across and down counts.
    """
    height, width, channels = out.shape
    flat, plane, wide = planes.reshape(-1), planes.shape[1] * planes.shape[2], planes.shape[2]
    b = np.zeros(LINE * (1 + 2 * (channels + 1)), np.float32)
    for y0 in range(0, height, LINES):
        rows = min(LINES, height - y0)
        for x0 in range(0, width, LINE):
            largest, nearest = _reaches(planes[RADIUS], planes[NEAR], margin, f4(stride), y0, x0, rows)
            for y in range(y0, y0 + rows):
                at = (y + margin) * wide + x0 + margin
                for layer in range(2):
                    size = largest if layer == BEHIND else nearest
                    if size >= f4(0):
                        reach = nb.int64(math.ceil(size + f4(0.5) * f4(stride) - f4(0.5)))
                        _gather(flat, plane, wide, at, channels, reach, stride, layer, b)
                _mix(b, channels, nearest >= f4(0), y, x0, out)
