"""Blurs what mirrors show."""

from __future__ import annotations

import numpy as np

from viewsphere.kernels.jit import njit


@njit(_nrt=True)
def box_down(values, reach, out):
    """Sums over `reach` neighbours above and below of values (H, W, C) float32, into out."""
    height, width, columns = values.shape
    total = np.zeros((width, columns), np.float64)
    for y in range(-reach, height):
        if y + reach < height:
            for x in range(width):
                for c in range(columns):
                    total[x, c] += values[y + reach, x, c]
        if y - reach > 0:
            for x in range(width):
                for c in range(columns):
                    total[x, c] -= values[y - reach - 1, x, c]
        if y >= 0:
            for x in range(width):
                for c in range(columns):
                    out[y, x, c] = total[x, c]


@njit(_nrt=True)
def box_across(values, reach, out):
    """Sums over `reach` neighbours on the left and on the right."""
    height, width, columns = values.shape
    total = np.zeros(columns, np.float64)
    for y in range(height):
        total[:] = 0
        for x in range(-reach, width):
            for c in range(columns):
                if x + reach < width:
                    total[c] += values[y, x + reach, c]
                if x - reach > 0:
                    total[c] -= values[y, x - reach - 1, c]
                if x >= 0:
                    out[y, x, c] = total[c]
