"""Kernels compute what Python does: elements of arrays however they lie, loops however they count, variables of branches."""

from __future__ import annotations

import numpy as np
import pytest

from viewsphere.kernels.jit import njit

RANDOM = np.random.default_rng(5)


def turned(array):
    """Each element of an array of three axes, and the mirrored one of another, counted from either end."""
    a, b, c = array.shape
    out = np.zeros((c, b, a))
    for i in range(a):
        for j in range(b):
            for k in range(c):
                out[k, -1 - j, i] = 2.0 * array[i, j, -1 - k] + array[0, np.uint8(j), 0]
    return out


@pytest.mark.parametrize("layout", ["C", "F", "every other"])
@pytest.mark.parametrize("kind", [np.float32, np.int16, np.bool_])
def test_elements_are_where_numpy_has_them(layout, kind):
    array = RANDOM.integers(0, 2 if kind is np.bool_ else 1000, (4, 6, 10)).astype(kind)
    array = {"C": array, "F": np.asfortranarray(array), "every other": array[::2, 1::2, ::-3]}[layout]
    assert np.array_equal(njit(_nrt=True)(turned)(array), turned(array))


def counted(start, stop, step):
    """What three kinds of ranges count."""
    found = 0
    for i in range(stop):
        found += 1 + i
    for i in range(start, stop):
        found = found * 3 + i
        for _ in range(i, 4):
            found += 1
    for i in range(start, stop, step):
        found = found * 5 + i
        if i == 7:
            break
    return found


@pytest.mark.parametrize("bounds", [(0, 0, 1), (3, 9, 2), (9, 3, -2), (5, 5, 1), (-4, 3, 3), (4, -3, 5), (2, 12, 5)])
def test_ranges_count_as_in_python(bounds):
    assert njit(counted)(*bounds) == counted(*bounds)


def test_a_step_of_zero_is_an_error():
    with pytest.raises(ValueError, match="zero"):
        njit(counted)(1, 2, 0)


def chosen(numbers, limit):
    """Variables that are set in one branch, in both, before a loop and in it, and used after."""
    first, last, best = numbers[0], 0.0, -1
    for i in range(numbers.shape[0]):
        number = numbers[i]
        if number > limit:
            twice = number * 2
            best = i
        else:
            twice = -number
            last = twice
        while twice > 10:
            twice -= first
        numbers[i] = twice + last
    return best, last, numbers[-1]


def test_variables_keep_their_values_from_block_to_block():
    for seed in range(20):
        numbers = np.random.default_rng(seed).uniform(1, 20, 30)
        own, theirs = numbers.copy(), numbers.copy()
        assert njit(chosen)(own, 9.5) == chosen(theirs, 9.5)
        assert np.array_equal(own, theirs)


def far(array, i, j):
    """An element of a table by numbers of other types."""
    return array[i, j]


@pytest.mark.parametrize("kind", [np.int8, np.uint8, np.int32, np.uint32, np.int64, np.uint64])
def test_any_integer_is_an_index(kind):
    array = np.arange(300.0).reshape(2, 150)
    assert njit(far)(array, kind(1), kind(120)) == array[1, 120]
    if np.issubdtype(kind, np.signedinteger):
        assert njit(far)(array, kind(-2), kind(-1)) == array[-2, -1]
