"""Colour changes of single pixels."""

from __future__ import annotations

import numba as nb

from viewsphere.kernels.jit import njit
from viewsphere.rendering.kernels_view import FAST

f4 = nb.float32
U = nb.uintp


@njit(fastmath=FAST)
def recolor(picture, table, matrix, out):
    """Put three channels through the table (if it is not empty), then through the matrix; (N, 3), or (N, 4) premultiplied."""
    top = f4(table.shape[0] - 1)
    for i in range(picture.shape[0]):
        a = picture[i, 3] if picture.shape[1] == 4 else f4(1)
        s = f4(1) / max(a, f4(1e-6))
        r, g, b = picture[i, 0] * s, picture[i, 1] * s, picture[i, 2] * s
        if table.shape[0] > 0:
            r = table[U(nb.int32(min(f4(1), max(f4(0), r)) * top + f4(0.5)))]
            g = table[U(nb.int32(min(f4(1), max(f4(0), g)) * top + f4(0.5)))]
            b = table[U(nb.int32(min(f4(1), max(f4(0), b)) * top + f4(0.5)))]
        for c in range(3):
            v = matrix[c, 0] * r + matrix[c, 1] * g + matrix[c, 2] * b
            out[i, c] = min(f4(1), max(f4(0), v)) * a
        if picture.shape[1] == 4:
            out[i, 3] = a
