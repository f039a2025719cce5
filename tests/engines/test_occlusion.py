"""Ambient occlusion against Embree's cosine-weighted rays, and where it is known."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from light_stage import LightStage, Samples, ball, cuboid, distances, flat, points, quad

import viewsphere_zoo as zoo
from quick import quick
from viewsphere.engines.raster.materials.kernels_material import L_CASTS_FROM
from viewsphere.engines.raster.shadows import occlusion
from viewsphere.engines.raster.shadows.occlusion import NO_OCCLUSION, bake_occlusion, sky_directions, with_ground_light
from viewsphere.geometry.camera import orbit_center, orbit_rotation
from viewsphere.model.sensors.camera import Camera, Intrinsics
from viewsphere.rendering import kept_light
from viewsphere.rendering.sky.sun import Distant


def camera(azimuth, elevation, distance, target):
    a, e = math.radians(azimuth), math.radians(elevation)
    rotation = orbit_rotation(a, e)
    lens = Intrinsics(width=160, height=120, fx=170, fy=170, cx=80, cy=60)
    return Camera(lens, rotation, -rotation @ (np.asarray(target) + orbit_center(a, e, distance)))


def open_share(stage, s: Samples, upper: bool, count: int = 128):
    """Share of the cosine-weighted directions (above the horizon alone, if `upper`) that meet nothing; how many there were."""
    rng = np.random.default_rng(0)
    u, phi = rng.random((2, len(s.place), count)) * [[[1.0]], [[2 * np.pi]]]
    right = np.cross(s.smooth, np.where(np.abs(s.smooth[:, 2:]) < 0.9, [[0, 0, 1.0]], [[1.0, 0, 0]]))
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    up = np.cross(s.smooth, right)
    r = np.sqrt(u)
    toward = np.sqrt(1 - u)[..., None] * s.smooth[:, None]
    toward = toward + (r * np.cos(phi))[..., None] * right[:, None] + (r * np.sin(phi))[..., None] * up[:, None]
    start = np.repeat((s.place + s.normal * 2e-4)[:, None], count, axis=1)
    is_open = np.isinf(distances(stage.rays(), start.reshape(-1, 3), toward.reshape(-1, 3))).reshape(len(s.place), count)
    counts = (toward * s.normal[:, None]).sum(axis=2) > 0
    if upper:
        counts &= toward[..., 2] > 0
    return (is_open & counts).sum(axis=1) / np.maximum(counts.sum(axis=1), 1), counts.sum(axis=1)


def some(s: Samples, which) -> Samples:
    return Samples(s.place[which], s.smooth[which], s.normal[which], s.pixel[which], s.is_ground[which])


@pytest.mark.slow
@pytest.mark.parametrize("quality", ["fast", "fine"])
@pytest.mark.parametrize("ground", [True, False])
def test_a_car_against_rays(quality, ground):
    pytest.importorskip("embreex")
    stage = LightStage(zoo.build("car", np.random.default_rng(3)), ground=ground)
    s = stage.seen(camera(35, 20, 7.0, stage.origin))
    s = some(s, np.random.default_rng(1).permutation(np.nonzero(~s.is_ground)[0])[:1500])
    found = stage.occlusion(bake_occlusion(stage.casters, ground, quality), s)
    truth, count = open_share(stage, s, upper=ground)
    sure = count > 25
    assert np.abs(found[sure, 0] - truth[sure]).mean() < 0.06
    assert np.corrcoef(found[sure, 0], truth[sure])[0, 1] > 0.65


@pytest.mark.slow
def test_the_ground_beside_a_car_against_rays():
    pytest.importorskip("embreex")
    stage = LightStage(zoo.build("car", np.random.default_rng(3)))
    x, y = np.meshgrid(np.linspace(-2.2, 2.2, 30), np.linspace(-4, 4, 30))
    s = points(np.stack([x.ravel(), y.ravel(), np.zeros(900)], axis=1), (0, 0, 1), is_ground=True)
    found = stage.occlusion(bake_occlusion(stage.casters, True, "fine"), s)[:, 0]
    truth, _ = open_share(stage, s, upper=True)
    assert np.abs(found - truth).mean() < 0.06
    assert found.min() < 0.25
    assert found.max() > 0.9


@pytest.mark.parametrize("ground", quick([True, False], True))
def test_a_corner_and_under_a_table_against_rays(ground):
    pytest.importorskip("embreex")
    walls = [cuboid((-1, -1, 0), (1, 1, 0.1)), cuboid((-1.1, -1, 0), (-1, 1, 2)), cuboid((-1, -1.1, 0), (1, -1, 2))]
    table = [cuboid((0.0, 0.0, 0.7), (0.8, 0.8, 0.75)), cuboid((0.05, 0.05, 0.1), (0.1, 0.1, 0.7))]
    stage = LightStage(flat(np.concatenate(walls + table)), ground=ground)
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(-0.95, 0.75, 18), np.linspace(-0.95, 0.75, 18)))
    floor = points(np.stack([x, y, np.full_like(x, 0.1)], axis=1), (0, 0, 1))
    wall = points(np.stack([np.full_like(x, -1.0), x, 1.2 + y], axis=1), (1, 0, 0))
    below = points(np.stack([x[x > 0.05], np.full((x > 0.05).sum(), 0.4), np.full((x > 0.05).sum(), 0.7)], axis=1), (0, 0, -1))
    baked = bake_occlusion(stage.casters, ground, "fine")
    for s in (floor, wall) if ground else (floor, wall, below):
        found = stage.occlusion(baked, s)[:, 0]
        truth, _ = open_share(stage, s, upper=ground)
        assert np.abs(found - truth).mean() < 0.065
        assert np.ptp(truth) > 0.15


@pytest.mark.parametrize("quality", ["fast", "fine"])
@pytest.mark.parametrize("tilt", [0.0, 33.0, 90.0])
@pytest.mark.slow
def test_an_open_plane_and_a_ball_are_open(quality, tilt):
    c, d = math.cos(math.radians(tilt)), math.sin(math.radians(tilt))
    plane = LightStage(flat(quad((-1, -c, -d), (2, 0, 0), (0, 2 * c, 2 * d))), ground=False)
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(-0.9, 0.9, 40), np.linspace(-0.9, 0.9, 40)))
    s = points(np.stack([x, y * c, y * d], axis=1), (0, -d, c))
    found = plane.occlusion(bake_occlusion(plane.casters, False, quality), s)[:, 0]
    assert found.min() > 0.95
    if tilt == 0:
        stage = LightStage(ball(1.0, (0, 0, 0)), ground=False)
        s = stage.seen(camera(20, 30, 4.0, (0, 0, 0)))
        assert stage.occlusion(bake_occlusion(stage.casters, False, quality), s)[:, 0].min() > 0.93


def test_it_is_smooth_on_two_large_triangles():
    """Across a floor of two triangles beside a wall: no step larger than the slope of the light asks for."""
    stage = LightStage(
        flat(np.concatenate([quad((-2, -2, 0), (4, 0, 0), (0, 4, 0)), cuboid((-2, -2, 0), (-1.9, 2, 1.2))])), ground=False
    )
    baked = bake_occlusion(stage.casters, False, "fine")
    along = np.arange(-1.85, 1.8, 0.005)
    for y in (-0.7, 0.0, 0.31):
        found = stage.occlusion(baked, points(np.stack([along, np.full_like(along, y), 0 * along], axis=1), (0, 0, 1)))[:, 0]
        assert np.abs(np.diff(found)).max() < 0.015
        smooth = np.convolve(found, np.ones(81) / 81, mode="valid")
        assert np.abs(found[40:-40] - smooth)[60:].max() < 0.03
        assert found[:10].mean() < 0.65
        assert found[-10:].mean() > 0.93
    across = np.arange(-1.0, 1.0, 0.005)
    found = stage.occlusion(baked, points(np.stack([np.full_like(across, -1.2), across, 0 * across], axis=1), (0, 0, 1)))[:, 0]
    assert np.ptp(found) < 0.08


def test_nothing_is_hidden_far_away_or_when_it_is_off():
    stage = LightStage(flat(cuboid((-1, -1, 0), (1, 1, 1))))
    baked = bake_occlusion(stage.casters, True, "fine")
    far = points([[30, 0, 0], [0, -200, 0]], (0, 0, 1), is_ground=True)
    np.testing.assert_array_equal(stage.occlusion(baked, far)[:, :2], 1)
    beside = points([[1, 0, 0.02], [0, 0, 1.0]], (1, 0, 0))
    assert bake_occlusion(stage.casters, True, "off") is NO_OCCLUSION
    np.testing.assert_array_equal(stage.occlusion(NO_OCCLUSION, beside)[:, :2], 1)


@pytest.mark.slow
def test_a_box_keeps_light_from_the_ground_and_from_what_it_lights():
    """Under an overhead sun nothing but the sky is lost beside a box; under a low one its shadow sends up less light."""
    stage = LightStage(flat(cuboid((-0.5, -0.5, 0), (0.5, 0.5, 1))))
    baked = bake_occlusion(stage.casters, True, "fine")
    foot = points([[-0.501, 0.0, 0.05]], (-1, 0, 0))
    before = stage.occlusion(baked, foot)[0, 1]  # of the sky's light alone
    dark = with_ground_light(baked, stage.lights([Distant((1, 0, 1), (9, 9, 9), 0.5)]), 0.1)
    bright = with_ground_light(baked, stage.lights([Distant((-1, 0, 1), (9, 9, 9), 0.5)]), 0.1)
    lit = stage.occlusion(bright, foot)[0, 1]
    assert lit > max(0.7, 1.3 * before)
    assert stage.occlusion(dark, foot)[0, 1] < 0.75 * lit
    nothing = with_ground_light(baked, stage.lights(), 0.0)
    assert np.isfinite(nothing.floor).all()


def test_the_same_targets_are_baked_once():
    stage = LightStage(flat(cuboid((-0.5, -0.5, 0), (0.5, 0.5, 1))))
    casters = replace(stage.casters, targets=("box",))
    first = bake_occlusion(casters, True, "fast")
    assert bake_occlusion(replace(casters), True, "fast") is first
    assert bake_occlusion(replace(casters, targets=("other",)), True, "fast") is not first


def test_flat_and_empty_targets():
    flat_one = LightStage(flat(quad((-1, -1, 0), (2, 0, 0), (0, 2, 0))))
    assert np.isfinite(flat_one.occlusion(bake_occlusion(flat_one.casters, True, "fine"), points([[0, 0, 0]], (0, 0, 1)))).all()


def test_directions_share_the_sphere():
    d = sky_directions(24).astype(float)
    np.testing.assert_allclose(np.linalg.norm(d, axis=1), 1, atol=1e-6)
    np.testing.assert_allclose(d.T @ d / len(d), np.eye(3) / 3, atol=0.01)
    np.testing.assert_allclose(d[:24, 2].mean(), 0.5, atol=1e-3)


def test_points_that_surfaces_read_are_the_same_in_blocks_and_at_once(monkeypatch):
    rng = np.random.default_rng(0)
    vertices = np.zeros((600, 16), np.float32)
    vertices[:, 11:14], vertices[:, :3] = rng.random((600, 3)), rng.normal(size=(600, 3))
    near = rng.integers(0, 597, 300)
    triangles = np.column_stack([near, near + 1, near + 2]).astype(np.uint32)
    casters = SimpleNamespace(
        surfaces=SimpleNamespace(vertices=vertices, triangles=triangles), extent=SimpleNamespace(triangles=len(triangles))
    )
    at_once = occlusion._read_points(casters, np.zeros(3), 3.0, np.array([10, 10, 10]))
    monkeypatch.setattr(occlusion, "_SIDES", 7)
    monkeypatch.setattr(occlusion, "_MOST_MARKED", 5)
    in_blocks = occlusion._read_points(casters, np.zeros(3), 3.0, np.array([10, 10, 10]))
    assert np.array_equal(in_blocks, at_once)
    assert 0 < at_once.sum() < at_once.size


@pytest.fixture
def bakes(monkeypatch, tmp_path):
    """Counts the calls of `hidden_by`, with a cache of the test's own."""
    monkeypatch.setenv("VIEWSPHERE_CACHE", str(tmp_path))
    monkeypatch.setattr(occlusion, "kept_light", kept_light.kept_light)
    hidden_by, made = occlusion.hidden_by, []
    monkeypatch.setattr(occlusion, "hidden_by", lambda *args: made.append(1) or hidden_by(*args))
    return made


@pytest.mark.slow
def test_the_occlusion_of_a_target_alone_is_kept_for_other_runs(bakes):
    stage = LightStage(flat(cuboid((-0.5, -0.5, 0), (0.5, 0.5, 1))))
    first, again = (bake_occlusion(stage.casters, True, "fast", is_alone=True) for _ in range(2))
    assert len(bakes) == 1
    for kept, made in zip(again, bake_occlusion(stage.casters, True, "fast"), strict=True):
        np.testing.assert_array_equal(kept, made)
    assert first.volume.dtype == again.volume.dtype
    del bakes[:]
    for other in (False, True):
        bake_occlusion(stage.casters, other, "fine", is_alone=True)
    taller = LightStage(flat(cuboid((-0.5, -0.5, 0), (0.5, 0.5, 1.1))))
    bake_occlusion(taller.casters, True, "fast", is_alone=True)
    assert len(bakes) == 3


def test_cut_out_surfaces_are_baked_in_each_run(bakes):
    """The pixels of a texture decide what they hide."""
    stage = LightStage(flat(cuboid((-0.5, -0.5, 0), (0.5, 0.5, 1))))
    stage.casters.surfaces.looks[:, L_CASTS_FROM] = 0.5
    for _ in range(2):
        bake_occlusion(stage.casters, True, "fast", is_alone=True)
    assert len(bakes) == 2
