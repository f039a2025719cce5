"""Light that is gathered from each pixel (`bounces: fine`): what is near, and the lobes of rough mirrors."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from light_stage import ball
from test_bounces import AWAY, EVEN, both, matt, painted_mesh, stage_of
from test_panes import PLATE, behind, metal, plate
from test_raster import DARK, box, camera, rectangle

from viewsphere.assets.mesh import Material
from viewsphere.engines.raster.indirect import bounces
from viewsphere.engines.raster.indirect import irradiance_volumes as volumes
from viewsphere.engines.raster.indirect.gathering.near_field_gather import with_near
from viewsphere.engines.raster.reflections import kernels_mirror
from viewsphere.engines.raster.reflections import planar_reflections as panes
from viewsphere.engines.raster.reflections.glossy_reflections import NOWHERE
from viewsphere.engines.raster.reflections.planar_reflections import lobe_rays, mirror_in_panes
from viewsphere.engines.raster.shading.painting import paint, view_of
from viewsphere.geometry.camera import pixel_rays
from viewsphere.model.scene import Ground, Scene, Sun
from viewsphere.model.sensors.camera import Camera
from viewsphere.truth.raster.visibility import rasterize


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    monkeypatch.setattr(volumes, "RAYS", 256)
    monkeypatch.setattr(volumes, "ALONG", 10)
    monkeypatch.setattr(volumes, "CELL", 0.5)


def light(stage, view: Camera, more=None) -> np.ndarray:
    """Radiance (H, W, 3)."""
    seen, radiance = rasterize(stage.at(0), view), np.zeros((view.width * view.height, 4), np.float32)
    paint(stage.baked(0), view, seen, False, False, radiance, more=more and (lambda values: more(seen, values)))
    return radiance[:, :3].reshape(view.height, view.width, 3)


def near_of(stage, view: Camera) -> np.ndarray:
    """`Bounces.near` of a picture's pixels, (H, W, 4)."""
    baked, seen = stage.baked(0), rasterize(stage.at(0), view)
    triangle, depth = seen.triangle.reshape(-1), seen.inverse_depth.reshape(-1)
    baked.rows.write_seen(view, seen, baked.geometry)
    slots = np.flatnonzero(triangle >= 0).astype(np.int32)
    found = with_near(baked.bounces, baked.bounce_scene, baked.tree, view_of(baked, view), slots, triangle, depth)
    return found.near.reshape(view.height, view.width, 4)


@pytest.mark.slow
def test_in_a_furnace_what_is_near_sends_what_it_takes_away():
    """A white ball within another one that shines and throws back half: all has twice the light that the outer one sends by
    itself; so has the gap.
    """
    hull = ball(1.0, (0, 0, 0), 24)
    hull = replace(hull, triangles=hull.triangles[:, ::-1].copy(), normals=-hull.normals, materials=(matt(0.5, 0.25),))
    pebble = replace(ball(0.3, (0.0, 0.55, 0.0), 24), materials=(matt(1.0),))
    stage = stage_of(AWAY, Scene(sun=None, sky=DARK), both(hull, pebble), bounces="fine")
    view = camera(60, 60, 60, 30, 10, 0.8, (0.0, 0.5, 0.0))
    near = near_of(stage, view)
    assert (near[..., 0] < 0.8).mean() > 0.05
    np.testing.assert_allclose(light(stage, view), 0.5, rtol=0.02)


@pytest.mark.slow
def test_near_light_does_not_depend_on_what_was_painted_before():
    """Rays of a place are kept from shot to shot, whose targets have other numbers of materials."""
    pebbles = both(ball(0.5, (0, 0, 0), 16), ball(0.5, (0, 1.02, 0), 16))
    pebbles = replace(pebbles, materials=tuple(matt(0.8) for _ in pebbles.materials))
    two = painted_mesh(*((np.array(rectangle((0, 0, 40), (0.1, 0, 0), (0, 0.1, 0))), matt(shade)) for shade in (0.5, 0.6)))
    view = camera(40, 40, 40, 90, 10, 1.5, (0.0, 0.5, 0.0))

    def found(target):
        return near_of(stage_of(target, Scene(sun=Sun(azimuth=30, elevation=40)), pebbles, bounces="fine"), view)

    bounces._look.cache_clear()
    bounces._bake.cache_clear()
    fresh = found(two)
    assert (fresh[..., 1] > 0.02).mean() > 0.02
    found(AWAY)
    np.testing.assert_array_equal(found(two), fresh)


@pytest.mark.slow
def test_beyond_the_probes_fine_light_is_that_of_the_sky(monkeypatch):
    """250 m away nothing is known of what bounces, however near it is."""
    far = painted_mesh(*((np.array(box((249, y, 1), (251, y + 0.3, 3))), matt(0.9)) for y in (-0.4, 0.1)))
    near = painted_mesh((np.concatenate([box((-1, y, 0), (1, y + 2, 1)) for y in (-1, 250)]), matt(0.5)))
    monkeypatch.setattr(volumes, "MOST", 4_000)
    stages = [stage_of(AWAY, Scene(sun=None, sky=EVEN), both(near, far), bounces=how) for how in ("on", "fine")]
    view = camera(40, 30, 60, 90, 10, 5.0, (250.0, 0.0, 2.0))
    plain, fine = (light(stage, view) for stage in stages)
    assert stages[0].baked(0).bounces.frame[1, 6] > 0
    assert (near_of(stages[1], view)[..., 1] > 0.01).any()
    assert (fine <= plain + 1e-4).all()


def seen_share(side: float, height: float) -> float:
    """Of the light of an even sky, what a square that lies `height` above takes away from the place below its middle: four
    times the form factor of a quarter of it.
    """
    a = side / 2 / height
    return 4 * a / math.sqrt(1 + a * a) * math.atan(a / math.sqrt(1 + a * a)) / math.pi


@pytest.mark.parametrize("height", [0.2, 0.6])
def test_a_board_takes_from_the_floor_what_its_form_factor_says(height):
    """Probes are half a metre apart and know nothing of a board of 60 cm; what the sun throws from the floor to the board's
    lower side is in neither, as there is no sun.
    """
    floor = np.array(rectangle((-2.5, -2.5, 0), (5, 0, 0), (0, 5, 0)))
    board = box((-0.3, -0.3, height), (0.3, 0.3, height + 0.02))
    bowl = ball(0.2, (2.0, 2.0, 0.4), 8)  # nothing flat is all there is
    place = both(painted_mesh((floor, matt(0.6)), (board, matt(0.0))), replace(bowl, materials=(matt(0.0),)))
    stage = stage_of(AWAY, Scene(sun=None, sky=DARK), place, bounces="fine")
    stage.baked(0)
    view = camera(32, 32, 200, 0, 20, 3.0, (0.0, 0.0, 0.0))
    baked = stage.baked(0)
    stage._baked[next(iter(stage._baked))] = replace(
        baked, bounces=baked.bounces._replace(lightmap=baked.bounces.lightmap._replace(chart=np.zeros(0, np.int32)))
    )
    free = near_of(stage, view)[14:18, 14:18, 0]
    assert abs(free.mean() - (1 - seen_share(0.6, height))) < 0.02
    assert np.ptp(free) < 0.2


def lobe_quadrature(toward: np.ndarray, normal: np.ndarray, alpha: float, radiance) -> float:
    """The mean of radiance (N, 3) -> (N,) over a GGX lobe with separable shadowing, by 400 x 400 directions."""
    z, angle = np.meshgrid((np.arange(400) + 0.5) / 400, (np.arange(400) + 0.5) / 400 * 2 * math.pi)
    across = np.cross(normal, (1.0, 0.0, 0.0))
    axes = np.stack([across, np.cross(normal, across), normal])
    flat = np.sqrt(1 - z * z)
    ways = np.stack([flat * np.cos(angle), flat * np.sin(angle), z], axis=-1).reshape(-1, 3) @ axes
    values = ggx(ways, toward, normal, alpha)
    return float((values * radiance(ways)).sum() / values.sum())


def ggx(ways: np.ndarray, toward: np.ndarray, normal: np.ndarray, alpha: float) -> np.ndarray:
    """D G / (4 n.v) of directions (N, 3)."""
    half = ways + toward
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    density = alpha**2 / (math.pi * ((alpha**2 - 1) * (half @ normal) ** 2 + 1) ** 2)
    away, near = ways @ normal, float(toward @ normal)

    def unshadowed(cosine):
        return 2 * cosine / (cosine + np.sqrt(alpha**2 + (1 - alpha**2) * cosine**2))

    return density * unshadowed(away) * unshadowed(near) / (4 * near)


@pytest.mark.parametrize("roughness", [0.3, 0.6, 0.9])
@pytest.mark.parametrize("facing", [0.2, 0.7, 0.99])
def test_rays_of_a_lobe_share_ggx(roughness, facing):
    """Their weights sum up to what the lobe reflects, and their weighted mean is its mean direction: quadrature of D G / (4 n.l
    n.v) n.l over the hemisphere.
    """
    view = np.array([math.sqrt(1 - facing**2), 0.0, facing])
    count, pixels = 16, np.arange(64 * 64, dtype=np.int32)
    each = np.ones((len(pixels), 1), np.float32)
    rough = np.full(len(pixels), roughness, np.float32)
    up = np.array([[0, 0, 1]], np.float32)
    ways, weights = lobe_rays(each * view.astype(np.float32), each * up, rough, pixels, 64, count)
    assert np.allclose((ways**2).sum(axis=-1), 1, atol=1e-4)
    assert (weights[ways[..., 2] < 0] == 0).all()
    found = weights.mean(), (weights[..., None] * ways).mean(axis=(0, 1))

    z, angle = np.meshgrid((np.arange(400) + 0.5) / 400, (np.arange(400) + 0.5) / 400 * 2 * math.pi)
    flat = np.sqrt(1 - z * z)
    out = np.stack([flat * np.cos(angle), flat * np.sin(angle), z], axis=-1).reshape(-1, 3)
    values = ggx(out, view, up[0].astype(float), roughness**2) * 2 * math.pi / len(out)
    wanted = values.sum(), (values[:, None] * out).sum(axis=0)
    assert found[0] == pytest.approx(wanted[0], rel=0.01)
    np.testing.assert_allclose(found[1], wanted[1], atol=0.01)


def test_neighbours_of_a_lobe_have_different_rays_and_all_of_them_the_same_ones_again():
    pixels = np.array([5, 6, 5], np.int32)
    view, up = (np.tile(np.array([row], np.float32), (3, 1)) for row in ((0.6, 0, 0.8), (0, 0, 1)))
    ways, _ = lobe_rays(view, up, np.full(3, 0.4, np.float32), pixels, 64, 8)
    np.testing.assert_array_equal(ways[:, 0], ways[:, 2])
    assert np.abs(ways[:, 0] - ways[:, 1]).max(axis=1).min() > 0.01


@pytest.mark.slow
@pytest.mark.parametrize("roughness", [0.15, 0.4])
def test_a_rough_mirror_shows_the_mean_of_its_lobe(roughness, monkeypatch):
    """Bands that shine before a black wall, in a plate of white metal: by quadrature, pixel by pixel."""
    monkeypatch.setattr(panes, "LOBE_RAYS", 64)
    view = camera(192, 144, 100, 180, 5, 2.0, (0.0, 0.0, 0.5))
    wall, _, *bands = behind()
    parts = [plate(roughness), (wall[0], matt(0.0)), *bands]
    stage = stage_of(AWAY, Scene(sun=None, sky=DARK), painted_mesh(*parts), bounces="fine")
    found = light(stage, view, lambda seen, values: mirror_in_panes(stage.baked(0), view, seen, NOWHERE, values))
    normal, wanted = np.array([0.0, 1.0, 0.0]), []
    rays = pixel_rays(view.intrinsics) @ view.R
    rows, columns = np.mgrid[48:88:8, 64:128:8]
    for row, column in zip(rows.ravel(), columns.ravel(), strict=True):
        ray = rays[row, column]
        place = view.center + ray * (PLATE - view.center[1]) / ray[1]

        def radiance(ways, place=place):
            at = place + ways * ((4.49 - PLATE) / np.maximum(ways[:, 1:2], 1e-9))
            on = [(x < at[:, 0]) & (at[:, 0] < x + 0.4) & (at[:, 2] > -2) & (at[:, 2] < 3) for x in (-2.4, -1.2)]
            return 0.5 * (on[0] | on[1])

        toward = view.center - place
        wanted.append(lobe_quadrature(toward / np.linalg.norm(toward), normal, roughness**2, radiance))
    seen, wanted = found[48:88:8, 64:128:8, 0].ravel(), np.array(wanted)
    assert np.ptp(wanted) > 0.03
    assert seen.mean() == pytest.approx(wanted.mean(), rel=0.06)
    np.testing.assert_allclose(seen, wanted, atol=0.03)


@pytest.mark.slow
def test_a_rough_floor_mirrors_what_its_lobe_leans_to(monkeypatch):
    """Five metres before a black wall that hides half of an even sky, a rough black floor is darker towards the wall than away
    from it, as much as a lobe says whose facets reflect by Schlick.
    """
    monkeypatch.setattr(volumes, "MOST", 14_000)
    floor = np.array(rectangle((-300, -300, 0), (600, 0, 0), (0, 600, 0)))
    black = Material("asphalt", (0, 0, 0, 1), roughness=0.9)
    place = painted_mesh((floor, black), (box((-300, 5, 0), (300, 6, 60)), matt(0.0)))
    stage = stage_of(AWAY, Scene(sun=None, sky=EVEN), place)
    normal, found, wanted = np.array([0.0, 0.0, 1.0]), [], []
    for azimuth, side in ((0, -1), (180, 1)):
        view = camera(16, 16, 200, azimuth, 12, 2.0, (0.0, 0.0, 0.0))
        toward = view.center / np.linalg.norm(view.center)
        assert toward[1] * side > 0.9
        found.append(light(stage, view)[6:10, 6:10].mean())

        def sky(ways, toward=toward):
            half = ways + toward
            half /= np.linalg.norm(half, axis=1, keepdims=True)
            is_open = 60 * ways[:, 1] < 5 * ways[:, 2]
            return is_open * (0.04 + 0.96 * (1 - half @ toward) ** 5)

        wanted.append(lobe_quadrature(toward, normal, 0.9**2, sky))
    assert found[0] < 0.7 * found[1]
    # One number says how far all lobes lean.
    assert found[0] / found[1] == pytest.approx(wanted[0] / wanted[1], abs=0.12)


def test_lobes_are_shared_by_pixels_of_one_surface_alone():
    """Of a row of six pixels: one material, another one, one that faces elsewhere, one whose light is not known."""
    at = np.arange(6, dtype=np.int32)
    normals = np.tile(np.array([[0, 0, 1]], np.float32), (6, 1))
    normals[4] = 0, 1, 0
    made_of, gloss = np.array([1, 1, 2, 1, 1, 1], np.int32), np.full((6, 13), 0.3, np.float32)
    shown = np.arange(18, dtype=np.float32).reshape(6, 3)
    is_known = np.array([True, True, True, True, True, False])
    found = kernels_mirror.shared(at, normals, made_of, gloss, shown, is_known, 6)
    np.testing.assert_allclose(found[:5, 0] / 3, [(0 + 1) / 2, (0 + 1 + 3) / 3, 2, (1 + 3) / 2, 4])
    gloss[:, 6] = 0.05
    np.testing.assert_array_equal(kernels_mirror.shared(at, normals, made_of, gloss, shown, is_known, 6)[:5], shown[:5])
    gloss[:, 6] = 0.3  # rows of three pixels: what is next in memory is not what is beside
    found = kernels_mirror.shared(at[:4], normals[:4], made_of[:4] * 0, gloss, shown[:4], is_known[:4], 3)
    np.testing.assert_allclose(found[:, 0] / 3, [1.5, 1.5, 1.5, 1.5])


def test_a_rough_mirror_on_the_ground_has_no_speckles():
    """Some rays of nearly every lobe meet the ground, of which they know nothing; all pixels are changed by the others."""
    view = camera(48, 36, 50, 20, 10, 3.0, (0.0, 0.0, 0.5))
    block = painted_mesh((np.array(box((-0.6, -0.1, 0), (0.6, 0.1, 1))), metal(0.4)))
    stage = stage_of(block, Scene(sun=None, sky=EVEN, ground=Ground()), bounces="fine")
    changed = light(stage, view, lambda seen, values: mirror_in_panes(stage.baked(0), view, seen, NOWHERE, values))
    plain, seen = light(stage, view), rasterize(stage.at(0), view)
    normals = stage.at(0).triangle_normals[seen.triangle]
    upright = (seen.triangle >= 0) & (seen.triangle < 12) & (np.abs(normals[..., 2]) < 0.1)
    assert upright.sum() > 100
    assert (np.abs(changed - plain).max(axis=2)[upright] > 1e-5).mean() > 0.95
