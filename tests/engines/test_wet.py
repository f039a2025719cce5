"""Wet ground: puddles lie where the world says, mirror what stands above them, and wet materials are darker."""

from dataclasses import replace

import numpy as np
import pytest
from light_stage import flat, quad
from test_bounces import EVEN, OUT, both, matt, painted_mesh
from test_bounces import stage_of as bounced_stage
from test_physics import camera, stage_of
from test_raster import box, mesh_of, rectangle

from shots import with_camera
from viewsphere.assets.appearance.wetting import DARKEST, FILM, SMOOTH, UPRIGHT, darkened, wet, wetted
from viewsphere.assets.mesh import Material
from viewsphere.engines.raster.reflections.wet_ground import WATER, mirror_in_water, puddles
from viewsphere.engines.raster.shading.painting import paint
from viewsphere.geometry.camera import pixel_rays, project
from viewsphere.model.scene import Ground, Scene, Sky
from viewsphere.model.weather import Wet
from viewsphere.rendering.view import EXPOSURE
from viewsphere.truth.raster.visibility import rasterize

POOL = Wet(amount=1.0, puddles=1.0)
SIGN = Material(base_color=(0.9, 0.1, 0.1, 1.0), unlit=True)
BLACK = Sky(strength=0.0)


def light(meshes, water, view):
    stage = stage_of(meshes, Scene(sun=None, sky=BLACK, ground=Ground(color=(0.2, 0.2, 0.2))))
    seen, radiance = rasterize(stage.at(0), view), np.empty((view.width * view.height, 4), np.float32)

    def more(light):
        mirror_in_water(stage.baked(0), view, seen, water, light)

    paint(stage.baked(0), view, seen, False, True, radiance, more=more if water else None)
    return radiance[:, :3].reshape(view.height, view.width, 3), seen


def sign(low=1.0, high=2.0):
    """An upright red plate over the ground, a second one low beside so that the ground is at z = 0."""
    plate = flat(quad((-0.8, 0, low), (1.6, 0, 0), (0, 0, high - low)), SIGN)
    foot = flat(quad((-9, 9, 0), (0.1, 0, 0), (0, 0, 0.1)), SIGN)
    return [plate, foot]


def test_a_pool_shows_the_mirror_image_of_what_stands_above_it_by_fresnel():
    view = camera(64, 64, 50, 0, 20, 6)
    found, seen = light(sign(), POOL, view)
    plain, _ = light(sign(), None, view)
    middle = np.array([[0.0, 0.0, -1.5]])  # the mirror image of the plate's middle
    (pixel,), _ = project(view.intrinsics, middle @ view.R.T + view.t)
    x, y = int(pixel[0]), int(pixel[1])
    ray = pixel_rays(view.intrinsics)[y, x] @ view.R
    cosine = -ray[2] / np.linalg.norm(ray)
    fresnel = WATER + (1 - WATER) * (1 - cosine) ** 5
    assert seen.triangle[y, x] >= 4  # the ground
    np.testing.assert_allclose(found[y, x] - 0.65 * plain[y, x], fresnel * np.array(SIGN.base_color[:3]) / EXPOSURE, rtol=0.02)
    beside = found[y, 2] - 0.65 * plain[y, 2]
    assert np.abs(beside).max() < 1e-4


def test_what_lies_on_the_ground_is_not_mirrored_and_dry_ground_mirrors_nothing():
    view = camera(32, 32, 25, 0, 20, 6)
    kerb = [flat(quad((-0.8, 0, 0.0), (1.6, 0, 0), (0, 0, 0.2)), SIGN)]
    dry, _ = light(kerb, None, view)
    found, seen = light(kerb, POOL, view)
    ground = seen.triangle >= 2
    np.testing.assert_allclose(found[ground], 0.65 * dry[ground], rtol=1e-4, atol=1e-6)


def test_a_camera_below_the_ground_sees_no_mirror():
    view = camera(16, 16, 12, 0, -20, 6)
    np.testing.assert_array_equal(light(sign(), POOL, view)[0], light(sign(), None, view)[0])


@pytest.mark.parametrize("share", [0.05, 0.3, 0.6])
def test_puddles_cover_the_share_that_is_asked_for(share):
    x, y = np.meshgrid(np.arange(0, 300, 0.5), np.arange(0, 300, 0.5))
    found = puddles(Wet(puddles=share, seed=5), x.ravel(), y.ravel())
    assert found.mean() == pytest.approx(share, abs=0.05)
    assert ((found == 0) | (found == 1)).mean() > 0.6


def test_puddles_are_in_the_world_and_follow_from_their_seed():
    x, y = np.linspace(-20, 20, 500), np.linspace(3, 9, 500)
    one = puddles(Wet(seed=1), x, y)
    assert (puddles(Wet(seed=1), x[::-1], y[::-1])[::-1] == one).all()
    assert (puddles(Wet(seed=2), x, y) != one).any()
    assert not puddles(Wet(amount=0.0), x, y).any() and not puddles(Wet(puddles=0.0), x, y).any()


def test_rough_things_are_darker_when_wet_and_lacquer_and_metal_are_not():
    assert darkened(0.95, 0.0, 1.0) == pytest.approx(DARKEST)
    assert darkened(0.95, 0.0, 0.0) == darkened(0.3, 0.0, 1.0) == darkened(0.9, 1.0, 1.0) == 1.0
    assert DARKEST < darkened(0.7, 0.0, 1.0) < 1
    soaked = wet(Material(roughness=0.9), 1.0)
    assert soaked.clearcoat > 0 and soaked.clearcoat_roughness < 0.2 and soaked.roughness < 0.9
    assert wet(Material(roughness=0.9, clearcoat=0.3, clearcoat_roughness=0.4), 0.0).clearcoat_roughness == 0.4


def test_what_faces_up_is_wetter_and_plants_have_no_film():
    floor, wall = (
        flat(quad((0, 0, 0), (1, 0, 0), (0, 1, 0)), Material()),
        flat(quad((0, 0, 0), (1, 0, 0), (0, 0, 1)), Material()),
    )
    base = 0.8
    for bare, share in ((floor, 1.0), (wall, UPRIGHT)):
        mesh = replace(bare, materials=(Material(base_color=(base, base, base, 1.0), roughness=0.9),))
        made = wetted(mesh, 1.0)
        assert len(made.materials) == 3 and made.vertices is mesh.vertices
        shown = {made.materials[i].base_color[0] for i in made.triangle_material}
        assert shown == {base * darkened(0.9, 0.0, share)}
        lawn = wetted(mesh, 1.0, "hedge")
        assert {lawn.materials[i].clearcoat for i in lawn.triangle_material} == {0.0}
        assert wetted(mesh, 1.0, evenly=True).triangle_material is mesh.triangle_material


@pytest.mark.slow
def test_where_light_bounces_a_film_loses_no_light_of_a_sky_that_it_does_not_mirror():
    """Below a wide black roof the floor's coat mirrors what probes see: the roof. Its mirror image takes nothing away again."""
    roof = painted_mesh((box((-15, -15, 2), (15, 15, 2.2)), matt(0.0)))
    view, water = camera(48, 32, 40, 0, 14, 2.5), Wet(amount=1.0, puddles=0.0)

    def radiance_of(coat):
        floor = replace(matt(0.6), clearcoat=coat, clearcoat_roughness=SMOOTH)
        place = both(painted_mesh((rectangle((-15, -15, 0), (30, 0, 0), (0, 30, 0)), floor)), roof)
        small = mesh_of(box((5, 5, 0), (5.2, 5.2, 0.2)), matt(0.5))
        stage = bounced_stage(small, Scene(sun=None, sky=EVEN, finish=OUT), place)
        seen, radiance = rasterize(stage.at(0), view), np.empty((view.width * view.height, 4), np.float32)

        def more(light):
            mirror_in_water(stage.baked(0), view, seen, water, light)

        paint(stage.baked(0), view, seen, False, True, radiance, more=more if coat else None)
        return radiance[:, 1].reshape(view.height, view.width)

    dry, coated = radiance_of(0.0), radiance_of(FILM)
    assert dry[16:].min() > 0
    assert (coated[16:] > 0.5 * dry[16:]).all()


def test_before_a_black_wall_a_film_leaves_the_light_that_the_ground_scatters():
    """What the film is taken to mirror, the sky, is taken away by as much as it added: seen flat, a film that is a little rough
    mirrors far less than smooth water does.
    """
    view, water = camera(48, 32, 40, 0, 6, 4.0), Wet(amount=1.0, puddles=0.0)
    floor = replace(matt(0.3), clearcoat=FILM, clearcoat_roughness=SMOOTH)
    wall = box((-60, 3, 0), (60, 4, 60)), matt(0.0)
    place = painted_mesh((rectangle((-60, -60, 0), (120, 0, 0), (0, 63, 0)), floor), wall)
    small = mesh_of(box((5, 5, 0), (5.2, 5.2, 0.2)), matt(0.5))
    stage = bounced_stage(small, Scene(sun=None, sky=EVEN, finish=OUT), place, bounces="off", antialias=1)
    stage = stage.for_shot(with_camera(stage.shot, view))
    seen, radiance = rasterize(stage.at(0), view), np.empty((view.width * view.height, 4), np.float32)
    passes = stage.paint(0, 0, seen, ("albedo", "shading"))

    def more(light):
        before.append(light[:, 1].copy())
        mirror_in_water(stage.baked(0), view, seen, water, light)

    before = []
    paint(stage.baked(0), view, seen, False, True, radiance, more=more)
    is_floor = (seen.triangle >= 0) & (stage.at(0).triangle_normals[seen.triangle][..., 2] > 0.9)
    scattered = (passes["albedo"] * passes["shading"])[..., 1][is_floor]
    assert (before[0].reshape(is_floor.shape)[is_floor] > 1.1 * scattered).all()
    np.testing.assert_allclose(radiance[:, 1].reshape(is_floor.shape)[is_floor], scattered, rtol=0.01)
