"""Steps of a multigrid solver of count * v - sum of neighbours = right, on planes (C, H, W) of any region.

Planes have a rim of one pixel outside the region; `inverse` (H, W) is 1 / (number of neighbours that count) at free pixels,
else 0. Pixels that do not count hold 0.
"""

from __future__ import annotations

import numba as nb
import numpy as np

from viewsphere.kernels.jit import njit
from viewsphere.rendering.kernels_view import FAST

f4 = nb.float32


@njit(fastmath=FAST, _nrt=True)
def relax(values, right, inverse, sweeps):
    """Red-black Gauss-Seidel sweeps."""
    width = values.shape[2]
    fresh = np.empty(width, np.float32)
    for sweep in range(2 * sweeps):
        for c in range(values.shape[0]):
            for y in range(1, values.shape[1] - 1):
                above, line, below = values[c, y - 1], values[c, y], values[c, y + 1]
                for x in range(1, width - 1):
                    fresh[x] = (above[x] + below[x] + line[x - 1] + line[x + 1] + right[c, y, x]) * inverse[y, x]
                for x in range(1 + ((y + sweep) & 1), width - 1, 2):
                    if inverse[y, x] > f4(0):
                        line[x] = fresh[x]


@njit(fastmath=FAST)
def restrict(values, right, inverse, out):
    """The residual of the equations, summed over each coarse cell's four pixels."""
    for c in range(values.shape[0]):
        for y in range(1, values.shape[1] - 1):
            v = ((y - 1) >> 1) + 1
            for x in range(1, values.shape[2] - 1):
                if inverse[y, x] > f4(0):
                    around = values[c, y - 1, x] + values[c, y + 1, x] + values[c, y, x - 1] + values[c, y, x + 1]
                    out[c, v, ((x - 1) >> 1) + 1] += right[c, y, x] + around - values[c, y, x] / inverse[y, x]


@njit(fastmath=FAST)
def correct(coarse, inverse, values):
    """Add the coarse correction to the free pixels, interpolated between the centres of its cells."""
    height, width = coarse.shape[1] - 2, coarse.shape[2] - 2
    for y in range(1, values.shape[1] - 1):
        v = ((y - 1) >> 1) + 1
        v2 = min(max(v - 1 + 2 * ((y - 1) & 1), 1), height)
        for x in range(1, values.shape[2] - 1):
            if inverse[y, x] > f4(0):
                u = ((x - 1) >> 1) + 1
                u2 = min(max(u - 1 + 2 * ((x - 1) & 1), 1), width)
                for c in range(values.shape[0]):
                    near, far = f4(0.75) * coarse[c, v, u] + f4(0.25) * coarse[c, v, u2], f4(0.75) * coarse[c, v2, u]
                    values[c, y, x] += f4(0.75) * near + f4(0.25) * (far + f4(0.25) * coarse[c, v2, u2])
