"""Convex hulls and smallest rectangles, against definitions and scipy's."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from viewsphere.geometry.hull import MANY, convex_hull, mask_outline, smallest_rectangle

QUICK = settings(max_examples=60, derandomize=True, deadline=None, database=None)


def turns(hull):
    before, after = hull - np.roll(hull, 1, axis=0), np.roll(hull, -1, axis=0) - hull
    return before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]


@QUICK
@given(arrays(np.int64, st.tuples(st.integers(3, 30), st.just(2)), elements=st.integers(-6, 6)))
def test_a_hull_of_points_of_a_grid(points):
    """It turns one way at each corner, its corners are points, and no point lies outside."""
    hull = convex_hull(points.astype(np.float64))
    assert {*map(tuple, hull.tolist())} <= {*map(tuple, points.astype(float).tolist())}
    if len(hull) < 3:
        spread = points - points[0]
        assert np.linalg.matrix_rank(spread) < 2
        return
    assert (turns(hull) > 0).all()
    for a, b in zip(hull, np.roll(hull, -1, axis=0), strict=True):
        side = b - a
        assert (side[0] * (points[:, 1] - a[1]) - side[1] * (points[:, 0] - a[0]) >= 0).all()


@pytest.mark.parametrize("kind", ["disc", "square", "line", "ring", "point"])
def test_many_points_have_the_hull_that_scipy_finds(kind):
    scipy = pytest.importorskip("scipy.spatial")
    rng = np.random.default_rng(5)
    for _ in range(5):
        points = rng.normal(size=(5000, 2)) * (3, 1)
        if kind == "square":
            points = rng.random((5000, 2))
        if kind == "ring":
            points /= np.hypot(*points.T)[:, None]
        if kind in ("line", "point"):
            points = np.outer(rng.integers(0, 9, 5000) if kind == "line" else np.ones(5000), (2.0, 1.0))
            assert len(points) > MANY
            assert len(convex_hull(points)) == (2 if kind == "line" else 1)
            continue
        found, wanted = convex_hull(points), points[scipy.ConvexHull(points).vertices]
        assert {*map(tuple, found.tolist())} == {*map(tuple, wanted.tolist())}


@QUICK
@given(st.integers(0, 10**6))
def test_no_rectangle_of_any_angle_is_smaller(seed):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(int(rng.integers(3, 40)), 2)) * rng.uniform(0.1, 5, 2)
    corners = smallest_rectangle(convex_hull(points))
    sides = np.roll(corners, -1, axis=0) - corners
    area = abs(sides[0, 0] * sides[1, 1] - sides[0, 1] * sides[1, 0])
    for angle in np.radians(np.arange(0, 90, 0.5)):
        turned = points @ np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        assert area <= np.ptp(turned, axis=0).prod() * (1 + 1e-9)
    for k in range(4):
        along = (points - corners[k]) @ sides[k] / np.hypot(*sides[k])
        assert along.min() > -1e-9 and along.max() < np.hypot(*sides[k]) + 1e-9
    assert corners[0, 1] == pytest.approx(corners[:, 1].min())


@QUICK
@given(arrays(np.bool_, st.tuples(st.integers(1, 9), st.integers(1, 9))))
def test_a_mask_s_outline_has_the_hull_of_its_pixels(mask):
    y, x = np.nonzero(mask)
    pixels = np.concatenate([np.stack([x + a, y + b], axis=1) for a in (0, 1) for b in (0, 1)]).astype(np.float64)
    np.testing.assert_array_equal(convex_hull(mask_outline(mask)), convex_hull(pixels))
