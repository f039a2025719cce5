"""Intervals around a circle, against a search over all rotations."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from viewsphere.geometry.seam import (
    clip_to_turn,
    in_picture,
    interval_of_columns,
    part_in,
    short_way,
    shortest_interval,
    tight_box,
    united,
)

MASKS = st.lists(st.booleans(), min_size=2, max_size=24).filter(any)


@given(MASKS)
def test_the_interval_of_columns_is_the_shortest(columns):
    filled = np.array(columns)
    x0, x1 = interval_of_columns(filled)
    width = len(filled)
    lengths = [int(np.flatnonzero(np.roll(filled, -shift)).max()) + 1 for shift in np.flatnonzero(filled)]
    assert filled[x0] and 0 <= x0 < width
    assert x1 - x0 == min(lengths)
    assert filled.take(np.arange(x0, x1), mode="wrap").sum() == filled.sum()


@given(st.lists(st.tuples(st.integers(0, 99), st.integers(0, 99)), min_size=1, max_size=6))
def test_the_interval_of_arcs_is_the_shortest(arcs):
    starts, ends = np.array(arcs, float).T
    x0, x1 = shortest_interval(starts, ends, 100.0)
    covered = np.zeros(200, bool)  # half steps: points and the open pieces between them
    for start, end in arcs:
        covered[np.arange(2 * start, 2 * (end + 100 * (end < start)) + 1) % 200] = True
    if covered.all():
        assert (x0, x1) == (0.0, 100.0)
        return
    filled = np.flatnonzero(covered)
    gaps = np.diff(filled, append=filled[0] + 200)
    assert x1 - x0 == (200 - gaps.max()) / 2
    assert covered[np.arange(int(2 * x0), int(2 * x1) + 1) % 200].sum() == covered.sum()


def test_boxes_across_the_seam():
    mask = np.zeros((6, 10), bool)
    mask[2, 9] = mask[3, 0:2] = True
    box = tight_box((0, 2, 10, 4), 10, lambda: mask)
    assert box == (9, 2, 12, 4)
    np.testing.assert_array_equal(part_in(box, mask), [[1, 0, 0], [0, 1, 1]])
    assert tight_box((0, 2, 10, 4), None, lambda: mask) == (0, 2, 10, 4)
    assert united((9, 0, 12, 4), (1, 2, 3, 6), 10) == (9, 0, 13, 6)
    assert united((0, 0, 2, 4), (1, 2, 3, 6), None) == (0, 0, 3, 6)
    assert united((0, 0, 10, 4), (1, 2, 3, 6), 10) == (0, 0, 10, 6)
    assert clip_to_turn((9, -1, 12, 4), 3) == (9, 0, 12, 3)
    assert clip_to_turn((9, 3, 12, 4), 3) is None


def test_a_part_of_a_circle_in_a_picture():
    assert in_picture(90, 110, 100, 60) == (-10, 10)
    assert in_picture(50, 110, 100, 60) == (-50, 110)  # both sides of the picture show it
    assert in_picture(65, 75, 100, 60) == (65, 75)


def test_the_short_way():
    np.testing.assert_array_equal(short_way(np.array([60.0, -60.0, 40.0, np.nan]), 100), [-40, 40, 40, np.nan])
