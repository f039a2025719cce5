"""Weighted sums of shifted pictures, for blurs that are uniform across the picture."""

from __future__ import annotations

import numba as nb

from viewsphere.kernels.jit import njit
from viewsphere.rendering.kernels_view import FAST

U = nb.uintp


@njit(fastmath=FAST)
def spread(padded, channels, rows, columns, weights, out):
    """out[y, x] = sum over taps t of weights[t] * padded[y + rows[t], x + columns[t]]; all (height, width * channels)."""
    width = out.shape[1]
    for y in range(out.shape[0]):
        line = out[y]
        line[:] = nb.float32(0)
        for t in range(weights.shape[0]):
            weight = weights[t]
            start = columns[t] * channels
            source = padded[y + rows[t], start : start + width]
            for i in range(width):
                line[i] += weight * source[i]
