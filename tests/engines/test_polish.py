"""What polished floors and table tops mirror of things near them."""

from __future__ import annotations

import numpy as np
import pytest
from light_stage import flat, quad
from test_bounces import both, room, stage_of
from test_raster import DARK, camera

from viewsphere.assets.mesh import Material
from viewsphere.engines.raster.indirect import irradiance_volumes as volumes
from viewsphere.engines.raster.reflections.glossy_reflections import mirror_in_polish
from viewsphere.engines.raster.shading.painting import paint
from viewsphere.geometry.camera import pixel_rays, project
from viewsphere.model.scene import Scene
from viewsphere.truth.raster.visibility import rasterize

SIGN = Material(base_color=(0.9, 0.1, 0.1, 1.0), unlit=True)
VIEW = camera(96, 72, 55, 0, 22, 1.3, (2.0, 1.4, 0.3))


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    monkeypatch.setattr(volumes, "RAYS", 128)
    monkeypatch.setattr(volumes, "ALONG", 12)
    monkeypatch.setattr(volumes, "CELL", 0.4)


def bounce_scene(roughness: float):
    """A dark room with a floor of this roughness, and an upright red plate above it."""
    floor = flat(quad((0, 0, 0.01), (4, 0, 0), (0, 3, 0)), Material("floor", (0.02, 0.02, 0.02, 1.0), roughness=roughness))
    small = flat(quad((1.4, 2.2, 0.3), (1.2, 0, 0), (0, 0, 0.6)), SIGN)
    return small, both(room(0.0, window=False), floor)


def light(how: str, roughness: float, is_mirrored: bool):
    small, place = bounce_scene(roughness)
    stage = stage_of(small, Scene(sun=None, sky=DARK), place, bounces=how)
    seen, radiance = rasterize(stage.at(0), VIEW), np.zeros((VIEW.width * VIEW.height, 4), np.float32)

    def add(values):
        mirror_in_polish(stage.baked(0), VIEW, seen, values)

    paint(stage.baked(0), VIEW, seen, False, True, radiance, more=add if is_mirrored else None)
    return radiance[:, :3].reshape(VIEW.height, VIEW.width, 3), seen


@pytest.mark.slow
def test_a_floor_mirrors_a_sign_where_its_mirror_image_is_by_fresnel():
    found, seen = light("on", 0.05, True)
    (pixel,), _ = project(VIEW.intrinsics, np.array([[2.0, 2.2, 0.02 - 0.6]]) @ VIEW.R.T + VIEW.t)
    x, y = int(pixel[0]), int(pixel[1])
    ray = pixel_rays(VIEW.intrinsics)[y, x] @ VIEW.R
    cosine = -ray[2] / np.linalg.norm(ray)
    sign = found[np.isin(seen.triangle, (0, 1))].max(axis=0)
    share = 0.04 + 0.96 * (1 - cosine) ** 5
    np.testing.assert_allclose(found[y, x, 0], share * sign[0], rtol=0.15)
    assert found[y, x, 0] > 4 * found[y, x, 2]
    assert found[y, 3, 0] < 0.1 * found[y, x, 0]  # beside the image


@pytest.mark.slow
def test_the_rougher_the_less_sharply():
    pixels = [light("on", rough, True)[0][38:, 44:52, 0] for rough in (0.05, 0.3, 0.45)]  # the mirror image's middle
    steps = [float(np.abs(np.diff(p, axis=0)).max() / p.max()) for p in pixels]
    assert steps[0] > steps[1] > steps[2]


@pytest.mark.slow
def test_matt_floors_and_pictures_without_bounces_stay_as_they_are():
    for how, rough in (("on", 0.6), ("off", 0.1)):
        plain, _ = light(how, rough, False)
        np.testing.assert_array_equal(light(how, rough, True)[0], plain)
    assert (light("on", 0.1, True)[0] != light("on", 0.1, False)[0]).any()


def test_a_camera_below_sees_no_mirror_and_labels_do_not_change():
    small, place = bounce_scene(0.1)
    stage = stage_of(small, Scene(sun=None, sky=DARK), place)
    low = camera(32, 24, 20, 0, -30, 2.0, (2.0, 1.4, 0.4))
    seen = rasterize(stage.at(0), low)
    before = seen.triangle.copy(), seen.inverse_depth.copy()
    radiance = np.zeros((32 * 24, 4), np.float32)
    mirror_in_polish(stage.baked(0), low, seen, radiance)
    assert not radiance.any()
    assert (seen.triangle == before[0]).all() and (seen.inverse_depth == before[1]).all()
