"""Light on flat surfaces against closed forms: it is gathered where it is seen, not read from probes in front of it."""

from __future__ import annotations

import numpy as np
import pytest
from test_bounces import EVEN, inside_out, matt, painted_mesh, room, stage_of, walls
from test_raster import DARK, box, camera, mesh_of, rectangle

from shots import painted
from viewsphere.engines.raster.indirect import bounces as baking
from viewsphere.engines.raster.indirect import irradiance_volumes as volumes
from viewsphere.engines.raster.indirect.gathering import final_gather as gathering
from viewsphere.engines.raster.indirect.kernels_probes import look_up
from viewsphere.engines.raster.lightmaps import kernels_lightmap as kernels
from viewsphere.engines.raster.lightmaps import lightmaps
from viewsphere.engines.raster.lightmaps.lightmaps import CELL, MOST, TURNS, charts_of
from viewsphere.engines.raster.reflections.tracing import cast, tree_of
from viewsphere.model.scene import Scene, Sun

LOW, HIGH = np.array((-1.0, -0.8, -0.6)), np.array((1.0, 0.8, 0.6))


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    """Fewer rays of fewer probes: nothing is read from them here."""
    monkeypatch.setattr(volumes, "RAYS", 256)
    monkeypatch.setattr(volumes, "ALONG", 14)
    monkeypatch.setattr(volumes, "CELL", 0.3)
    baking._bake.cache_clear()
    baking._look.cache_clear()


def mapped(stage, places, normals) -> np.ndarray:
    """Radiance (N, 3) of white matt surfaces at world places (N, 3) on triangles that face along these normals."""
    baked = stage.baked(0)
    surfaces, normals, turn = baked.surfaces, np.ascontiguousarray(normals, np.float32), np.arange(len(places))
    at = ((np.asarray(places, float) - baked.origin) / baked.unit).astype(np.float32)
    own = np.flatnonzero(baked.bounces.lightmap.chart >= 0).astype(np.int32)
    above = (at + 0.01 * normals).astype(np.float32)
    tree = tree_of(surfaces.vertices[surfaces.triangles[own], 11:14])
    met, _ = cast(tree, above, -normals[:, None], turn.astype(np.int32), 1.0)
    glow, inside = np.empty(at.shape, np.float32), np.empty(len(at), np.float32)
    look_up(baked.bounces, at, normals, own[met[0]], glow, inside)
    assert (met >= 0).all()
    assert (inside == 1).all()
    return glow


def seen_share(places: np.ndarray, normals: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """The cosine-weighted share of the hemisphere that a polygon, corners (1 or N, K, 3), above each surface's plane fills,
    (N,): Lambert's sum.
    """
    ways = corners - places[:, None]
    ways /= np.linalg.norm(ways, axis=2, keepdims=True)
    after = np.roll(ways, -1, axis=1)
    turn = np.cross(ways, after)
    angle = np.arccos(np.clip((ways * after).sum(axis=2), -1, 1))
    total = angle[..., None] * turn / np.maximum(np.linalg.norm(turn, axis=2, keepdims=True), 1e-12)
    return np.abs((total.sum(axis=1) * normals).sum(axis=1)) / (2 * np.pi)


@pytest.mark.parametrize("reflectance", [0.0, 0.5, 0.8])
@pytest.mark.slow
def test_a_closed_box_that_glows_evenly(reflectance):
    stage = stage_of(painted_mesh((inside_out(box(LOW, HIGH)), matt(reflectance, 1.0))), Scene(sun=None, sky=DARK))
    light = mapped(stage, *(values.reshape(-1, 3) for values in walls(LOW, HIGH)))
    np.testing.assert_allclose(light, 1 / (1 - reflectance), rtol=0.025)


@pytest.mark.parametrize("place", ["opposite", "beside"])
@pytest.mark.slow
def test_a_ceiling_that_glows(place):
    """What each place of the floor and of a wall has before any bounce: the ceiling's share of what is seen."""
    faces = inside_out(box(LOW, HIGH)).reshape(6, 2, 3, 3)
    is_top = [(face[..., 2] == HIGH[2]).all() for face in faces]
    mesh = painted_mesh(
        (np.concatenate([face for face, top in zip(faces, is_top, strict=True) if not top]), matt(0.0)),
        (faces[is_top.index(True)], matt(0.0, 1.0)),
    )
    places, normals = walls(LOW, HIGH, 16)
    which = 4 if place == "opposite" else 0
    light = mapped(stage_of(mesh, Scene(sun=None, sky=DARK)), places[which], normals[which])[:, 0]
    (x0, y0, _), (x1, y1, z) = LOW, HIGH
    top = np.array([(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)])
    known = seen_share(places[which], normals[which], top[None])
    assert light.mean() == pytest.approx(known.mean(), rel=0.01)
    # Along the ceiling light changes within a cell.
    far = places[which][:, 2] < HIGH[2] - CELL
    np.testing.assert_allclose(light[far], known[far], rtol=0.05, atol=0.01)


def test_nodes_together_have_no_more_rays_than_are_allowed(monkeypatch):
    sheet = np.array([[(0, 0, 0), (1, 0, 0), (1, 1, 0)], [(0, 0, 0), (1, 1, 0), (0, 1, 0)]], np.float32)
    many = charts_of(sheet, 1.0, 16)
    monkeypatch.setattr(lightmaps, "ROOM", 5 * len(many.origins))
    assert charts_of(sheet, 1.0, 16).directions.shape[1] == 5
    assert many.directions.shape[1] == 16
    # Of few nodes, the directions in which they look are most.
    monkeypatch.setattr(lightmaps, "ROOM", 3 * 4 * TURNS * TURNS)
    assert len((few := charts_of(0.3 * sheet, 1.0, 16)).origins) < 4 * TURNS * TURNS
    assert few.directions.shape[1] == 3


@pytest.mark.slow
@pytest.mark.parametrize(("bounces", "blotches"), [("on", 0.06), ("fine", 0.02)])
def test_the_sky_through_a_window(bounces, blotches):
    """On the wall opposite, in a black room: the share of what both ends of the opening leave, all above the horizon."""
    small = mesh_of(box((3.0, 1.0, 0.5), (3.05, 1.05, 0.55)), matt(0.0))
    stage = stage_of(small, Scene(sun=None, sky=EVEN), room(0.0), bounces=bounces)
    x, z = (values.ravel() for values in np.meshgrid(np.linspace(0.2, 3.8, 14), np.linspace(0.1, 0.7, 6)))
    places, normals = np.stack([x, np.full(x.size, 3.0), z], axis=1), np.tile([0.0, -1.0, 0.0], (x.size, 1))
    part = 3 / 3.2  # from the outer end to the inner one, seen from the wall
    left, right = np.maximum(0.5, x + (0.5 - x) * part), np.minimum(1.7, x + (1.7 - x) * part)
    low, high = np.maximum(0.8, z + (0.8 - z) * part), np.minimum(2.0, z + (2.0 - z) * part)
    front = np.zeros(x.size)
    corners = [np.stack([u, front, w], axis=1) for u, w in ((left, low), (right, low), (right, high), (left, high))]
    known = seen_share(places, normals, np.stack(corners, axis=1))
    light = mapped(stage, places, normals)[:, 0]
    assert known.min() > 0.005
    assert light.mean() == pytest.approx(known.mean(), rel=0.02)
    assert np.abs(light - known).mean() < blotches * known.mean()


def test_charts_cover_what_is_wide_and_flat_and_no_other():
    sheet = rectangle((0, 0, 0), (2, 0, 0), (0, 1, 0))
    far = rectangle((9, 0, 0), (2, 0, 0), (0, 1, 0))  # of the same plane
    scraps = np.concatenate([rectangle((k, 0, 1 + k / 10), (0.1, 0, 0), (0, 0.1, 0)) for k in range(5)])
    charts = charts_of(np.concatenate([sheet, far, scraps]).astype(np.float32), 1.0, 16)
    assert charts is not None
    np.testing.assert_array_equal(charts.chart[4:], -1)
    assert charts.chart[0] == charts.chart[1] != charts.chart[2] == charts.chart[3]
    for chart, left in zip(charts.charts[charts.chart[[0, 2]]], (0, 9), strict=True):
        wide, high = chart[kernels.WIDE], chart[kernels.HIGH]
        assert (wide, high) == (2 / CELL + 1, 1 / CELL + 1)
        first = int(chart[kernels.FIRST])
        own = charts.origins[first : first + int(wide * high)]
        np.testing.assert_allclose(own.min(axis=0), (left, 0, 0), atol=0.06 * CELL)
        np.testing.assert_allclose(own.max(axis=0), (left + 2, 1, 0), atol=0.06 * CELL)
    assert charts_of(scraps.astype(np.float32), 1.0, 16) is None


def test_no_more_nodes_than_are_allowed():
    wide = np.concatenate([rectangle((0, 0, k), (30, 0, 0), (0, 20, 0)) for k in range(4)]).astype(np.float32)
    charts = charts_of(wide, 1.0, 4)
    assert charts is not None
    assert MOST * 0.6 < len(charts.origins) <= MOST
    assert charts.cell > CELL


def test_the_back_of_a_wall_has_no_share_in_its_light():
    """A sheet between a lit and a dark side: its chart is of one side."""
    sheet = rectangle((0, 0, 0), (2, 0, 0), (0, 2, 0))
    lamp = inside_out(rectangle((-1, -1, 2), (4, 0, 0), (0, 4, 0)))
    mesh = painted_mesh((sheet, matt(0.0)), (lamp, matt(0.0, 1.0)))
    stage = stage_of(mesh, Scene(sun=None, sky=DARK))
    baked = stage.baked(0)
    at = ((np.array([[1.0, 1.0, 0.0]] * 2) - baked.origin) / baked.unit).astype(np.float32)
    glow, inside = np.empty((2, 3), np.float32), np.empty(2, np.float32)
    normals = np.array([[0, 0, 1], [0, 0, -1]], np.float32)
    look_up(baked.bounces, at, normals, np.zeros(2, np.int32), glow, inside)
    assert glow[0].min() > 0.2
    assert glow[1].max() < 0.03


@pytest.mark.slow
def test_the_same_bytes_where_a_place_is_lit_anew_beside_another_target(monkeypatch):
    """Triangles of the place have other numbers then."""
    monkeypatch.setattr(gathering, "NODE_RAYS", 64)
    monkeypatch.setattr(lightmaps, "CELL", 0.2)
    view = camera(60, 45, 40, 20, 20, 1.6, (1.5, 1.5, 1.0))
    place = room(0.6)
    few, many = (
        mesh_of(box((1, 1, 0), (1.5, 1.5, 0.4)), matt(0.5)),
        mesh_of(np.tile(box((1, 1, 0), (1.5, 1.5, 0.8)), (3, 1, 1))),
    )
    lit, other = (Scene(sun=Sun(azimuth=turn, elevation=40), sky=EVEN) for turn in (-10, 5))
    once = painted(stage_of(few, lit, place), view)
    forget = baking._bake.cache_clear, baking._look.cache_clear
    for f in forget:
        f()
    stage_of(many, other, place).baked(0)
    np.testing.assert_array_equal(painted(stage_of(few, lit, place), view), once)
    assert baking._look.cache_info().misses == 1


def test_floors_of_two_rooms_are_two_charts():
    """The wall between them is thinner than a cell: no node is of both."""
    rooms = [rectangle((left, 0, 0), (2, 0, 0), (0, 2, 0)) for left in (0, 2 + 0.5 * CELL)]
    charts = charts_of(np.concatenate(rooms).astype(np.float32), 1.0, 16)
    assert charts is not None
    np.testing.assert_array_equal(charts.chart, charts.chart[[0, 0, 2, 2]])
    assert charts.chart[0] != charts.chart[2]
    strip = np.concatenate([rectangle((k, 0, 0), (1, 0, 0), (0, 0.5, 0)) for k in (2, 0, 3, 1)])  # in any order
    charts = charts_of(strip.astype(np.float32), 1.0, 16)
    assert charts is not None
    np.testing.assert_array_equal(charts.chart, 0)


def frame(wide: float) -> np.ndarray:
    """Around a hole, 3 m each way, as skirting boards are around a room."""
    ends = np.array([(0, 0), (3, 0), (3, 3), (0, 3)], float)
    inner = np.clip(ends, wide, 3 - wide)
    parts = []
    for k in range(4):
        a, b, c, d = ends[k], ends[(k + 1) % 4], inner[(k + 1) % 4], inner[k]
        parts += [(a, b, c), (a, c, d)]
    flat = np.array(parts)
    return np.concatenate([flat, np.zeros((8, 3, 1))], axis=2).astype(np.float32)


def test_only_nodes_near_a_chart_are_read():
    charts = charts_of(frame(0.06), 1.0, 16)
    assert charts is not None
    np.testing.assert_array_equal(charts.chart, 0)
    at = charts.origins[charts.reached]
    from_border = np.minimum(at[:, :2], 3 - at[:, :2]).min(axis=1)
    assert from_border.min() >= 0
    assert from_border.max() <= 0.06
    assert 0.05 < charts.reached.mean() < 0.3


def test_a_narrow_strip_has_no_chart():
    """Nor one that a wall hides half of; one as narrow of small triangles has none, either, and a wide one has."""
    assert charts_of(frame(0.04), 1.0, 16) is None
    grid = np.concatenate([rectangle((x / 50, y / 50, 0), (0.02, 0, 0), (0, 0.02, 0)) for x in range(50) for y in range(20)])
    wide, strip = charts_of(grid.astype(np.float32), 1.0, 16), charts_of((grid * (3, 0.1, 1)).astype(np.float32), 1.0, 16)
    assert strip is None
    assert wide is not None
    np.testing.assert_array_equal(wide.chart, 0)
