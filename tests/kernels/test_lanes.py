"""Vector arithmetic of kernels against numpy's."""

from __future__ import annotations

import numpy as np
import pytest

from viewsphere.kernels.jit import njit
from viewsphere.kernels.lanes import clamp, lanewise, least, most, root, sign, size, where

ROW = 32
A = np.random.default_rng(1).normal(0, 3, ROW).astype(np.float32)


@lanewise
def _arithmetic(scale, b):
    a = b[0]
    b[ROW] = (1 - a * scale) / (size(a) + 2) + root(size(a)) * sign(a) - (-a)
    b[2 * ROW] = where(a > 0.5, least(a, 1), most(a, -1)) + clamp(a)
    b[3 * ROW] = (a.whole() + 3 & 5).real() + b.one(3)


@lanewise
def _unpacked(b):
    texel = b[0].bits()
    b[ROW] = (texel >> 27 & 31).real()
    b[2 * ROW] = ((texel >> 27 & 31) + 103).exponent()
    b[3 * ROW] = (texel & 511).real()


@lanewise(exact=True)
def _double(row, b):
    b[row] = b[row] * 2
    b[row, ROW] = 7


@lanewise
def _bounded(b):
    b[ROW], b[2 * ROW] = most(b[0], 1), least(b[0], 2)


@njit
def arithmetic(count, scale, b):
    _arithmetic(count, scale, b)


@njit
def unpacked(count, b):
    _unpacked(count, b)


@njit
def double(count, row, b):
    _double(count, row, b)


@njit
def bounded(count, b):
    _bounded(count, b)


def rows(first):
    b = np.zeros(4 * ROW, np.float32)
    b[:ROW] = first
    return b


def test_lanes_unpack_bits_whatever_their_sign():
    k = np.arange(ROW, dtype=np.uint32)
    b = np.zeros(4 * ROW, np.float32)
    b[:ROW] = (k << 27 | 341 + k).view(np.float32)
    unpacked(ROW, b)
    np.testing.assert_array_equal(b[ROW : 2 * ROW], k)
    np.testing.assert_array_equal(b[2 * ROW : 3 * ROW], 2.0 ** (k.astype(float) - 24))
    np.testing.assert_array_equal(b[3 * ROW :], 341 + k)


def test_lanes_compute_what_numpy_does():
    b = rows(A)
    arithmetic(ROW, np.float32(0.25), b)
    expected = (1 - A / 4) / (abs(A) + 2) + np.sqrt(abs(A)) * np.where(A >= 0, 1, -1) + A
    np.testing.assert_allclose(b[ROW : 2 * ROW], expected, rtol=1e-5, atol=1e-6)
    expected = np.where(A > 0.5, np.minimum(A, 1), np.maximum(A, -1)) + A.clip(0, 1)
    np.testing.assert_allclose(b[2 * ROW : 3 * ROW], expected, rtol=1e-6)
    np.testing.assert_allclose(b[3 * ROW :], (A.astype(int) + 3 & 5) + A[3], rtol=1e-6)


@pytest.mark.parametrize("count", [0, 1, 7, 8, 9, 31])
def test_exact_functions_touch_nothing_beyond_the_count(count):
    b = rows(A)
    double(count, np.uintp(0), b)
    np.testing.assert_array_equal(b[:ROW], np.where(np.arange(ROW) < count, 2 * A, A))
    np.testing.assert_array_equal(b[ROW : 2 * ROW], np.where(np.arange(ROW) < count, 7, 0))


def test_bounds_hold_what_is_no_number():
    b = rows(np.array([np.nan, np.inf, -np.inf, 1.5] * 8))
    bounded(ROW, b)
    np.testing.assert_array_equal(b[ROW : ROW + 4], [1, np.inf, 1, 1.5])
    np.testing.assert_array_equal(b[2 * ROW : 2 * ROW + 4], [2, 2, -np.inf, 1.5])
