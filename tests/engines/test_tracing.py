"""What rays of the light that is baked meet."""

from __future__ import annotations

import numpy as np
import pytest

from viewsphere.engines.raster.reflections.tracing import cast, tree_of, unblocked


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
    corners[count // 2, :, 2] = -0.25, -0.25, 0.25
    met, far = cast(*fan([(0, 0.5, 3)], [(0, 0, -1)], corners))
    assert met[0, 0] == count // 2
    assert far[0, 0] == pytest.approx(3 - 0.125)


@pytest.mark.parametrize("shrink", [1.3, 1.05])
def test_triangles_that_make_a_tree_steep(shrink):
    """Around one corner, each smaller than the one before: a cut takes few off."""
    sizes = shrink ** -np.arange(300.0)[:, None, None]
    corners = (np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)]) * np.maximum(sizes, 1e-6)).astype(np.float32)
    corners[..., 2] = np.arange(300)[:, None]
    met, far = cast(*fan([(1e-7, 1e-7, 1000)], [(0, 0, -1)], corners))
    assert (met[0, 0], far[0, 0]) == (299, 701)


WAYS = {
    "down": (0, 0, -1),
    "within a plane": (0, 0.6, -0.8),
    "askew": (0.3, 0.6, -0.74),
    "nearly down": (1e-9, 1e-12, -1),
    "down but for rounding": (1e-32, -1e-35, -1),
}


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("height", [0.0, 0.3])
def test_no_ray_passes_where_triangles_meet(way, height):
    """Through the vertices of a field of triangles rays meet what they meet one by one, by the same arithmetic."""
    rng, n = np.random.default_rng(3), 20
    x, y = np.meshgrid(*np.cumsum(rng.uniform(0.05, 0.3, (2, n + 1)), axis=1), indexing="ij")
    points = np.stack([x, y, rng.normal(0, height, x.shape)], axis=-1).astype(np.float32)
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    corners = np.stack([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)], axis=2).reshape(-1, 3, 3)
    along = np.array(WAYS[way], np.float32)
    origins = (points[1:-1, 1:-1].reshape(-1, 3) - 3 * along).astype(np.float32)
    met, _ = cast(*fan(origins, [along], corners))
    np.testing.assert_array_equal(met[0] >= 0, [meets(corners, origin, along) for origin in origins])


def meets(corners, origin, way):
    """Return whether a ray meets any triangle (T, 3, 3), in float32 (Moeller and Trumbore)."""
    a, b, c = corners.transpose(1, 0, 2)
    with np.errstate(all="ignore"):
        p, s = cross(way, c - a), origin - a
        q, scale = cross(s, b - a), np.float32(1) / dot(b - a, p)
        u, v, t = dot(s, p) * scale, dot(way, q) * scale, dot(c - a, q) * scale
        return bool(((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)).any())


def cross(a, b):
    (ax, ay, az), (bx, by, bz) = a.T, b.T
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)


def dot(a, b):
    x, y, z = (a * b).T
    return x + y + z


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("sign", [-1, 1])
def test_rays_along_an_axis_within_the_planes_of_boxes(axis, sign):
    """From the corners of a grid of unit squares onto those behind: none passes between two of them, or beside the last."""
    steps = np.stack(np.meshgrid(np.arange(6.0), np.arange(6.0), indexing="ij"), axis=-1).reshape(-1, 2)
    halves = np.array([[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]])
    squares = (steps[:, None, None] + halves).reshape(-1, 3, 2)
    flat = np.insert(squares, axis, 4.0 * sign, axis=2).astype(np.float32)
    corners = np.insert(np.unique(squares.reshape(-1, 2), axis=0), axis, 0.0, axis=1)
    way = np.zeros(3)
    way[axis] = sign
    met, far = cast(*fan(corners, [way], flat))
    assert len(corners) == 49 and (met >= 0).all()
    np.testing.assert_array_equal(far, 4)
    met, _ = cast(*fan(corners, [-way], flat))
    np.testing.assert_array_equal(met, -1)


@pytest.mark.parametrize("count", [1, 8, 9, 500])
def test_rays_without_numbers_meet_nothing(count):
    corners = np.random.default_rng(0).normal(size=(count, 3, 3)).astype(np.float32)
    met, _ = cast(*fan([(np.nan, 0, 0), (np.nan,) * 3, (0, 0, 0)], [(0, 0, 1), (np.nan, 0, 1)], corners))
    np.testing.assert_array_equal(met[:, :2], -1)
    np.testing.assert_array_equal(met[1], -1)


def test_what_has_no_numbers_is_met_by_nothing():
    corners = np.array([[(-1, -1, 1), (1, -1, 1), (0, 1, np.nan)], [(-1, -1, 2), (1, -1, 2), (0, 1, 2)]], np.float32)
    met, far = cast(*fan([(0, 0, 0)], [(0, 0, 1)], corners))
    assert (met[0, 0], far[0, 0]) == (1, 2)


def fan(origins, ways, corners):
    """Arguments of `cast`: all these directions from each origin."""
    origins, ways = np.array(origins, np.float32), np.array(ways, np.float32)
    return tree_of(corners), origins, ways[None], np.zeros(len(origins), np.int32), np.inf
