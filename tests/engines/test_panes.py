"""What smooth surfaces that stand upright, or are curved, mirror of still things."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from light_stage import ball
from test_bounces import AWAY, both, inside_out, matt, painted_mesh, stage_of
from test_raster import DARK, box, camera, rectangle

from shots import with_camera
from viewsphere.assets.mesh import Image, Material, Texture
from viewsphere.engines.raster.indirect import irradiance_volumes as volumes
from viewsphere.engines.raster.reflections.glossy_reflections import NOWHERE
from viewsphere.engines.raster.reflections.planar_reflections import mirror_in_panes
from viewsphere.engines.raster.shading.painting import paint
from viewsphere.geometry.camera import pixel_rays
from viewsphere.model.scene import Scene, Sun
from viewsphere.truth.raster.visibility import rasterize

VIEW = camera(96, 72, 50, 180, 5, 2.0, (0.0, 0.0, 0.5))  # on the side of +Y, looks towards -Y
PLATE = -1.0
"""y of the mirror."""

SHOWN = np.s_[20:45, 30:66]
"""Pixels that see the mirror."""


BELOW, ABOVE, BEYOND, TOP = (-3, -3, -3), (0, 4, 4), (0, -3, -3), (3, 4, 4)
"""Corners of the two halves of a room."""


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    monkeypatch.setattr(volumes, "RAYS", 256)
    monkeypatch.setattr(volumes, "ALONG", 10)
    monkeypatch.setattr(volumes, "CELL", 0.5)


def metal(roughness: float = 0.02) -> Material:
    return Material("mirror", (1, 1, 1, 1), roughness=roughness, metallic=1.0)


def mirrored_y(triangles: np.ndarray) -> np.ndarray:
    """The mirror image in the plate, (T, 3, 3), facing as its mirror image does."""
    return (np.asarray(triangles) * (1, -1, 1) + (0, 2 * PLATE, 0))[:, ::-1]


def behind(change=lambda triangles: triangles):
    """What stands behind the camera: bands that shine, and a matt wall with a board before it, which throws a shadow."""
    wall = inside_out(np.array(rectangle((-8, 4.5, -6), (16, 0, 0), (0, 0, 14))))
    board = box((0.3, 3.3, 0.2), (0.9, 3.35, 1.4))
    bands = [inside_out(np.array(rectangle((x, 4.49, -2), (0.4, 0, 0), (0, 0, 5.0)))) for x in (-2.4, -1.2)]
    parts = [(wall, matt(0.6)), (board, matt(0.3)), *((band, matt(0.0, 0.5)) for band in bands)]
    return [(change(np.asarray(triangles)), material) for triangles, material in parts]


def light(parts, scene: Scene, how: str = "on", panes: bool = True):
    """Radiance (H, W, 3) of a place of these parts, with what panes mirror or without."""
    stage = stage_of(AWAY, scene, painted_mesh(*parts), bounces=how)
    seen, radiance = rasterize(stage.at(0), VIEW), np.zeros((VIEW.width * VIEW.height, 4), np.float32)

    def add(values):
        mirror_in_panes(stage.baked(0), VIEW, seen, NOWHERE, values)

    paint(stage.baked(0), VIEW, seen, False, True, radiance, more=add if panes else None)
    return radiance[:, :3].reshape(VIEW.height, VIEW.width, 3)


def sun(azimuth: float = 20.0) -> Sun:
    return Sun(azimuth=azimuth, elevation=35, strength=1.0, angle_deg=0.0)


def plate(roughness: float = 0.02):
    return np.array(rectangle((-1.2, PLATE, -0.4), (2.4, 0, 0), (0, 0, 2))), metal(roughness)


@pytest.mark.slow
def test_a_mirror_shows_what_stands_behind_the_camera_as_a_camera_beyond_the_mirror_sees_it():
    """Bands, a sunlit wall and the shadow on it: as the mirror image of the scene looks where the mirror is taken away."""
    wanted = light(behind(mirrored_y), Scene(sun=sun(160), sky=DARK))[SHOWN]
    found, blurred = (light([plate(), *behind()], Scene(sun=sun(), sky=DARK), panes=how)[SHOWN] for how in (True, False))
    # Shadow, wall and bands.
    assert all(np.mean((low < wanted) & (wanted < high)) > 0.01 for low, high in ((0, 0.1), (0.1, 0.3), (0.45, 0.55)))
    assert np.mean(np.abs(found - wanted).max(axis=2) < 0.02) > 0.97
    assert np.mean(np.abs(blurred - wanted).max(axis=2) < 0.02) < 0.7


@pytest.mark.slow
def test_a_ball_mirrors_the_brighter_half_of_a_room_where_its_mirrored_rays_end():
    """A room that shines twice as brightly on the side of +X, and a ball with smooth normals: closed form, ray by ray."""
    room = np.asarray(box((-3, -3, -3), (3, 4, 4)))
    halves = [(np.clip(room, low, high), matt(0.0, shine)) for low, high, shine in ((BELOW, ABOVE, 0.3), (BEYOND, TOP, 0.6))]
    halves = [(t[(t[..., 0] != 0).any(axis=1)], material) for t, material in halves]  # no wall between them
    globe = replace(ball(0.6, (0, 0, 0.5), 48), materials=(metal(),))
    stage = stage_of(AWAY, Scene(sun=None, sky=DARK), both(painted_mesh(*((inside_out(t), m) for t, m in halves)), globe))
    seen, found = rasterize(stage.at(0), VIEW), np.zeros((VIEW.width * VIEW.height, 4), np.float32)
    baked = stage.baked(0)
    paint(baked, VIEW, seen, False, True, found, more=lambda light: mirror_in_panes(baked, VIEW, seen, NOWHERE, light))
    rays = pixel_rays(VIEW.intrinsics).reshape(-1, 3) @ VIEW.R
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    middle = np.array((0, 0, 0.5)) - VIEW.center
    along = rays @ middle
    inside = along**2 - middle @ middle + 0.55**2
    at = np.flatnonzero(inside > 0)  # of a ball a little smaller, whose rim is no matter
    far = along[at] - np.sqrt(along[at] ** 2 - middle @ middle + 0.6**2)
    place = VIEW.center + far[:, None] * rays[at]
    normal = (place - (0, 0, 0.5)) / 0.6
    ray = rays[at] - 2 * (rays[at] * normal).sum(axis=1, keepdims=True) * normal
    steps = np.where(ray > 0, np.array((3, 4, 4)) - place, np.array((-3, -3, -3)) - place) / np.where(ray == 0, 1e-9, ray)
    end = place[:, 0] + ray[:, 0] * steps.min(axis=1)
    clear = np.abs(end) > 0.1
    wanted = np.where(end > 0, 0.6, 0.3)[clear]
    assert 0.2 < (wanted > 0.5).mean() < 0.8
    assert np.mean(np.abs(found[at[clear], 0] - wanted) < 0.03) > 0.99


@pytest.mark.parametrize(
    ("how", "roughness"), [*(pytest.param("on", rough, marks=pytest.mark.slow) for rough in (0.2, 0.5)), ("off", 0.02)]
)
def test_what_is_rough_and_what_nothing_bounces_off_stays_as_it_was(how, roughness):
    parts = [plate(roughness), *behind()]
    plain = light(parts, Scene(sun=sun(), sky=DARK), how, panes=False)
    np.testing.assert_array_equal(light(parts, Scene(sun=sun(), sky=DARK), how), plain)


@pytest.mark.slow
def test_between_smooth_and_rough_less_and_less_of_the_ray_counts():
    scene = Scene(sun=sun(), sky=DARK)
    changes = []
    for roughness in (0.1, 0.13, 0.17):
        parts = [plate(roughness), *behind()]
        changes.append(np.abs(light(parts, scene) - light(parts, scene, panes=False)).mean())
    assert changes[0] > 1.3 * changes[1] > 1.3 * 1.3 * changes[2] > 0


@pytest.mark.slow
def test_a_picture_is_the_same_beside_passes_of_its_light():
    """And a picture of the stage has what panes mirror."""
    stage = stage_of(AWAY, Scene(sun=sun(), sky=DARK), painted_mesh(plate(), *behind()))
    own = stage.for_shot(with_camera(stage.shot, VIEW))
    seen = rasterize(own.at(0), VIEW)
    alone, beside = (own.paint(0, 0, seen, names)["rgb"].astype(int) for names in (("rgb",), ("rgb", "albedo", "residual")))
    assert np.abs(alone - beside).max() <= 1
    assert alone[SHOWN].std() > 20


@pytest.mark.slow
def test_a_target_in_a_place_and_what_is_unlit_stay_as_they_were():
    mirror = plate()
    unlit = replace(metal(), unlit=True)
    for parts, target in ((behind(), painted_mesh(mirror)), ([(mirror[0], unlit), *behind()], AWAY)):
        stage = stage_of(target, Scene(sun=sun(), sky=DARK), painted_mesh(*parts))
        seen, pictures = rasterize(stage.at(0), VIEW), []
        for more in (None, lambda light, stage=stage, seen=seen: mirror_in_panes(stage.baked(0), VIEW, seen, NOWHERE, light)):
            radiance = np.zeros((VIEW.width * VIEW.height, 4), np.float32)
            paint(stage.baked(0), VIEW, seen, False, True, radiance, more=more)
            pictures.append(radiance)
        np.testing.assert_allclose(*pictures, atol=1e-6)


@pytest.mark.slow
def test_through_a_blended_sheet_a_mirror_shows_what_is_behind_it():
    """A black sheet of opacity 0.25 before the wall takes a quarter of its light."""
    sheet = rectangle((-8, 4.3, -6), (16, 0, 0), (0, 0, 14))
    film = Material("film", (0, 0, 0, 0.25), roughness=1.0, specular=0.0, metallic=0.0, alpha_mode="BLEND")
    wall = np.array(rectangle((-8, 4.5, -6), (16, 0, 0), (0, 0, 14))), matt(0.0, 0.5)
    found = light([plate(), wall, (np.array(sheet), film)], Scene(sun=None, sky=DARK))[SHOWN]
    np.testing.assert_allclose(found, 0.375, rtol=0.03)


@pytest.mark.slow
def test_what_is_far_from_a_mirror_is_as_blurred_as_its_pixels_are_wide():
    """A wall of checks that are less than half as wide as a pixel is there, lit evenly: grey."""
    fine = np.indices((256, 256)).sum(axis=0, keepdims=True).repeat(4, axis=0) % 2 * 255
    image = Image("checks", np.ascontiguousarray(np.moveaxis(fine, 0, 2), np.uint8) | np.array((0, 0, 0, 255), np.uint8))
    checks = Material("checks", (1, 1, 1, 1), roughness=1.0, specular=0.0, metallic=0.0, base_color_texture=Texture(0))
    wall = np.array(rectangle((-8, 4.5, -8), (16, 0, 0), (0, 0, 16)))
    place = painted_mesh(plate(), (wall, checks))
    uv = np.float32(place.vertices[:, [0, 2]] / 16)  # 6 cm a check
    stage = stage_of(AWAY, Scene(sun=sun(), sky=DARK), replace(place, uv0=uv, images=(image,)))
    seen, found = rasterize(stage.at(0), VIEW), np.zeros((VIEW.width * VIEW.height, 4), np.float32)
    baked = stage.baked(0)
    paint(baked, VIEW, seen, False, True, found, more=lambda light: mirror_in_panes(baked, VIEW, seen, NOWHERE, light))
    shown = found[:, 0].reshape(VIEW.height, VIEW.width)[SHOWN]
    assert shown.std() < 0.1 * shown.mean()
