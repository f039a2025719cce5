"""How kernels are compiled."""

from __future__ import annotations

import numpy as np

from viewsphere.geometry.jit import inner, njit


@inner
def doubled(numbers, i):
    return numbers[i] * 2.0 if i > 0 else 1.0


@inner(fastmath=True)
def total(numbers):
    found = 0.0
    for i in range(len(numbers)):
        found += doubled(numbers, i)
    return found


@njit
def both(numbers):
    return total(numbers) + doubled(numbers, 3)


def test_inner_kernels_become_parts_of_those_that_call_them():
    assert both(np.arange(10.0)) == 1 + 2 * 45 + 6
    assert both(np.arange(10)) == 1 + 2 * 45 + 6  # another type of the same
