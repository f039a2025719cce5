"""Curves through points, against closed forms and against brute force."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewsphere.geometry.curve import spline

RNG = np.random.default_rng(3)


def brute(curve, first, last, steps=200_000):
    """Length of the curve's spans between two knots, by short chords of the polynomials, float64."""
    u = np.linspace(0, 1, steps // len(curve.cubics))[:, None]
    total = 0.0
    for c in curve.cubics[first:last]:
        total += float(np.linalg.norm(np.diff(c[0] + u * (c[1] + u * (c[2] + u * c[3])), axis=0), axis=1).sum())
    return total


def test_two_points_are_a_line():
    curve = spline([[0, 0, 0], [3, 4, 0]])
    assert curve.length == pytest.approx(5, abs=1e-14)
    np.testing.assert_allclose(curve.points_at([0, 1, 2.5, 5]), [[0, 0, 0], [0.6, 0.8, 0], [1.5, 2, 0], [3, 4, 0]], atol=1e-14)
    np.testing.assert_allclose(curve.direction(3.3), [0.6, 0.8, 0], atol=1e-15)


def test_points_of_a_line_give_the_line_however_they_are_spaced():
    x = np.array([0, 0.1, 5, 5.2, 9.0])
    curve = spline(np.stack([x, 0 * x, 0 * x], axis=1))
    s = np.linspace(0, 9, 101)
    np.testing.assert_allclose(curve.points_at(s)[:, 0], s, atol=1e-12)


@pytest.mark.parametrize("closed", [False, True])
def test_passes_its_points_at_its_knots(closed):
    points = RNG.normal(size=(7, 3)) * 5
    curve = spline(points, closed)
    there = np.concatenate([points, points[:1]]) if closed else points
    assert curve.knots.shape == (len(there),)
    np.testing.assert_allclose(curve.points_at(curve.knots), there, atol=1e-9)


@pytest.mark.slow
@given(st.integers(0, 2**32 - 1), st.booleans())
@settings(max_examples=20, deadline=None)
def test_length_is_the_length_of_short_chords(seed, closed):
    points = np.random.default_rng(seed).normal(size=(5, 3)) * 10
    curve = spline(points, closed)
    assert curve.length == pytest.approx(brute(curve, 0, len(curve.cubics)), rel=1e-8)
    assert curve.knots[2] == pytest.approx(brute(curve, 0, 2), rel=1e-8)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=20, deadline=None)
def test_equal_steps_of_length_are_equally_long(seed):
    curve = spline(np.random.default_rng(seed).normal(size=(6, 3)) * 10)
    s = np.linspace(0.001, curve.length - 0.001, 500)
    speed = np.linalg.norm(curve.points_at(s + 1e-4) - curve.points_at(s - 1e-4), axis=1) / 2e-4
    assert np.abs(speed - 1).max() < 1e-6
    ahead = (curve.points_at(s + 1e-4) - curve.points_at(s - 1e-4)) / 2e-4
    np.testing.assert_allclose(curve.direction(s), ahead, atol=1e-5)


def test_a_closed_curve_goes_around_and_an_open_one_ends():
    points = [[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]]
    around, there = spline(points, closed=True), spline(points)
    np.testing.assert_allclose(around.points_at(1.5 + 2 * around.length), around.points_at(1.5), atol=1e-9)
    np.testing.assert_allclose(around.points_at(-0.5), around.points_at(around.length - 0.5), atol=1e-9)
    np.testing.assert_allclose(there.points_at([-1, there.length + 1]), [points[0], points[-1]], atol=1e-12)


def test_a_closed_curve_of_a_regular_polygon_turns_alike_at_every_point():
    angles = np.arange(12) * np.pi / 6
    curve = spline(np.stack([np.cos(angles), np.sin(angles)], axis=1), closed=True)
    np.testing.assert_allclose(np.diff(curve.knots), curve.length / 12, rtol=1e-12)
    assert np.abs(np.linalg.norm(curve.points_at(np.linspace(0, curve.length, 400)), axis=1) - 1).max() < 2e-3
    assert np.abs((curve.points_at(curve.knots) * curve.direction(curve.knots)).sum(axis=1)).max() < 1e-12


@pytest.mark.parametrize(
    ("points", "closed", "found"),
    [
        ([[1, 2, 3]], False, "expected 2 points or more; found 1"),
        ([[1, 2, 3], [2, 2, 3]], True, "expected 3 points or more; found 2"),
        ([[0, 0, 0], [1, 0, 0], [1, 0, 0]], False, "found point 2 and the next at"),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0]], True, "found point 4 and the next at"),
    ],
)
def test_mistakes(points, closed, found):
    with pytest.raises(ValueError, match=found):
        spline(points, closed)
