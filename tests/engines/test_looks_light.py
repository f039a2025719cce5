"""What a person would call wrong in a picture: purple skies, dark lines at the horizon, evenings too dark, black faces."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from light_stage import cuboid, flat

from shots import painted, still_shot
from viewsphere.engines import raster
from viewsphere.engines.raster.sky.environment import bake_surrounding, sky_lights
from viewsphere.model.instant import Viewpoint
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import AreaLight, Daylight, Ground, PointLight, Scene, Sky, SpotLight, Sun
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.model.thing import Thing
from viewsphere.rendering.sky.daylight import air, daylight_picture, opening

SPEC = ModelSpec(key="model", source="memory", category="thing", category_id=1)


def picture(
    mesh, scene: Scene, elevation_deg: float = 20, width: int = 160, height: int = 120, distance: float = 4
) -> np.ndarray:
    """From azimuth 30, 40 pixels wide for each metre at the target."""
    focal = 40 * distance
    lens = Intrinsics(width=width, height=height, fx=focal, fy=focal, cx=width / 2, cy=height / 2)
    pose = Viewpoint(index=0, azimuth_deg=30, elevation_deg=elevation_deg, distance=distance)
    shot = still_shot([Thing(id=1, model=SPEC)], lens, [pose], scene=scene)
    return painted(raster.stage(shot, lambda spec, step=None: mesh), shot.camera(0)).astype(float)


@pytest.mark.parametrize("turbidity", [1.8, 2.5, 3, 5, 8, 10])
def test_no_sky_is_purple(turbidity):
    for elevation in (2, 10, 20, 35, 50, 65, 80, 90):
        above = daylight_picture(elevation, Daylight(turbidity=turbidity), 64)[:32]
        assert (above[..., 1] >= np.minimum(above[..., 0], above[..., 2]) * 0.995).all(), elevation


@pytest.mark.parametrize(
    ("turbidity", "clouds"),
    [
        (5, 1),
        *(
            pytest.param(*both, marks=pytest.mark.slow)
            for both in ((2, 0), (3, 0.5), (3, 0), (5, 0), (2, 0.5), (5, 0.5), (2, 1), (3, 1))
        ),
    ],
)
def test_level_ground_is_seen_all_day(turbidity, clouds):
    sky, noon = Daylight(turbidity=turbidity, clouds=clouds), None
    for elevation in (60, 40, 20, 10, 5):
        sun = Sun(elevation=elevation)
        lights = sky_lights(sky, sun, True)
        up = bake_surrounding(sky, sun, np.full(3, 0.2), lights).up.mean()
        up += sum(np.mean(d.irradiance) * d.direction[2] / math.pi for d in lights)
        noon = noon or up
        assert 0.38 < up / noon < 1.1
        assert 1.0 < up < 3.0


def test_lens_opens_for_sun_and_sky_alike_and_not_for_strength():
    for elevation in (70, 30, 6):
        sky, sun = Daylight(turbidity=2.5), Sun(elevation=elevation)
        factor = opening(elevation, sky)
        (light,) = sky_lights(sky, sun, False)
        expected = factor * air(elevation, sky) * sun.strength * np.array(sun.color)
        np.testing.assert_allclose(light.irradiance, expected, rtol=1e-6)
        once, twice = (bake_surrounding(sky.model_copy(update={"strength": s}), None, None).up for s in (1.0, 2.0))
        np.testing.assert_allclose(twice, 2 * once, rtol=1e-5)
        np.testing.assert_allclose(bake_surrounding(sky, sun, None).scale, factor, rtol=1e-6)
    openings = [opening(e, Daylight()) for e in (90, 60, 30, 15, 8, 3, 1)]
    assert openings == sorted(openings)


@pytest.mark.parametrize("sky", [Daylight(), Daylight(clouds=1), Sky()], ids=["clear", "overcast", "gradient"])
@pytest.mark.parametrize("shade", [0.95, 0.5, 0.1])
@pytest.mark.slow
def test_no_dark_line_where_ground_and_sky_meet(sky, shade):
    """Down a column without an object: between the sky's level and the ground's, never darker than both."""
    scene = Scene(sun=Sun(azimuth=30), sky=sky, ground=Ground(pattern="plain", color=(shade, shade, shade)))
    found = picture(flat(cuboid((-0.4, -0.4, -0.2), (0.4, 0.4, 0.2))), scene, 8, 100, 200)[:, :10].mean(axis=(1, 2))
    horizon = int(100 - 160 * math.tan(math.radians(8)))
    above, ground = found[:horizon], found[-30:].mean()
    assert np.ptp(found[-30:]) < 4
    assert found.min() > min(above.min(), ground) - 1.5
    assert np.abs(np.diff(found)).max() < 70  # a horizon of a few rows, not of one


@pytest.mark.parametrize("elevation", [15, 40])
def test_ground_before_the_target_is_itself_however_far_the_camera(elevation):
    """The same ground from 3 m and from 60 m, with lenses that show the target at the same size."""
    box, scene = flat(cuboid((-0.4, -0.4, -0.2), (0.4, 0.4, 0.2))), Scene(ground=Ground(pattern="plain", color=(0.1, 0.1, 0.1)))
    near, far = (picture(box, scene, elevation, 120, 120, d)[-25:] for d in (3, 60))
    assert far.mean() == pytest.approx(near.mean(), abs=1.5)
    assert np.ptp(far.mean(axis=(1, 2))) < 3


def test_missing_normals_are_flat_not_black():
    box = flat(cuboid((-0.6, -0.6, -0.6), (0.6, 0.6, 0.6)))
    scene = Scene(ground=Ground(pattern="plain"))
    expected = picture(box, scene)
    for bad in (np.nan, 0.0):
        normals = box.normals.copy()
        normals[::2] = bad
        found = picture(replace(box, normals=normals), scene)
        assert np.abs(found - expected).max() <= 2, bad


@pytest.mark.parametrize("shade", [0.0, 0.9])
@pytest.mark.parametrize("kind", ["point", "spot", "area"])
@pytest.mark.slow
def test_no_light_gets_out_of_a_closed_box(kind, shade):
    """Nor by the ground, which would throw it back, nor at its foot."""
    box = flat(cuboid((-0.6, -0.6, -0.6), (0.6, 0.6, 0.6)))
    at, down = (0.1, 0.0, 0.0), (0.1, 0.0, -0.6)
    lamp = {
        "point": PointLight(position=at, strength=5, radius=0.02),
        "spot": SpotLight(position=at, toward=down, strength=5, radius=0.02, angle_deg=120),
        "area": AreaLight(position=at, toward=down, strength=5, size=(0.1, 0.1)),
    }[kind]
    dark = Scene(sun=None, sky=Sky(strength=0.1), ground=Ground(pattern="plain", color=(shade, shade, shade)))
    lit = dark.model_copy(update={"lights": (lamp,)})
    more = np.abs(picture(box, lit) - picture(box, dark)).max(axis=2)
    assert more.max() <= 2
