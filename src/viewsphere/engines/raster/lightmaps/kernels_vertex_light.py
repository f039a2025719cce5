"""Light on curved surfaces, for the samples of a block: see `vertex_light`."""

from __future__ import annotations

import numba as nb

from viewsphere.engines.raster.lightmaps.kernels_lightmap import ALONG, COLUMNS, LEAST
from viewsphere.engines.raster.shading.kernels_blend import blend
from viewsphere.engines.raster.shading.kernels_block import BARY1, BARY2, BLOCK, GLOW_R, GX, GY, GZ, MAPPED, NX, NY, NZ, PROBES
from viewsphere.kernels.jit import inner
from viewsphere.kernels.lanes import FAST

f4 = nb.float32
U = nb.uintp
# Columns of a facet: its normal, the number whose square is its number of parts, and the index of its first point.
PARTS, FIRST, FACET = 3, 4, 5
NONE = -1  # numbers below this in `Lightmap.chart` are facets: the first is one less
_blend = blend(COLUMNS)


@inner(fastmath=FAST)
def read_vertices(count, lightmap, own, b):
    """Set GLOW, and MAPPED to 1, if a sample's triangle (`own`) is a facet whose points have its light."""
    facets, knots, points = lightmap.facets, lightmap.knots, lightmap.points
    for i in range(U(count)):
        at = lightmap.chart[U(own[i])] if own[i] >= 0 else nb.int32(NONE)
        if at >= NONE:
            continue
        f = facets[U(NONE - 1 - at)]
        if b[U(GX) + i] * f[U(0)] + b[U(GY) + i] * f[U(1)] + b[U(GZ) + i] * f[U(2)] <= f4(0):
            continue
        parts, first = int(f[U(PARTS)]), int(f[U(FIRST)])
        g, h = b[U(BARY1) + i] * f4(parts), b[U(BARY2) + i] * f4(parts)
        row = min(max(int(h), 0), parts - 1)
        column = min(max(int(g), 0), parts - 1 - row)
        g, h = g - f4(column), h - f4(row)
        low = first + row * (2 * parts + 3 - row) // 2 + column
        high = low + parts + 1 - row
        p, q, r = low, low + 1, high
        if g + h > f4(1) and column + row < parts - 1:
            p, q, r = high + 1, high, low + 1
            g, h = f4(1) - g, f4(1) - h
        _blend(points, (U(knots[p]), U(knots[q]), U(knots[r])), (f4(1) - g - h, g, h), b, U(PROBES) + i)
        weight = b[U(PROBES) + i]
        if weight < f4(LEAST):
            continue
        b[U(MAPPED) + i] = f4(1)
        per = f4(1) / weight
        x, y, z = b[U(NX) + i] * per, b[U(NY) + i] * per, b[U(NZ) + i] * per
        for k in range(U(3)):
            row_k = U(PROBES) + (k + U(ALONG)) * U(BLOCK) + i
            value = x * b[row_k] + y * b[row_k + U(3 * BLOCK)] + z * b[row_k + U(6 * BLOCK)]
            b[U(GLOW_R) + k * U(BLOCK) + i] = max(value, f4(0))
