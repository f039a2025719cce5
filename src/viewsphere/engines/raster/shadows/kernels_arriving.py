"""A light at many places of level ground, a block at a time."""

from __future__ import annotations

import numba as nb
import numpy as np

from viewsphere.engines.raster.shading.kernels_block import BLOCK, GZ, IB, IG, IR, LZ, NZ, PIXEL, PX, PY, PZ, ROWS, SHARE
from viewsphere.engines.raster.shadows.kernels_direct_light import arrive
from viewsphere.kernels.jit import njit

U = nb.uintp


@njit(_nrt=True)
def arrive_on_ground(lights, k, places, widths, found):
    """Fill found (5, N): z of the direction to light k, its unshadowed irradiance, and the share that shadows leave.

    places (3, N); widths (N,): the distance of each place from the next one.
    """
    b = np.zeros(ROWS * BLOCK, np.float32)
    b[NZ : NZ + BLOCK] = 1
    b[GZ : GZ + BLOCK] = 1
    for start in range(0, places.shape[1], BLOCK):
        count = min(BLOCK, places.shape[1] - start)
        for i in range(count):
            b[PX + i], b[PY + i], b[PZ + i] = places[0, start + i], places[1, start + i], places[2, start + i]
            b[PIXEL + i] = widths[start + i]
        arrive(count, lights, k, b)
        for i in range(count):
            at = U(start + i)
            found[0, at], found[4, at] = b[LZ + i], b[SHARE + i]
            found[1, at], found[2, at], found[3, at] = b[IR + i], b[IG + i], b[IB + i]
