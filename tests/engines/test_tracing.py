"""What rays of the light that is baked meet."""

from __future__ import annotations

import numpy as np
import pytest

from viewsphere.engines.raster.tracing import cast, tree_of, unblocked


def test_rays_meet_what_brute_force_finds():
    rng = np.random.default_rng(5)
    corners = (rng.uniform(-1, 1, (300, 1, 3)) + rng.normal(0, 0.15, (300, 3, 3))).astype(np.float32)
    origins, ways = rng.uniform(-1.2, 1.2, (40, 3)).astype(np.float32), rng.normal(size=(25, 3)).astype(np.float32)
    met, far = cast(tree_of(corners), origins, ways[None], np.zeros(40, np.int32), np.inf)
    a, b, c = corners.astype(float).transpose(1, 0, 2)
    for k, d in enumerate(ways.astype(float)):
        p = np.cross(d, c - a)
        det = (p * (b - a)).sum(axis=1)
        s = origins[:, None].astype(float) - a
        q = np.cross(s, b - a)
        u, v, t = (s * p).sum(axis=2) / det, (q @ d) / det, (q * (c - a)).sum(axis=2) / det
        t = np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0), t, np.inf)
        np.testing.assert_array_equal(met[k], np.where(np.isfinite(t.min(axis=1)), t.argmin(axis=1), -1))
        np.testing.assert_allclose(far[k], t.min(axis=1), rtol=2e-4)
    assert 0.2 < (met >= 0).mean() < 0.98
    ends = origins + ways[0] * np.where(np.isfinite(far[0]), far[0], 1)[:, None]
    seen = unblocked(tree_of(corners), origins, ((ends - origins) * np.float32(0.9)).astype(np.float32))
    assert seen.all()
    beyond = unblocked(tree_of(corners), origins, ((ends - origins) * np.float32(1.1)).astype(np.float32))
    np.testing.assert_array_equal(beyond[met[0] >= 0], 0)


@pytest.mark.parametrize("count", [1, 8, 9, 100])
def test_triangles_that_no_cut_tells_apart(count):
    """All around one middle, of which one is nearer to where rays begin."""
    corners = np.tile(np.array([(-1, -1, 0), (1, -1, 0), (0, 1, 0)], np.float32), (count, 1, 1))
    corners[count // 2, :, 2] = 0.0, 0.0, 0.25
    corners[count // 2, :2, 2] = -0.125
    met, far = cast(*fan([(0, 0.5, 3)], [(0, 0, -1)], corners))
    assert met[0, 0] == count // 2
    assert far[0, 0] == pytest.approx(3 - 0.15625)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("sign", [-1, 1])
def test_rays_along_an_axis_within_the_planes_of_boxes(axis, sign):
    """From the edges of a grid of unit squares, along these edges, onto the squares behind: none passes between two of them."""
    steps = np.stack(np.meshgrid(np.arange(6.0), np.arange(6.0), indexing="ij"), axis=-1).reshape(-1, 2)
    halves = np.array([[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]])
    squares = (steps[:, None, None] + halves).reshape(-1, 3, 2)
    flat = np.insert(squares, axis, 4.0 * sign, axis=2).astype(np.float32)
    inner = steps[(steps > 0).all(axis=1)]
    way = np.zeros(3)
    way[axis] = sign
    met, far = cast(*fan(np.insert(inner, axis, 0.0, axis=1), [way], flat))
    assert (met >= 0).all()
    np.testing.assert_array_equal(far, 4)
    met, _ = cast(*fan(np.insert(inner, axis, 0.0, axis=1), [-way], flat))
    np.testing.assert_array_equal(met, -1)


def test_what_has_no_numbers_is_met_by_nothing():
    corners = np.array([[(-1, -1, 1), (1, -1, 1), (0, 1, np.nan)], [(-1, -1, 2), (1, -1, 2), (0, 1, 2)]], np.float32)
    met, far = cast(*fan([(0, 0, 0)], [(0, 0, 1)], corners))
    assert (met[0, 0], far[0, 0]) == (1, 2)


def fan(origins, ways, corners):
    """Arguments of `cast`: all these directions from each origin."""
    origins, ways = np.array(origins, np.float32), np.array(ways, np.float32)
    return tree_of(corners), origins, ways[None], np.zeros(len(origins), np.int32), np.inf
