"""Columns and rows of pixels' centres from their numbers, which float32 cannot hold all."""

from __future__ import annotations

import numba as nb
import numpy as np
import pytest

from viewsphere.engines.raster.shading.kernels_block import BLOCK, T0, T1
from viewsphere.engines.raster.shading.kernels_gather import _find_centers
from viewsphere.kernels.jit import njit


@njit
def find(columns, own, b):
    _find_centers(BLOCK, nb.intp(columns), nb.float32(1) / nb.float32(columns), own, b)


@pytest.mark.parametrize(
    ("width", "height"),
    [(1, 1), (1, 5000), (2, 3001), (61, 47), (640, 480), (641, 479), (4097, 4099), (16383, 6103), (99_999, 1000), (37, 9_999)],
)
def test_centers_are_exact(width, height):
    rng = np.random.default_rng(width)
    starts = width * rng.integers(0, height, 500)
    numbers = np.concatenate([starts, starts + width - 1, rng.integers(0, width * height, 1000), [0, width * height - 1]])
    b = np.zeros(T1 + BLOCK, np.float32)
    for part in np.array_split(numbers, -(-len(numbers) // BLOCK)):
        own = np.zeros(BLOCK, np.int32)
        own[: len(part)] = part
        find(np.uint32(width), own, b)
        np.testing.assert_array_equal(b[T0:][: len(part)], part % width + 0.5)
        np.testing.assert_array_equal(b[T1:][: len(part)], part // width + 0.5)
