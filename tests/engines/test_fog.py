"""Fog on the raster engine: Koschmieder's law at known ranges, also behind glass and at outlines, and of ground fog."""

from __future__ import annotations

import math

import numpy as np
import pytest
from light_stage import flat, quad
from test_physics import camera, stage_of

from viewsphere.assets.mesh import Material
from viewsphere.engines.raster.shading.painting import paint
from viewsphere.engines.shared.blender.backdrop import veil
from viewsphere.geometry.camera import pixel_rays
from viewsphere.model.scene import Ground, Scene, Sky, Sun
from viewsphere.model.weather import CONTRAST, Fog
from viewsphere.rendering.view import EXPOSURE
from viewsphere.rendering.weather.conditions import METERED, clouded, floor_light, in_fog
from viewsphere.rendering.weather.fog import Air
from viewsphere.truth.raster.visibility import rasterize

COLOR = np.array([0.8, 0.5, 0.3])
AIR = (0.6, 0.7, 0.9)
THICK = Fog(visibility=20.0, color=AIR)
VIEW = camera(16, 16, 9, 0, 90, 7)  # from 7 m above the origin straight down
UNLIT = Material(base_color=(*COLOR, 1.0), unlit=True)


def light(meshes, fog, view=VIEW, has_sky=True, antialias=True, ground=None, is_outdoors=False):
    """What a camera sees (H * W, 4), and its visibility."""
    stage = stage_of(meshes, Scene(sun=None, ground=ground))
    seen, radiance = rasterize(stage.at(0), view), np.empty((view.width * view.height, 4), np.float32)
    paint(stage.baked(0), view, seen, antialias, has_sky, radiance, fog=fog, is_outdoors=is_outdoors)
    return radiance, seen


def ranges(view, seen):
    length = np.linalg.norm(pixel_rays(view.intrinsics), axis=-1)
    return np.where(seen.inverse_depth > 0, length / np.maximum(seen.inverse_depth, 1e-9), np.inf).ravel()


def test_a_plate_at_a_known_range_is_veiled_as_koschmieder_says():
    plate = flat(quad((-9, -9, 0), (18, 0, 0), (0, 18, 0)), UNLIT)
    found, seen = light([plate], THICK)
    through = np.exp(-CONTRAST / 20 * ranges(VIEW, seen))[:, None]
    assert 7 <= ranges(VIEW, seen).min() < 7.1 and ranges(VIEW, seen).max() > 10
    np.testing.assert_allclose(found[:, :3], COLOR / EXPOSURE * through + AIR * (1 - through), rtol=2e-5)


def test_at_the_visibility_two_percent_of_the_contrast_are_left():
    air = Air.for_camera(THICK, VIEW, np.array([[0.0, 0.0, 1.0]]))
    assert math.exp(-float(air.depth(np.array([1 / 20], np.float32))[0])) == pytest.approx(0.02, rel=1e-3)


def test_the_sky_is_the_air_s_light():
    found, _ = light([flat(quad((-1, -1, 0), (1, 0, 0), (0, 1, 0)), UNLIT)], THICK, camera(16, 16, 60, 0, -40, 9))
    np.testing.assert_allclose(found[0], [*AIR, 1], rtol=1e-5)


def test_an_outline_is_the_mean_of_what_its_samples_see():
    """A near and a far plate: a pixel on the edge lies between both, and never beyond."""
    near = flat(quad((-9, -9, 5), (9.03, 0, 0), (0, 18, 0)), UNLIT)
    far = flat(quad((-90, -90, -20), (180, 0, 0), (0, 180, 0)), UNLIT)
    smooth, _ = light([near, far], THICK)
    sharp, _ = light([near, far], THICK, antialias=False)
    rows = sharp[:, 0].reshape(16, 16)
    mixed = (np.abs(smooth - sharp) > 1e-4).any(axis=1).reshape(16, 16)
    assert mixed.any() and mixed.sum() <= 2 * 16
    left, right = rows[:, 2], rows[:, 13]
    edge = smooth[:, 0].reshape(16, 16)[mixed]
    assert (edge > min(left.min(), right.min()) - 1e-3).all() and (edge < max(left.max(), right.max()) + 1e-3).all()


def test_what_is_behind_glass_is_veiled_by_all_the_air_before_it():
    """A veil of half of its own colour 1 m away, before a plate 7 m away: each is seen through its own air."""
    veil = Material(base_color=(0.1, 0.2, 0.6, 0.5), alpha_mode="BLEND", unlit=True)
    pane, plate = (
        flat(quad((-9, -9, 6), (18, 0, 0), (0, 18, 0)), veil),
        flat(quad((-19, -19, 0), (38, 0, 0), (0, 38, 0)), UNLIT),
    )
    found, _ = light([plate, pane], THICK)
    clear, _ = light([plate, pane], None)
    middle = 8 * 16 + 8
    t1, t7 = (math.exp(-CONTRAST / 20 * metres) for metres in (1.0, 7.0))
    own = np.array([0.1, 0.2, 0.6]) / EXPOSURE
    np.testing.assert_allclose(clear[middle, :3], 0.5 * own + 0.5 * COLOR / EXPOSURE, rtol=0.01)
    air = np.array(AIR)
    expected = 0.5 * (own * t1 + air * (1 - t1)) + 0.5 * (COLOR / EXPOSURE * t7 + air * (1 - t7))
    np.testing.assert_allclose(found[middle, :3], expected, rtol=0.01)


def test_from_a_room_only_what_is_outdoors_is_seen_in_fog():
    """A wall is as it is; ground is veiled by the air from the camera on, behind a pane by that from the pane on."""
    film = Material(base_color=(0.1, 0.2, 0.6, 0.5), alpha_mode="BLEND", unlit=True)
    stone = flat(quad((0, 0, 0), (0.01, 0, 0), (0, 0.01, 0)), UNLIT)
    wall, pane = flat(quad((-9, -9, 5), (9, 0, 0), (0, 18, 0)), UNLIT), flat(quad((0.5, 0, 6), (9, 0, 0), (0, 9, 0)), film)
    more = {"ground": Ground(pattern="plain"), "antialias": False}
    clear, seen = light([stone, wall], None, **more)
    plain, _ = light([stone, wall], THICK, is_outdoors=True, **more)
    away = ranges(VIEW, seen)
    is_ground = seen.triangle.ravel() >= 4
    assert 100 < is_ground.sum() < 200
    through = np.exp(-CONTRAST / 20 * away)[:, None]
    expected = clear[:, :3] * through + AIR * (1 - through)
    np.testing.assert_allclose(plain[is_ground, :3], expected[is_ground], rtol=1e-4)
    np.testing.assert_array_equal(plain[~is_ground], clear[~is_ground])
    clear, _ = light([stone, wall, pane], None, **more)
    paned, found = light([stone, wall, pane], THICK, is_outdoors=True, **more)
    is_pane = (found.triangle.ravel() >= 4) & (found.triangle.ravel() < 6)
    assert is_pane.sum() > 30
    bare = 2 * clear[is_pane, :3] - np.array([0.1, 0.2, 0.6]) / EXPOSURE  # of the ground behind
    through = np.exp(-CONTRAST / 20 * (away - ranges(VIEW, found)))[is_pane, None]
    lost = 0.5 * (1 - through) * (AIR - bare)
    np.testing.assert_allclose(paned[is_pane, :3], clear[is_pane, :3] + lost, rtol=2e-3)


def test_blender_s_pictures_of_a_room_are_veiled_where_they_show_the_ground():
    stone, wall = (
        flat(quad(corner, (size, 0, 0), (0, 18, 0)), UNLIT) for corner, size in (((0, -9, 0), 0.01), ((-9, -9, 5), 9))
    )
    geometry = stage_of([stone, wall], Scene(sun=None, ground=Ground())).at(0)
    seen, picture = rasterize(geometry, VIEW), np.ones((16, 16, 4), np.float32)
    veil(picture, THICK, VIEW, geometry, is_outdoors=True)
    through = np.exp(-CONTRAST / 20 * ranges(VIEW, seen)).reshape(16, 16)[..., None]
    ground = seen.triangle >= geometry.triangle_start[-1]
    inner = ground & np.roll(ground, 1, axis=1) & np.roll(ground, -1, axis=1)
    assert inner.sum() > 80
    np.testing.assert_allclose(picture[inner, :3], (through + np.array(AIR) * (1 - through))[inner], rtol=5e-3)
    assert (picture[~ground & ~np.roll(ground, -1, axis=1)] == 1).all()


def test_without_a_background_the_air_covers_what_is_there():
    plate = flat(quad((-1, -1, 0), (2, 0, 0), (0, 2, 0)), UNLIT)
    found, seen = light([plate], THICK, has_sky=False, antialias=False)
    is_there = (seen.triangle >= 0).ravel()
    assert is_there.any() and not is_there.all()
    assert (found[~is_there] == 0).all() and (found[is_there, 3] == 1).all()


@pytest.mark.parametrize("elevation", [-60.0, -5.0, 0.0, 0.001, 10.0, 80.0])
@pytest.mark.parametrize("away", [3.0, 40.0, 900.0])
def test_ground_fog_is_the_integral_of_its_density(elevation, away):
    fog, eye, e = Fog(visibility=60, height=5.0), 2.0, math.radians(elevation)
    view = camera(8, 8, 40, 0, 0, eye)
    view = type(view)(view.intrinsics, np.eye(3)[[0, 2, 1]] * [[1], [-1], [1]], np.array([0, eye, 0.0]))
    assert view.center[2] == pytest.approx(eye)
    ray = np.array([[0.0, -math.sin(e), math.cos(e)]])
    found = float(Air.for_camera(fog, view, ray).depth(np.array([1 / away], np.float32))[0])
    s = np.linspace(0, away, 200_001)
    density = fog.extinction * np.exp(-(eye + s * math.sin(e)) / 5.0)
    assert found == pytest.approx(min(float(np.trapezoid(density, s)), 80.0), rel=1e-4)


def test_above_ground_fog_the_sky_is_seen():
    found = float(
        Air.for_camera(Fog(visibility=60, height=5.0), VIEW, np.array([[0, 0, -1.0]])).depth(np.zeros(1, np.float32))[0]
    )
    assert found == pytest.approx(CONTRAST / 60 * 5 * math.exp(-7 / 5), rel=1e-5)


@pytest.mark.parametrize("visibility", [20.0, 80.0, 2000.0])
def test_sun_and_sky_in_fog_light_a_floor_as_the_fog_glows(visibility):
    sun, sky, _, glow = in_fog(Sun(), Sky(), Fog(visibility=visibility))
    assert isinstance(sky, Sky) and sky.zenith == sky.horizon
    np.testing.assert_allclose(floor_light(sun, sky), glow, rtol=2e-3)
    assert (sun.strength if sun else 0) < 0.95 * Sun().strength
    assert float(glow.mean()) <= max(METERED, float(floor_light(Sun(), Sky()).mean())) * 1.01


def test_clouds_hide_the_sun_and_dim_the_floor():
    sun, sky = clouded(Sun(), Sky(), 1.0)
    assert sun is None
    assert float(floor_light(None, sky).mean()) == pytest.approx(0.4 * float(floor_light(Sun(), Sky()).mean()), rel=0.1)
    assert clouded(Sun(), Sky(), 0.0) == (Sun(), Sky())
