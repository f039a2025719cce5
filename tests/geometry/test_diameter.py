"""The diameter equals that of all pairs, whatever the points look like; round things, the worst case, are not slow."""

import math

import numpy as np
import pytest

from quick import quick
from viewsphere.geometry.diameter import diameter


def of_all_pairs(points):
    points = np.asarray(points, np.float64)
    return max(math.sqrt(((points - p) ** 2).sum(axis=1).max()) for p in points)


@pytest.mark.parametrize("scale", [(1, 1, 1), (9, 1, 1), (1, 1, 0), (2, 2, 1e-4)])
@pytest.mark.parametrize("count", [1, 2, 3, 8, 9, 40, 700])
def test_it_equals_that_of_all_pairs(count, scale):
    rng = np.random.default_rng(count)
    points = (rng.normal(size=(count, 3)) * scale + 5).astype(np.float32)
    assert diameter(points) == of_all_pairs(points)
    assert diameter(rng.permutation(points)) == diameter(points)


@pytest.mark.parametrize("turns", quick([19, 60], 19))
def test_round_things(turns):
    """Of a sphere every point has one that is nearly as far away as any."""
    around, up = np.meshgrid(np.arange(turns) * 2 * math.pi / turns, np.linspace(0, math.pi, turns))
    sphere = np.stack([np.sin(up) * np.cos(around), np.sin(up) * np.sin(around), np.cos(up)], axis=-1).reshape(-1, 3)
    assert diameter(sphere.astype(np.float32)) == of_all_pairs(sphere.astype(np.float32))


def test_points_that_are_all_one():
    assert diameter(np.ones((50, 3))) == 0.0


def test_corners_of_a_box_and_many_points_inside():
    inside = np.random.default_rng(1).random((20_000, 3))
    assert diameter([*inside, (0, 0, 0), (1, 1, 1)]) == math.sqrt(3)
