"""Passes of the raster engine: closed forms, and that albedo x shading + residual is the picture, to its bytes."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from blurred_scenes import SCENES, load, meshes, sharp
from light_stage import ball, cuboid, flat, quad
from test_physics import camera, sky_file, stage_of, toward_sun

import viewsphere_zoo as zoo
from proven import close, told
from shots import with_camera
from viewsphere import Recipe, plan
from viewsphere.assets.mesh import Image, Material, Texture
from viewsphere.engines import raster
from viewsphere.engines.raster.shading import kernels_split
from viewsphere.engines.raster.shading.painting import paint
from viewsphere.engines.shared.passes import shading_of
from viewsphere.errors import RecipeError
from viewsphere.geometry.camera import pixel_rays
from viewsphere.model.channel import LIGHT_PASSES, MATERIAL_PASSES, PASSES
from viewsphere.model.scene import Background, Finish, Ground, Scene, Sun, ViewTransform
from viewsphere.rendering.background import display_background
from viewsphere.rendering.view import EXPOSURE, develop
from viewsphere.truth.raster.visibility import rasterize

ALL = (*LIGHT_PASSES, *MATERIAL_PASSES)
COLOR = np.array([0.8, 0.5, 0.3])
SUN = Sun(azimuth=60, elevation=40, strength=2.0, color=(1.0, 0.7, 0.4), angle_deg=0.0)


def passes(stage, view, names=ALL, finish=None):
    own = stage.for_shot(with_camera(stage.shot, view, finish))
    return own.paint(0, 0, rasterize(own.at(0), own.shot.camera(0)), names)


def made(mesh, **material):
    return replace(mesh, materials=(Material(**material),))


def sphere_normals(view, radius):
    """Normals (H, W, 3) of a sphere around the origin where the pixels' rays meet it; their cosines to the viewer, 0 beside."""
    rays = pixel_rays(view.intrinsics) @ view.R
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    along = -(rays @ view.center)
    off = along**2 - (view.center @ view.center - radius**2)
    normal = (view.center + (along - np.sqrt(np.maximum(off, 0)))[..., None] * rays) / radius
    return normal, np.where(off > 0, -(normal * rays).sum(-1), 0)


def test_a_matt_sphere_under_a_sun_is_lambert_s(tmp_path):
    black = sky_file(tmp_path / "even.hdr", np.ones((16, 32, 3))).model_copy(update={"strength": 0.0})
    mesh = made(ball(0.5, (0, 0, 0), 96), base_color=(*COLOR, 1.0), roughness=1.0, specular=0.0)
    view = camera(96, 96, 150, 20, 15, 2.0)
    found = passes(stage_of([mesh], Scene(sun=SUN, sky=black), ambient_occlusion="off", antialias=1), view)
    normal, facing = sphere_normals(view, 0.5)
    sphere = facing > 0.4  # at the rim mirrors even what reflects nothing at normal incidence
    cosine = np.maximum(normal @ toward_sun(SUN), 0)
    expected = cosine[..., None] * np.array(SUN.color) * SUN.strength / math.pi
    lit = sphere & (cosine > 0.1)
    np.testing.assert_allclose(found["shading"][lit], expected[lit], rtol=0.01)
    told("shading", "Lambert's sphere, a share of it", found["shading"][lit] / expected[lit] - 1)
    close("albedo", "Lambert's sphere", found["albedo"][sphere], np.tile(COLOR, (sphere.sum(), 1)), rtol=0.01)
    assert found["shading"][sphere & (normal @ toward_sun(SUN) < -0.05)].max() == 0
    assert found["residual"][sphere].max() < 0.01 * expected.max()
    assert found["emission"].max() == 0
    assert (found["roughness"][sphere] == 1).all() and (found["metallic"] == 0).all()
    for name in ALL:
        assert found[name][facing == 0].max() == 0
        assert found[name].dtype == np.float32 and PASSES[name].fits(found[name], 96, 96)


def test_a_metal_sphere_scatters_nothing():
    mesh = made(ball(0.5, (0, 0, 0), 48), base_color=(*COLOR, 1.0), metallic=1.0, roughness=0.4)
    view = camera(64, 64, 100, 20, 15, 2.0)
    found = passes(stage_of([mesh], Scene(sun=SUN)), view, finish=Finish(background=Background(color=(0, 0, 0))))
    inside = sphere_normals(view, 0.5)[1] > 0.2
    assert found["albedo"].max() == 0 and found["shading"].max() == 0
    assert found["residual"][inside].min() > 0
    np.testing.assert_allclose(found["roughness"][inside], 0.4, atol=1e-6)
    assert (found["metallic"][inside] == 1).all()


@pytest.mark.parametrize("unlit", [False, True])
def test_a_plate_that_glows_sends_its_own_light(unlit):
    glow = np.array([3.0, 1.5, 0.25])
    look = {"unlit": True, "base_color": (*COLOR, 1.0)} if unlit else {"emissive": tuple(glow), "base_color": (0.5,) * 3 + (1,)}
    plate = flat(quad((-1, -1, 0), (2, 0, 0), (0, 2, 0)), Material(**look))
    found = passes(stage_of([plate], Scene(sun=SUN)), camera(16, 16, 40, 0, 60, 3))
    expected = COLOR / EXPOSURE if unlit else glow
    close("emission", "a plate that glows", found["emission"], np.broadcast_to(expected, (16, 16, 3)), rtol=1e-5)
    assert (found["residual"] >= found["emission"] * (1 - 1e-5)).all()
    assert (found["albedo"].max() == 0) == unlit


def test_glass_and_veils_show_the_albedo_behind_them():
    """A green pane lets at least a fifth through: the excess of green is residual; a veil has half of its own colour."""
    floor = flat(quad((-2, -2, 0), (4, 0, 0), (0, 4, 0)), Material(base_color=(*COLOR, 1.0), roughness=1.0, specular=0.0))
    pane = quad((-2, -2, 0.5), (4, 0, 0), (0, 4, 0))
    glass = flat(pane, Material(base_color=(0.2, 0.8, 0.2, 1.0), transmission=1.0, roughness=0.0, specular=0.0))
    veil = flat(pane, Material(base_color=(0.1, 0.2, 0.6, 0.5), alpha_mode="BLEND", roughness=1.0, specular=0.0))
    view, scene = camera(16, 16, 60, 0, 90, 3), Scene(sun=SUN)
    plain, through, veiled = (
        passes(stage_of(m, scene), view, ("albedo", "shading")) for m in ([floor], [floor, glass], [floor, veil])
    )
    np.testing.assert_allclose(through["albedo"], plain["albedo"] * 0.2, rtol=0.01)
    half = np.broadcast_to(0.5 * COLOR + 0.5 * np.array([0.1, 0.2, 0.6]), (16, 16, 3))
    np.testing.assert_allclose(veiled["albedo"], half, rtol=0.01)
    assert np.abs(through["shading"] / plain["shading"] - 1).max() < 0.15  # but for the sky that the pane hides


def still_life():
    """A textured car's worth of everything: metal, glass, glow, veil, cut-out, coat, bumps, on a floor of slabs."""
    rng = np.random.default_rng(3)
    texels = rng.integers(0, 256, (32, 32, 4), np.uint8)
    bumps = np.dstack([rng.integers(90, 166, (32, 32, 2), np.uint8), np.full((32, 32, 2), 255, np.uint8)])
    card = flat(quad((-1.3, 0.9, 0), (1.2, 0, 0), (0, 0, 1.2)))
    uv = (card.vertices[:, [0, 2]] - card.vertices[:, [0, 2]].min(axis=0)).astype(np.float32)
    leaf = Material(base_color_texture=Texture(0), alpha_mode="MASK", alpha_cutoff=0.5, normal_texture=Texture(1))
    cut = replace(card, uv0=uv, images=(Image("a", texels), Image("b", bumps)), materials=(leaf,))
    pane = flat(
        cuboid((-0.6, -0.9, 0), (0.5, -0.85, 0.8)), Material(base_color=(0.5, 0.9, 0.6, 1), transmission=0.9, roughness=0.1)
    )
    veil = flat(cuboid((0.3, -0.5, 0.1), (0.9, -0.1, 0.7)), Material(base_color=(0.9, 0.2, 0.1, 0.4), alpha_mode="BLEND"))
    coat = made(ball(0.35, (-0.4, 0.1, 0.35)), base_color=(0.6, 0.05, 0.05, 1), clearcoat=1.0, clearcoat_roughness=0.05)
    lamp = made(ball(0.2, (0.5, 0.6, 0.2)), base_color=(0.2, 0.2, 0.2, 1), emissive=(2.0, 1.0, 0.3))
    return [cut, pane, veil, coat, lamp]


BACKGROUNDS = {
    "sky": (Background(), "rgb"),
    "color": (Background(color=(0.2, 0.4, 0.7)), "rgb"),
    "none": (Background(), "rgba"),
}


@pytest.mark.parametrize("where", BACKGROUNDS)
@pytest.mark.parametrize("catcher", [False, True])
@pytest.mark.slow
def test_albedo_times_shading_and_the_rest_is_the_picture(where, catcher):
    """Exposed and developed as every picture is; a byte may be rounded the other way."""
    background, name = BACKGROUNDS[where]
    ground = Ground(catcher=True) if catcher else Ground()
    stage = stage_of(still_life(), Scene(sun=SUN, ground=ground))
    view, finish = (
        camera(120, 90, 110, 25, 20, 3.2, (0, 0, 0.4)),
        Finish(background=background, view=ViewTransform(transform="agx")),
    )
    own = stage.for_shot(with_camera(stage.shot, view, finish))
    seen = rasterize(own.at(0), own.shot.camera(0))
    alone = own.paint(0, 0, seen, (name,))
    found = own.paint(0, 0, seen, (name, *ALL))
    assert found[name].tobytes() == alone[name].tobytes()  # what is asked for beside a picture does not change it
    light = found["albedo"].astype(np.float64) * found["shading"] + found["residual"]
    alpha = own._canvas(120 * 90).reshape(90, 120, 4)[..., 3:]  # which no pass has
    composed = develop(
        np.dstack([light, alpha]).astype(np.float32), display_background(background, 120, 90), finish.view, name == "rgba"
    )
    apart = np.abs(composed.astype(int) - found[name])
    assert apart.max() <= 1 and (apart > 0).mean() < 0.005
    told("residual", "the picture, of albedo x shading + residual", apart, "of 255")
    assert (found["emission"] <= found["residual"] * (1 + 1e-5) + 1e-6).all()
    for each in ALL:
        assert np.isfinite(found[each]).all() and found[each].min() >= 0
        assert each in ("shading", "residual", "emission") or found[each].max() <= 1 + 1e-6
    if catcher:
        floor = seen.triangle >= own.at(0).triangle_start[-1]
        assert floor.sum() > 500
        assert found["roughness"][floor].max() == 0


def linear_picture(stage, view):
    """Radiance (H, W, 3), a sample a pixel."""
    light = np.empty((view.width * view.height, 4), np.float32)
    paint(stage.baked(0), view, rasterize(stage.at(0), view), False, False, light)
    return light.reshape(view.height, view.width, 4)[..., :3]


@pytest.mark.slow
def test_albedo_times_shading_is_the_diffuse_picture():
    """Within 1 %, of a car without metals: what its colours add to the same car in black."""
    car = zoo.build("car", np.random.default_rng(4))
    plain = replace(car, materials=tuple(replace(m, metallic=0.0, transmission=0.0) for m in car.materials))
    black = replace(plain, materials=tuple(replace(m, base_color=(0, 0, 0, m.base_color[3])) for m in plain.materials))
    scene, view = Scene(sun=SUN, ground=Ground()), camera(160, 120, 150, 30, 18, 8.0)
    stages = [stage_of([mesh], scene, antialias=1) for mesh in (plain, black)]
    found = passes(stages[0], view, LIGHT_PASSES)
    colored, uncolored = (linear_picture(stage, view) for stage in stages)
    triangle = rasterize(stages[0].at(0), view).triangle
    own = (triangle >= 0) & (triangle < len(car.triangles))
    expected = (colored - uncolored)[own]
    assert own.sum() > 2000 and expected.mean() > 0.05
    np.testing.assert_allclose((found["albedo"] * found["shading"])[own], expected, rtol=0.01, atol=1e-5)


def test_materials_are_those_at_the_pixels_centres():
    """Neither smoothing nor bumps too small to see change them; texture and factor multiply."""
    rng = np.random.default_rng(5)
    rough = np.dstack(
        [
            np.zeros((8, 8), np.uint8),
            rng.integers(0, 256, (8, 8), np.uint8),
            rng.integers(0, 256, (8, 8), np.uint8),
            np.full((8, 8), 255, np.uint8),
        ]
    )
    bumps = np.dstack([rng.integers(0, 256, (256, 256, 2), np.uint8), np.full((256, 256, 2), 255, np.uint8)])
    plate = flat(quad((-1, -1, 0), (2, 0, 0), (0, 2, 0)))
    uv = ((plate.vertices[:, :2] + 1) / 2 * [1, -1] + [0, 1]).astype(np.float32)
    look = Material(roughness=0.8, metallic=0.5, metallic_roughness_texture=Texture(0, nearest=True), normal_texture=Texture(1))
    mesh = replace(plate, uv0=uv, images=(Image("r", rough), Image("b", bumps)), materials=(look,))
    view = camera(64, 64, 128, 0, 90, 4)
    found = passes(stage_of([mesh], Scene(sun=SUN)), view, MATERIAL_PASSES)
    once = passes(stage_of([mesh], Scene(sun=SUN), antialias=1), view, MATERIAL_PASSES)
    middle = found["roughness"][4::8, 4::8], found["metallic"][4::8, 4::8]
    assert all(found[name].tobytes() == once[name].tobytes() for name in MATERIAL_PASSES)
    close("roughness", "texels", middle[0], 0.8 * rough[..., 1] / 255, atol=2e-3)
    close("metallic", "texels", middle[1], 0.5 * rough[..., 2] / 255, atol=2e-3)


@pytest.mark.slow
def test_passes_are_those_of_the_shutter_s_centre():
    known = meshes()
    shot = SCENES["car"](15.0)
    stage, still = (raster.stage(each, load(known)) for each in (shot, sharp(shot)))
    seen = rasterize(stage.at(0), shot.camera(0))
    found, expected = stage.paint(0, 0, seen, ("rgb", *ALL)), still.paint(0, 0, seen, ("rgb", *ALL))
    for name in ALL:
        np.testing.assert_allclose(found[name], expected[name], atol=1e-5)
    assert (found["rgb"] != expected["rgb"]).mean() > 0.01
    assert found["rgb"].tobytes() == stage.paint(0, 0, seen, ("rgb",))["rgb"].tobytes()


def test_what_is_not_asked_for_is_not_computed(monkeypatch):
    def refuse(*_):
        raise AssertionError("computed")

    for name in ("split", "average_split", "substance"):
        monkeypatch.setattr(kernels_split, name, refuse)
    stage, view = stage_of(still_life(), Scene(sun=SUN, ground=Ground())), camera(32, 24, 30, 25, 20, 3.2)
    assert list(passes(stage, view, ("rgb", "rgba"))) == ["rgb", "rgba"]
    with pytest.raises(AssertionError, match="computed"):
        passes(stage, view, ("roughness",))


@pytest.mark.parametrize("engine", ["eevee", "workbench"])
def test_engines_that_do_not_paint_a_pass_say_so_before_rendering(engine):
    recipe = Recipe(
        name="x",
        models=[{"source": "zoo:car", "category": "car"}],
        viewpoints={"distance": 5},
        engine=engine,
        channels=["rgb", "albedo"],
        formats=[],
    )
    with pytest.raises(
        RecipeError,
        match=rf"channels\[1\]: expected a label, or what engine: {engine} paints \(rgb, rgba, rgb16, rgb_linear, bayer\)",
    ):
        plan(recipe)


def test_shading_where_the_albedo_lacks_colours():
    albedo, diffuse = (
        np.float32([[[0.5, 0.0, 0.25], [0, 0, 0], [1, 1, 1]]]),
        np.float32([[[1.0, 0.0, 1.0], [0, 0, 0], [3, 2, 1]]]),
    )
    np.testing.assert_array_equal(shading_of(albedo, diffuse), np.float32([[[2, 3, 4], [0, 0, 0], [3, 2, 1]]]))
