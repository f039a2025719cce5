"""Light on surfaces that are not flat against closed forms: it is gathered around them, not read from probes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from light_stage import ball
from test_bounces import inside_out, matt, painted_mesh, stage_of
from test_raster import DARK, box, camera, mesh_of, rectangle

from shots import painted
from viewsphere.engines.raster.indirect import bounces as baking
from viewsphere.engines.raster.indirect.kernels_probes import look_up
from viewsphere.engines.raster.lightmaps import vertex_light
from viewsphere.engines.raster.lightmaps.kernels_lightmap import WEIGHT
from viewsphere.engines.raster.lightmaps.kernels_vertex_light import NONE, read_vertices
from viewsphere.engines.raster.lightmaps.lightmaps import charts_of
from viewsphere.engines.raster.lightmaps.vertex_light import vertex_light_of
from viewsphere.engines.raster.records import NO_LIGHTMAP
from viewsphere.engines.raster.reflections.tracing import tree_of
from viewsphere.engines.raster.shading.kernels_block import BARY1, BARY2, BLOCK, GLOW_R, GX, MAPPED, NX, ROWS
from viewsphere.kernels.jit import njit
from viewsphere.model.scene import Scene

UNLIT = Scene(sun=None, sky=DARK)


@pytest.fixture(autouse=True)
def forgotten():
    baking._bake.cache_clear()
    baking._look.cache_clear()


def corners_of(mesh) -> np.ndarray:
    return mesh.vertices[mesh.triangles].astype(float)


def known(stage, first: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of the facets from triangle `first` on: where their first corners are in the world, their normals, and radiance of white
    matt surfaces there.
    """
    baked = stage.baked(0)
    surfaces, chart = baked.surfaces, baked.bounces.lightmap.chart
    own = np.flatnonzero(chart < -1).astype(np.int32)
    own = own[own >= first]
    at, normals = surfaces.vertices[surfaces.triangles[own, 0], 11:14], surfaces.normals[own].copy()
    glow, inside = np.empty(at.shape, np.float32), np.empty(len(at), np.float32)
    look_up(baked.bounces, at, normals, own, glow, inside)
    return at * baked.unit + baked.origin, normals, glow


@pytest.mark.slow
@pytest.mark.parametrize("reflectance", [0.0, 0.7])
def test_a_ball_in_a_closed_box_that_glows_evenly(reflectance):
    """The furnace: all places have the same light, whatever is where."""
    walls = inside_out(box((-1.0, -0.8, -0.6), (1.0, 0.8, 0.6)))
    within = corners_of(ball(0.3, (0.2, 0.1, 0.0)))
    stage = stage_of(painted_mesh((walls, matt(reflectance, 1.0)), (within, matt(reflectance, 1.0))), UNLIT)
    _, _, light = known(stage, len(walls))
    assert len(light) == len(within)
    np.testing.assert_allclose(light, 1 / (1 - reflectance), rtol=0.035)


@pytest.mark.slow
def test_a_ball_between_a_ceiling_that_glows_and_a_black_floor():
    """What a place has of an endless ceiling: half of one and the cosine between its normal and up."""
    wide = 36.0
    floor = rectangle((-wide / 2, -wide / 2, -1), (wide, 0, 0), (0, wide, 0))
    ceiling = inside_out(rectangle((-wide / 2, -wide / 2, 1), (wide, 0, 0), (0, wide, 0)))
    within = corners_of(ball(0.5, (0, 0, 0)))
    mesh = painted_mesh((floor, matt(0.0)), (ceiling, matt(0.0, 1.0)), (within, matt(0.0)))
    _, normals, light = known(stage_of(mesh, UNLIT), 4)
    assert len(light) == len(within)
    expected = (1 + normals[:, 2]) / 2
    np.testing.assert_allclose(light[:, 0], expected, atol=0.06)
    assert np.abs(light[:, 0] - expected).mean() < 0.02


def waves(side: int) -> np.ndarray:
    """A sheet with folds, 1 m wide and high, that faces along +Y or -Y, 2 mm from its middle."""
    x = np.linspace(0, 1, 97)
    y = 0.04 * np.sin(x * 8 * np.pi) + 0.002 * side
    low, high = np.stack([x, y, 0 * x], axis=1), np.stack([x, y, 0 * x + 1], axis=1)
    faces = np.concatenate([np.stack([low[:-1], high[:-1], high[1:]], axis=1), np.stack([low[:-1], high[1:], low[1:]], axis=1)])
    return faces if side > 0 else faces[:, ::-1]


@pytest.mark.slow
def test_both_sides_of_a_curtain_have_light_of_their_own():
    lamp = rectangle((-4, 1, -4), (9, 0, 0), (0, 0, 9))
    curtain = np.concatenate([waves(1), waves(-1)])
    mesh = painted_mesh((lamp, matt(0.0, 1.0)), (curtain, matt(0.0)))
    _, normals, light = known(stage_of(mesh, UNLIT), 2)
    assert len(light) == len(curtain)
    front = normals[:, 1] > 0
    assert front.sum() == len(curtain) // 2
    assert light[front].mean() > 0.7
    assert light[~front].mean() < 0.02
    assert light[~front].max() < 0.1


@pytest.mark.slow
def test_a_ball_in_the_furnace_is_as_even_as_the_walls_in_a_picture():
    walls = inside_out(box((-1.0, -0.8, -0.6), (1.0, 0.8, 0.6)))
    within = corners_of(ball(0.2, (0.0, 0.0, 0.0)))
    mesh = painted_mesh((walls, matt(0.6, 0.2)), (within, matt(0.6, 0.2)))
    picture = painted(stage_of(mesh, UNLIT), camera(60, 45, 40, 20, 15, 0.55)).astype(int)
    on_ball = picture[15:30, 22:38]
    assert np.ptp(on_ball) <= 2
    assert abs(np.median(on_ball) - np.median(picture)) <= 6


def read_at(points: np.ndarray) -> np.ndarray:
    """The light along x, y and z that points tell, (P, 9)."""
    return points[:, 1:10] / points[:, :1]


@pytest.mark.slow
def test_what_is_within_a_thing_takes_no_site_from_what_is_seen():
    walls, within = inside_out(box((-1.0, -0.8, -0.6), (1.0, 0.8, 0.6))), corners_of(ball(0.2, (0.0, 0.0, 0.0)))
    deeper = corners_of(ball(0.195, (0.0, 0.0, 0.0)))
    lightmap = stage_of(mesh_of(np.concatenate([walls, deeper, within])), UNLIT).baked(0).bounces.lightmap
    seen = lightmap.chart[-len(within) :]
    points = lightmap.knots[np.concatenate([lightmap.facets[NONE - 1 - at, 4] + np.arange(3) for at in seen]).astype(int)]
    assert lightmap.points[points, WEIGHT].min() > 0.9


@pytest.mark.parametrize("width", [0.03, 0.1])
def test_a_groove_is_as_dark_as_it_is_narrow(width):
    """At the middle of its bottom the open share is the sine of half the angle that it opens with."""
    depth, half = 0.05, width / 2
    left = np.array([(-half, -2, 0), (-half, 2, 0), (-half, 2, depth), (-half, -2, depth)])
    sides = [own[[0, i, i + 1]] for own in (left, left * (-1, 1, 1)) for i in (1, 2)]
    places = np.stack([np.zeros(64), np.linspace(-1, 1, 64), np.zeros(64)], axis=1).astype(np.float32)
    up = np.tile(np.float32([0, 0, 1]), (64, 1))
    _, met, far = vertex_light.look_near(tree_of(np.array(sides, np.float32)), places, up, 1.0, 1.0)
    share = float(np.sin(np.arctan(half / depth)))
    assert (met < 0).mean() == pytest.approx(share, abs=0.02)
    kept = vertex_light.THROWN_BACK
    assert vertex_light.openness(far, 1.0).mean() == pytest.approx(kept + (1 - kept) * share, abs=0.02)
    assert (vertex_light.openness(far, 0.25 * half) == 1).all()


def test_sites_are_no_more_than_allowed_and_the_smaller_the_fewer(monkeypatch):
    mesh = ball(1.0, (0, 0, 0), 64)
    rows = np.zeros((len(mesh.vertices), 16), np.float32)
    rows[:, :3], rows[:, 11:14] = mesh.normals, mesh.vertices
    a, b, c = corners_of(mesh).transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    normals = (normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype(np.float32)
    sizes = []
    for most in (16_000, 2_000):
        monkeypatch.setattr(vertex_light, "MOST", most)
        tree, triangles = tree_of(corners_of(mesh).astype(np.float32)), mesh.triangles.astype(np.uint32)
        found = vertex_light_of(tree, rows, triangles, np.arange(len(a)), normals, 1.0, 16)
        assert found is not None
        sites, facets = found
        assert most / 4 < len(sites.origins) <= most
        sizes.append(sites.cell)
        # All look outwards from the ball.
        ways = sites.directions
        assert ((ways * sites.normals[:, None]).sum(axis=2) > 0).all()
        radius = np.linalg.norm(sites.places, axis=1)
        assert 0.995 < radius.min() <= radius.max() <= 1
        np.testing.assert_allclose(facets.normals, facets.places / np.linalg.norm(facets.places, axis=1)[:, None], atol=0.05)
        # A point that is half as open has half the light; beside sites that are half as open as well, all of it.
        nodes = np.ones((len(sites.places), 12), np.float32)
        shut = replace(facets, open=facets.open / 2)
        one, half, same = (
            read_at(sites.light_at(own, nodes, np.full(len(nodes), share, np.float32)))
            for own, share in ((facets, 1.0), (shut, 1.0), (shut, 0.5))
        )
        assert np.abs(one).max() > 0.5
        np.testing.assert_allclose(half, one / 2, rtol=1e-5, atol=1e-6)
        np.testing.assert_allclose(same, one, rtol=1e-5, atol=1e-6)
    assert vertex_light.CELL <= sizes[0] < 0.6 * sizes[1]


def test_triangles_without_area_or_numbers_have_no_points():
    good = np.array([[(0, 0, 0), (0.3, 0, 0), (0, 0.1, 0)]], float)
    line, lost = np.zeros((1, 3, 3)) + np.arange(3)[:, None], np.full((1, 3, 3), np.nan)
    corners = np.concatenate([line, good, lost]).astype(np.float32)
    rows = np.zeros((9, 16), np.float32)
    rows[:, 11:14] = corners.reshape(-1, 3)
    triangles, normals = np.arange(9, dtype=np.uint32).reshape(3, 3), np.tile(np.float32([0, 0, 1]), (3, 1))
    tree = tree_of(corners)
    found = vertex_light_of(tree, rows, triangles, np.arange(3), normals, 1.0, 16)
    assert found is not None
    sites, facets = found
    np.testing.assert_array_equal(facets.which, [1])
    parts = int(np.ceil(np.hypot(0.3, 0.1) / (vertex_light.LONG * sites.cell)))
    assert len(facets.knots) == (parts + 1) * (parts + 2) // 2
    assert parts > 1
    np.testing.assert_allclose(facets.normals, np.tile([0, 0, 1], (len(facets.normals), 1)))
    assert vertex_light_of(tree, rows, triangles, np.array([0, 2]), normals, 1.0, 16) is None


@njit
def read(count, lightmap, own, b):
    read_vertices(count, lightmap, own, b)


@pytest.mark.parametrize("parts", [1, 2, 5])
def test_between_points_light_is_linear(parts):
    """Anywhere on a cut triangle: of light that grows evenly along both edges all of it is read as it is."""
    row, column = (
        values[np.add(*np.indices((parts + 1, parts + 1))) <= parts] for values in np.indices((parts + 1, parts + 1))
    )
    points = np.zeros((len(row), 12), np.float32)
    points[:, 0] = 0.5
    points[:, 7:10] = 0.5 * np.stack([1 + column / parts, 1 + row / parts, 3 - (column + row) / parts], axis=1)
    facets = np.array([[0, 0, 1, parts, 0]], np.float32)
    shuffled = np.random.default_rng(2).permutation(len(row))
    lightmap = NO_LIGHTMAP._replace(
        chart=np.array([-2, -1], np.int32), facets=facets, knots=np.argsort(shuffled).astype(np.int32), points=points[shuffled]
    )
    b = np.zeros(ROWS * BLOCK, np.float32)
    shares = np.random.default_rng(1).dirichlet((1, 1, 1), BLOCK)
    shares[:3] = np.eye(3)
    b[BARY1 : BARY1 + BLOCK], b[BARY2 : BARY2 + BLOCK] = shares[:, 1], shares[:, 2]
    for at in (NX, GX):
        b[at + 2 * BLOCK : at + 3 * BLOCK] = 1
    own = np.zeros(BLOCK, np.int32)
    own[-2] = 1  # no facet
    b[GX + 2 * BLOCK + BLOCK - 1] = -1  # seen from behind
    read(BLOCK, lightmap, own, b)
    np.testing.assert_array_equal(b[MAPPED : MAPPED + BLOCK], [1] * (BLOCK - 2) + [0, 0])
    glow = b[GLOW_R : GLOW_R + 3 * BLOCK].reshape(3, -1)[:, :-2]
    expected = np.stack([1 + shares[:, 1], 1 + shares[:, 2], 2 + shares[:, 0]])[:, :-2]
    np.testing.assert_allclose(glow, expected, rtol=1e-5)


@pytest.mark.slow
def test_what_is_flat_keeps_its_chart():
    within = corners_of(ball(0.2, (0.0, 0.0, 0.0)))
    walls = inside_out(box((-1.0, -0.8, -0.6), (1.0, 0.8, 0.6)))
    chart = stage_of(mesh_of(np.concatenate([walls, within])), UNLIT).baked(0).bounces.lightmap.chart
    flat = charts_of(np.concatenate([walls, within]).astype(np.float32), 1.0, 4)
    assert flat is not None
    np.testing.assert_array_equal(chart >= 0, flat.chart >= 0)
    np.testing.assert_array_equal(np.sort(-2 - chart[chart < 0]), np.arange(len(within)))
