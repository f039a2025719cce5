"""What smooth surfaces that stand upright, or are curved, mirror of still things."""

from __future__ import annotations

import numpy as np
import pytest
from light_stage import ball
from test_bounces import AWAY, inside_out, matt, painted_mesh, stage_of
from test_raster import DARK, box, camera, rectangle

from viewsphere.assets.mesh import Material
from viewsphere.engines.raster import volumes
from viewsphere.engines.raster.painting import paint
from viewsphere.engines.raster.panes import mirror_in_panes
from viewsphere.model.scene import Scene, Sun
from viewsphere.truth.visibility import rasterize

VIEW = camera(96, 72, 50, 180, 5, 2.0, (0.0, 0.0, 0.5))  # on the side of +Y, looks towards -Y
PLATE = -1.0
"""y of the mirror."""

SHOWN = np.s_[20:45, 30:66]
"""Pixels that see the mirror."""


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
        mirror_in_panes(stage.baked(0), VIEW, seen, values)

    paint(stage.baked(0), VIEW, seen, False, True, radiance, more=add if panes else None)
    return radiance[:, :3].reshape(VIEW.height, VIEW.width, 3)


def sun(azimuth: float = 20.0) -> Sun:
    return Sun(azimuth_deg=azimuth, elevation_deg=35, strength=1.0, angle_deg=0.0)


def plate(roughness: float = 0.02):
    return np.array(rectangle((-1.2, PLATE, -0.4), (2.4, 0, 0), (0, 0, 2))), metal(roughness)


def test_a_mirror_shows_what_stands_behind_the_camera_as_a_camera_beyond_the_mirror_sees_it():
    """Bands, a sunlit wall and the shadow on it: as the mirror image of the scene looks where the mirror is taken away."""
    wanted = light(behind(mirrored_y), Scene(sun=sun(160), sky=DARK))[SHOWN]
    found, blurred = (light([plate(), *behind()], Scene(sun=sun(), sky=DARK), panes=how)[SHOWN] for how in (True, False))
    # Shadow, wall and bands.
    assert [np.mean((low < wanted) & (wanted < high)) > 0.01 for low, high in ((0, 0.1), (0.1, 0.3), (0.45, 0.55))] == [
        True
    ] * 3
    assert np.mean(np.abs(found - wanted).max(axis=2) < 0.02) > 0.97
    assert np.mean(np.abs(blurred - wanted).max(axis=2) < 0.02) < 0.7


def test_a_ball_in_an_evenly_shining_box_cannot_be_seen():
    shell = inside_out(np.asarray(box((-3, -3, -3), (3, 4, 4)))), matt(0.0, 0.7)
    globe = ball(0.6, (0, 0, 0.5))
    round_ = globe.vertices[globe.triangles]
    flat = light([shell, (round_, metal())], Scene(sun=None, sky=DARK))
    np.testing.assert_allclose(flat, 0.7, rtol=0.02)


@pytest.mark.parametrize(("how", "roughness"), [("on", 0.2), ("on", 0.5), ("off", 0.02)])
def test_what_is_rough_and_what_nothing_bounces_off_stays_as_it_was(how, roughness):
    parts = [plate(roughness), *behind()]
    plain = light(parts, Scene(sun=sun(), sky=DARK), how, panes=False)
    np.testing.assert_array_equal(light(parts, Scene(sun=sun(), sky=DARK), how), plain)


def test_between_smooth_and_rough_less_and_less_of_the_ray_counts():
    scene = Scene(sun=sun(), sky=DARK)
    changes = []
    for roughness in (0.1, 0.13, 0.17):
        parts = [plate(roughness), *behind()]
        changes.append(np.abs(light(parts, scene) - light(parts, scene, panes=False)).mean())
    assert changes[0] > 1.3 * changes[1] > 1.3 * 1.3 * changes[2] > 0
