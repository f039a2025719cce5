"""Whole pictures against the physics: stages built and painted as every run does it, compared with closed forms and rays.

Light is compared as the stage paints it (float32); that bytes are this light through the view is proved here as well.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from light_stage import ball, cuboid, flat, quad

from quick import quick
from shots import painted, still_shot
from viewsphere.assets.mesh import Image, Material, Mesh, Texture
from viewsphere.codecs.srgb import encoded, linear
from viewsphere.engines import raster
from viewsphere.engines.raster.shading.painting import paint
from viewsphere.geometry.camera import orbit_center, orbit_rotation, pixel_rays
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import (
    AreaLight,
    Background,
    Environment,
    Finish,
    Ground,
    PointLight,
    Scene,
    Sky,
    SpotLight,
    Sun,
    ViewTransform,
)
from viewsphere.model.sensors.camera import Camera, Intrinsics
from viewsphere.model.thing import Thing
from viewsphere.rendering.view import EXPOSURE
from viewsphere.truth.raster.visibility import rasterize

SPEC = ModelSpec(key="model", source="memory", category="thing", category_id=1)
DARK = Sky(strength=0.0)
AS_IT_IS = ViewTransform(transform="raw", exposure=math.log2(1 / EXPOSURE))
"""A radiance of 1 is white."""


def camera(width, height, focal, azimuth=0.0, elevation=0.0, distance=1.0, target=(0, 0, 0)) -> Camera:
    intrinsics = Intrinsics(width=width, height=height, fx=focal, fy=focal, cx=width / 2, cy=height / 2)
    a, e = math.radians(azimuth), math.radians(elevation)
    rotation = orbit_rotation(a, e)
    return Camera(intrinsics, rotation, -rotation @ (np.asarray(target) + orbit_center(a, e, distance)))


def stage_of(meshes: list[Mesh], scene: Scene, **options):
    things = [Thing(id=i + 1, model=SPEC.model_copy(update={"key": f"m{i}"})) for i in range(len(meshes))]
    shot = still_shot(things, scene=scene, engine_options=options)
    return raster.stage(shot, lambda spec, step=None: meshes[int(spec.key[1:])])


def picture(mesh: Mesh, scene: Scene, view: Camera, **options) -> np.ndarray:
    return painted(stage_of([mesh], scene, **options), view)


def light_of(mesh: Mesh, scene: Scene, view: Camera, **options) -> tuple[np.ndarray, np.ndarray]:
    """Radiance (H, W, 3), a sample a pixel, and the triangle seen (H, W)."""
    stage = stage_of([mesh], scene, **options)
    visible = rasterize(stage.at(0), view)
    light = np.empty((view.width * view.height, 4), np.float32)
    paint(stage.baked(0), view, visible, False, True, light)
    return light.reshape(view.height, view.width, 4)[..., :3].astype(float), visible.triangle


def places(view: Camera, z: float) -> np.ndarray:
    """Where the pixels' rays meet the level plane at this height, (H, W, 3)."""
    rays = pixel_rays(view.intrinsics) @ view.R
    return view.center + rays * ((z - view.center[2]) / rays[..., 2])[..., None]


def toward_sun(sun: Sun) -> np.ndarray:
    return orbit_center(math.radians(sun.azimuth), math.radians(sun.elevation), 1.0)


def sky_file(path, pixels: np.ndarray) -> Environment:
    """An HDR picture whose pixels are floats to one part in 256; a power of two exactly."""
    height, width = pixels.shape[:2]
    mantissa, exponent = np.frexp(pixels.max(axis=-1))
    rgbe = np.empty((height, width, 4), np.uint8)
    rgbe[..., :3] = np.round(pixels * (mantissa * 256 / pixels.max(axis=-1))[..., None]).clip(0, 255)
    rgbe[..., 3] = exponent + 128
    path.write_bytes(f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n".encode() + rgbe.tobytes())
    return Environment(file=str(path))


MATERIALS = [
    Material(roughness=1.0),
    Material(roughness=0.3),
    *(Material(metallic=1.0, roughness=r) for r in (0.0, 0.15, 0.4, 0.7, 1.0)),
    Material(metallic=0.5, roughness=0.5, clearcoat=1.0, clearcoat_roughness=0.1),
    Material(roughness=0.6, clearcoat=1.0, ior=1.8),
]


@pytest.fixture(scope="module")
def even(tmp_path_factory) -> Environment:
    """A sky from which light 1 comes from everywhere, baked once."""
    return sky_file(tmp_path_factory.mktemp("sky") / "even.hdr", np.ones((16, 32, 3)))


def furnace(sky: Environment, mesh: Mesh, material: Material, distance: float, **options) -> np.ndarray:
    """Light that a mesh all of this material sends out under such a sky."""
    white = replace(mesh, materials=(material,) * len(mesh.materials), colors=None, images=())
    light, seen = light_of(white, Scene(sun=None, sky=sky), camera(60, 45, 50, 30, 20, distance), **options)
    assert np.allclose(light[seen < 0], 1, atol=0.005)
    return light[seen >= 0]


@pytest.mark.parametrize(
    ("material", "occlusion"),
    [*((material, "off") for material in MATERIALS), *((MATERIALS[i], "fast") for i in (0, 3, 7)), (MATERIALS[0], "fine")],
)
def test_white_furnace_of_a_ball(even, material, occlusion):
    """Occlusion is baked alike for all materials."""
    light = furnace(even, ball(0.5, (0, 0, 0), 48), material, 1.6, ambient_occlusion=occlusion)
    assert np.abs(light - 1).max() < 0.01


@pytest.mark.parametrize(
    "material", [m if i in {0, 3, 7} else pytest.param(m, marks=pytest.mark.slow) for i, m in enumerate(MATERIALS)]
)
def test_white_furnace_of_a_box(even, material):
    """The shading loses nothing, nor does occlusion, though it comes from depths on a grid; nothing is gained."""
    box = flat(cuboid((-0.5, -0.4, -0.3), (0.5, 0.4, 0.3)))
    assert np.abs(furnace(even, box, material, 1.8, ambient_occlusion="off") - 1).max() < 0.01
    occluded = furnace(even, box, material, 1.8)
    assert occluded.max() < 1.005
    assert occluded.min() > 0.985
    assert np.mean(np.abs(occluded - 1) < 0.01) > 0.99


@pytest.mark.slow
@pytest.mark.parametrize("material", [MATERIALS[0], MATERIALS[4], pytest.param(MATERIALS[-2], marks=pytest.mark.slow)])
def test_white_furnace_of_a_car(even, material):
    """Dents of shading normals that look away from what is seen may darken single pixels; occlusion only ever darkens."""
    from viewsphere_zoo import build

    car = build("car", np.random.default_rng(4))
    light = furnace(even, car, material, 7.0, ambient_occlusion="off")
    assert np.mean(np.abs(light - 1) < 0.01) > 0.995
    assert light.max() < 1.01
    assert furnace(even, car, material, 7.0).max() < 1.01


@pytest.mark.parametrize("elevation", [5, 20, 45, 70, 90])
@pytest.mark.parametrize("what", ["ground", "mesh"])
def test_lambert(elevation, what):
    sun = Sun(azimuth=70, elevation=elevation, strength=2.0, color=(1.0, 0.7, 0.4), angle_deg=0.5)
    color = (0.8, 0.5, 0.3)
    expected = np.array(color) * np.array(sun.color) * sun.strength * math.sin(math.radians(elevation)) / math.pi
    if what == "ground":
        srgb = tuple(float(c) for c in encoded(np.array(color)))
        scene = Scene(sun=sun, sky=DARK, ground=Ground(pattern="plain", color=srgb))
        light, _ = light_of(flat(cuboid((0, 0, 0), (0.5, 0.5, 0.5))), scene, camera(16, 16, 80, 0, 50, 3, (1.0, 1.0, 0)))
    else:
        # No reflectance at normal incidence: what Fresnel leaves at the grazing sun is below the tolerance seen from above.
        plate = flat(quad((-1, -1, 0), (2, 0, 0), (0, 2, 0)), Material(base_color=(*color, 1.0), roughness=1.0, specular=0.0))
        light, _ = light_of(plate, Scene(sun=sun, sky=DARK), camera(16, 16, 40, 0, 90, 3), ambient_occlusion="off")
    assert np.abs(light / expected - 1).max() < 0.01


def ggx_metal(normal_light, normal_view, normal_half, view_half, alpha, color):
    """Reflectance of GGX facets by one bounce: Walter et al. 2007, height-correlated Smith of Heitz 2014, Schlick 1994."""
    d = alpha**2 / (math.pi * (normal_half**2 * (alpha**2 - 1) + 1) ** 2)

    def lam(c):
        return (np.sqrt(1 + alpha**2 * (1 - c**2) / c**2) - 1) / 2

    fresnel = color + (1 - color) * (1 - view_half) ** 5
    return d * fresnel / (4 * normal_light * normal_view * (1 + lam(normal_light) + lam(normal_view)))


@cache
def lost_light(normal_view, alpha, n=500):
    """Share of a white facet's light that one bounce leaves out, by the midpoint rule over the hemisphere."""
    cosine, phi = (np.arange(n) + 0.5) / n, (np.arange(n) + 0.5) / n * math.pi
    nl, phi = np.meshgrid(cosine, phi)
    sine, sv = np.sqrt(1 - nl**2), math.sqrt(1 - normal_view**2)
    half = np.stack([sine * np.cos(phi) + sv, sine * np.sin(phi), nl + normal_view])
    half /= np.linalg.norm(half, axis=0)
    view_half = half[0] * sv + half[2] * normal_view
    return 1 - 2 * math.pi * np.mean(ggx_metal(nl, normal_view, half[2], view_half, alpha, 1.0) * nl)


@pytest.mark.parametrize("rough", quick([0.4, 0.6, 1.0], 0.4, 1.0))
@pytest.mark.parametrize(("elevation", "azimuth"), [(60, 180), (60, 120), (35, 180), (80, 10)])
def test_ggx_highlight_of_a_metal_plate(even, rough, elevation, azimuth):
    """Every pixel of a plate seen at 45 degrees; light that bounces twice between facets counts as Turquin 2019 has it."""
    sun = Sun(azimuth=azimuth, elevation=elevation, strength=1.0, color=(1, 1, 1), angle_deg=0)
    color = np.array([0.95, 0.6, 0.25])
    plate = flat(quad((-4, -4, 0), (8, 0, 0), (0, 8, 0)), Material(base_color=(*color, 1.0), metallic=1.0, roughness=rough))
    view = camera(24, 24, 30, 0, 45, 4)
    black = even.model_copy(update={"strength": 0.0})
    light, seen = light_of(plate, Scene(sun=sun, sky=black), view, ambient_occlusion="off")
    assert (seen >= 0).all()
    v = view.center - places(view, 0.0)
    v /= np.linalg.norm(v, axis=-1, keepdims=True)
    to = toward_sun(sun)
    half = v + to
    half /= np.linalg.norm(half, axis=-1, keepdims=True)
    alpha, nv = rough**2, v[..., 2]
    cosines = np.linspace(nv.min(), nv.max(), 5)
    lost = np.interp(nv, cosines, [lost_light(c, alpha) for c in cosines])[..., None]
    one_bounce = ggx_metal(to[2], nv, half[..., 2], (half * v).sum(-1), alpha, 1.0)[..., None] * to[2]
    fresnel = (ggx_metal(to[2], nv, half[..., 2], (half * v).sum(-1), alpha, 0.0)[..., None] * to[2]) / one_bounce
    expected = one_bounce * (color + (1 - color) * fresnel) * (1 + color * lost / (1 - lost))
    assert (np.abs(light - expected) < 0.02 * expected + 1e-4).all()


@pytest.fixture(scope="module")
def directions(tmp_path_factory) -> Environment:
    """A sky whose colour is its direction."""
    rows, columns = np.meshgrid((np.arange(256) + 0.5) / 256, (np.arange(512) + 0.5) / 512, indexing="ij")
    elevation, angle = (0.5 - rows) * math.pi, (0.5 - columns) * 2 * math.pi
    sky = np.stack([np.cos(elevation) * np.cos(angle), np.cos(elevation) * np.sin(angle), np.sin(elevation)], axis=-1)
    return sky_file(tmp_path_factory.mktemp("sky") / "directions.hdr", sky * 0.4 + 0.5)


@pytest.mark.parametrize("turn", [0.0, 60.0])
def test_a_mirror_ball_shows_the_sky_where_the_reflected_ray_goes(directions, turn):
    """A pixel tells which texel it shows."""
    scene = Scene(sun=None, sky=directions.model_copy(update={"rotation_deg": turn}))
    mirror = replace(ball(0.5, (0, 0, 0), 96), materials=(Material(metallic=1.0, roughness=0.0),))
    view = camera(160, 160, 280, 25, 15, 2.2)
    light, seen = light_of(mirror, scene, view, ambient_occlusion="off")
    rays = pixel_rays(view.intrinsics) @ view.R
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    along = -(rays @ view.center)
    off = along**2 - (view.center @ view.center - 0.25)
    normal = (view.center + (along - np.sqrt(np.maximum(off, 0)))[..., None] * rays) * 2
    facing = -(rays * normal).sum(-1)
    out = np.where((seen >= 0)[..., None], rays + 2 * facing[..., None] * normal, rays)
    inside = np.where(seen >= 0, (off > 0) & (facing > 0.35), off < -0.01)
    a = math.radians(turn)
    shown = (light - 0.5) / 0.4 @ np.array([[math.cos(a), math.sin(a), 0], [-math.sin(a), math.cos(a), 0], [0, 0, 1]])
    cosine = (shown * out).sum(-1) / np.linalg.norm(shown, axis=-1)
    apart = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    assert np.quantile(apart[inside & (seen < 0)], 0.999) < 1.0
    assert np.quantile(apart[inside & (seen >= 0)], 0.999) < 2.0


@pytest.mark.parametrize(("azimuth", "elevation"), [(0, 30), (40, 50), (135, 20), (250, 70)])
def test_shadow_of_a_pole(azimuth, elevation):
    """From above: the shadow is the strip from the pole's foot, as long as its height over the sun's tangent."""
    sun = Sun(azimuth=azimuth, elevation=elevation, angle_deg=0.0)
    pole = flat(cuboid((-0.03, -0.03, 0), (0.03, 0.03, 1)))
    reach = 1 / math.tan(math.radians(elevation))
    away = -toward_sun(sun)[:2] / np.linalg.norm(toward_sun(sun)[:2])
    middle = (*(away * reach / 2), 0.0)
    view = camera(200, 200, 200 / (reach + 0.6) * 20, 0, 90, 20, middle)
    light, seen = light_of(pole, Scene(sun=sun, sky=DARK, ground=Ground(pattern="plain")), view)
    lit = light.sum(axis=-1)
    ground = seen >= len(pole.triangles)
    p = places(view, 0.0)[..., :2]
    # The pole's foot swept along the shadow: a hexagon, whose distance is the larger of those along and across.
    shift = np.clip(p @ away, 0, reach)[..., None] * away
    corners = np.array([(-0.03, -0.03), (0.03, -0.03), (0.03, 0.03), (-0.03, 0.03)])
    across = np.array([-away[1], away[0]])
    half = (corners @ across).max()
    outside = np.maximum(np.abs(p @ across) - half, np.abs(p - shift).max(axis=-1) - 0.03)
    inside = (np.abs(p @ across) < 0.02) & (p @ away > 0.05) & (p @ away < reach - 0.02)
    full = np.median(lit[ground])
    assert ground[inside].sum() > 100
    assert np.mean(lit[inside & ground] < 0.05 * full) > 0.995
    assert np.mean(lit[ground & (outside > 0.02)] > 0.85 * full) > 0.995
    tip = (p @ away)[ground & (lit < 0.5 * full)].max()
    assert tip == pytest.approx(reach + (corners @ away).max(), abs=0.02)


def rays_from(mesh: Mesh):
    pytest.importorskip("embreex")
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    scene = EmbreeScene(robust=True)
    TriangleMesh(scene, mesh.vertices.astype(np.float32), mesh.triangles)
    return scene


def blocked(scene, origins: np.ndarray, toward: np.ndarray) -> np.ndarray:
    directions = np.broadcast_to(toward, origins.shape)
    return np.asarray(scene.run(origins.astype(np.float32), directions.astype(np.float32), query="INTERSECT")) >= 0


@pytest.mark.parametrize(
    ("kind", "azimuth", "elevation"), quick([("car", 70, 35), ("chair", 200, 55), ("bicycle", 300, 25)], ("chair", 200, 55))
)
def test_whole_pictures_are_lit_where_rays_reach_the_sun(kind, azimuth, elevation):
    from viewsphere_zoo import build

    mesh = build(kind, np.random.default_rng(2))
    mesh = flat(mesh.vertices[mesh.triangles], Material(roughness=1.0))  # facets: lit as their rays are
    size = float(np.linalg.norm(mesh.bounds[1] - mesh.bounds[0]))
    sun = Sun(azimuth=azimuth, elevation=elevation, angle_deg=0.53)
    view = camera(320, 240, 300, azimuth - 60, 28, 1.5 * size, mesh.bounds.mean(axis=0))
    stage = stage_of(
        [mesh], Scene(sun=sun, sky=DARK, ground=Ground(pattern="plain", color=(0.05, 0.05, 0.05)))
    )  # hardly lights what is shaded
    visible = rasterize(stage.at(0), view)
    light = np.empty((320 * 240, 4), np.float32)
    paint(stage.baked(0), view, visible, False, True, light)
    triangle = visible.triangle.reshape(-1)
    to, count = toward_sun(sun), len(mesh.triangles)
    normals = np.concatenate([stage.at(0).triangle_normals[: count + 2], [[0.0, 0.0, 1.0]]])
    normal = normals[triangle].astype(float)
    rays = pixel_rays(view.intrinsics).reshape(-1, 3)
    with np.errstate(divide="ignore", invalid="ignore"):
        place = view.center + (rays / visible.inverse_depth.reshape(-1, 1)) @ view.R
    near = (triangle >= 0) & (np.linalg.norm(place[:, :2], axis=1) < 1.5 * size)
    place, normal, light, triangle = place[near], normal[near], light[near, :3].sum(axis=1), triangle[near]
    normal *= np.where((normal * (view.center - place)).sum(1) < 0, -1, 1)[:, None]
    cosine = normal @ to
    shaded = cosine < 0
    start = place + 1e-4 * size * normal
    pixel = 0.75 * np.linalg.norm(place - view.center, axis=1)[:, None] / 300
    scene = rays_from(mesh)
    found = []
    spread = math.tan(math.radians(0.53))  # twice the sun's radius
    sides = np.linalg.svd(to[None])[2][1:]
    for a in range(8):
        turn = math.cos(a * math.pi / 4) * sides[0] + math.sin(a * math.pi / 4) * sides[1]
        shift = turn - normal * (normal @ turn)[:, None]
        found += [blocked(scene, start + pixel * shift, to), blocked(scene, start, to + spread * turn)]
    found.append(blocked(scene, start, to))
    found = np.array(found) | shaded
    certain = (found.all(axis=0) | ~found.any(axis=0)) & (np.abs(cosine) > 0.15)
    dark = found[-1]
    open_ = np.maximum(cosine, 0.15)
    full = np.where(triangle < count, 1.0, linear(np.array(0.05))) * sun.strength * sum(sun.color) / math.pi
    agrees = (light < 0.5 * full * open_) == dark
    assert certain.mean() > 0.75
    assert agrees[certain].mean() >= 0.995
    assert agrees[certain & (triangle < count)].mean() >= 0.99  # the objects themselves, whose parts shade one another


@pytest.mark.parametrize("height", quick([0.5, 1.0, 2.0, 5.0], 0.5, 2.0))
@pytest.mark.parametrize("kind", ["point", "spot", "area"])
def test_lamps_fall_off_with_the_square_of_the_distance(kind, height):
    """Light of the ground below a small lamp: strength / pi at one metre."""
    crumb = flat(cuboid((-0.5, -0.5, 0), (0.5, 0.5, 1)))
    at, down = (0.0, 2.5, height), (0.0, 2.5, -0.5)  # from the middle of the box
    lamp = {
        "point": PointLight(position=at, strength=3.0, radius=0.01),
        "spot": SpotLight(position=at, strength=3.0, radius=0.01, toward=down, angle_deg=30, blend=0.2),
        "area": AreaLight(position=at, strength=3.0, size=(0.02, 0.02), toward=down),
    }[kind]
    scene = Scene(sun=None, sky=DARK, lights=(lamp,), ground=Ground(pattern="plain", color=(1, 1, 1)))
    light, _ = light_of(crumb, scene, camera(3, 3, 3000, 180, 60, 8, (0, 2.5, 0)))
    below = height + 0.5
    assert light[1, 1] == pytest.approx(3.0 / math.pi / below**2, rel=0.01)


def test_a_large_area_lamp_follows_its_form_factor():
    """A square of 2 m at 1 m: four times the closed form of a corner (Lambert 1760), per the lamp's own radiance."""
    crumb = flat(cuboid((-0.5, -0.5, 0), (0.5, 0.5, 1)))
    lamp = AreaLight(position=(0.0, 2.5, 0.5), strength=2.0, size=(2.0, 2.0), toward=(0.0, 2.5, -0.5))
    scene = Scene(sun=None, sky=DARK, lights=(lamp,), ground=Ground(pattern="plain", color=(1, 1, 1)))
    light, _ = light_of(crumb, scene, camera(3, 3, 3000, 180, 60, 8, (0, 2.5, 0)))
    corner = (math.sqrt(2) * math.atan(1 / math.sqrt(2))) / (2 * math.pi)
    assert light[1, 1] == pytest.approx(4 * corner * lamp.strength / 4.0, rel=0.03)  # strength over its area is its radiance


def test_bytes_are_the_light_through_the_curve_and_colours_come_back():
    """Every byte as background, every byte as unlit texture: what comes out is what went in."""
    card = flat(quad((-0.8, 0, -0.8), (1.6, 0, 0), (0, 0, 1.6)))
    pixels = np.full((16, 16, 4), 255, np.uint8)
    pixels[..., :3] = np.arange(256).reshape(16, 16, 1)
    pixels[..., 1] = 255 - pixels[..., 0]
    uv = np.array([(0, 1), (1, 1), (1, 0), (0, 1), (1, 0), (0, 0)], np.float32)
    texture = Material(unlit=True, base_color_texture=Texture(0))
    shown = replace(card, materials=(texture,), images=(Image("all", pixels),), uv0=uv)
    finish = Finish(background=Background(color=(0, 0, 0)), view=ViewTransform(transform="raw"))
    seen = picture(shown, Scene(finish=finish), camera(16, 16, 10.0))
    assert np.array_equal(seen, pixels[..., :3])
    stage = stage_of([card], Scene())
    away = camera(4, 4, 40, 180, 0, 1, (0, -50, 0))
    for value in range(0, 256, 3):
        finish = Finish(background=Background(color=(value / 255, 1 - value / 255, 0.5)))
        seen = painted(stage, away, finish)
        assert (seen == [value, 255 - value, 128]).all()


@pytest.mark.slow
@pytest.mark.parametrize("antialias", [1, 4])
@pytest.mark.parametrize("azimuth", [0, 180, 20])
def test_transparent_layers_lie_over_one_another_as_they_stand(azimuth, antialias):
    colors = [(0.9, 0.1, 0.1, 0.5), (0.1, 0.9, 0.1, 0.3), (0.1, 0.1, 0.9, 0.7)]
    order = [2, 0, 1]  # they are not listed as they stand
    triangles = np.concatenate([quad((-1, 0.3 * k, -1), (2, 0, 0), (0, 0, 2)) for k in order])
    mesh = replace(
        flat(triangles),
        triangle_material=np.repeat([0, 1, 2], 2).astype(np.int32),
        materials=tuple(Material(unlit=True, base_color=colors[k], alpha_mode="BLEND") for k in order),
    )
    background = (0.2, 0.5, 0.8)
    scene = Scene(sun=None, finish=Finish(background=Background(color=background), view=ViewTransform(transform="raw")))
    seen = picture(mesh, scene, camera(20, 20, 60, azimuth, 0, 4, (0, 0.3, 0)), antialias=antialias)
    light = linear(np.array(background))
    for k in (2, 1, 0) if azimuth != 180 else (0, 1, 2):
        *color, alpha = colors[k]
        light = np.array(color) * alpha + light * (1 - alpha)
    assert np.abs(seen.astype(int) - np.round(255 * encoded(light))).max() <= 1


@pytest.mark.parametrize("antialias", [1, 4])
@pytest.mark.parametrize("wrap", ["clamp", "repeat", "mirror"])
def test_a_magnified_blended_texture_fades_from_texel_to_texel(wrap, antialias):
    """Four texels wide, clear, opaque, clear, clear: alpha falls to 0 at the middle of either neighbour, over nothing too."""
    pixels = np.zeros((1, 4, 4), np.uint8)
    pixels[0, :, :3], pixels[0, 1, 3] = 255, 255
    used = Material(unlit=True, alpha_mode="BLEND", base_color_texture=Texture(0, wrap_s=wrap))
    mesh = flat(quad((-1, 0, -1), (2, 0, 0), (0, 0, 2)), used)
    uv = (mesh.vertices[:, ::2] + 1) / 2
    mesh = replace(mesh, uv0=uv, images=(Image("spot", pixels),))
    background = (0.2, 0.5, 0.8)
    scene = Scene(sun=None, finish=Finish(background=Background(color=background), view=ViewTransform(transform="raw")))
    view = camera(100, 5, 200, 0, 0, 4, (0, 0, 0))  # 100 pixels are 2 metres
    seen = picture(mesh, scene, view, antialias=antialias)
    texel = (np.arange(100) + 0.5) / 25 - 0.5
    alpha = np.clip(1 - np.abs(texel - 1), 0, 1)[:, None]
    expected = 255 * encoded(alpha + linear(np.array(background)) * (1 - alpha))
    assert np.abs(seen.astype(int) - expected).max() <= 2


@pytest.mark.parametrize("lit", [pytest.param("sun", marks=pytest.mark.slow), "low sun", "sky"])
def test_a_catcher_darkens_as_the_ground_does(lit):
    """Over a plain background of the open ground's colour a catcher looks like the ground; light and ground are grey."""
    box = flat(cuboid((-0.4, -0.3, 0), (0.4, 0.3, 0.7)), Material(base_color=(0.5, 0.5, 0.5, 1)))
    even = Sky(zenith=(0.5, 0.5, 0.5), horizon=(0.5, 0.5, 0.5))
    scene = {
        "sun": Scene(sun=Sun(color=(1, 1, 1), angle_deg=3.0), sky=even),
        "low sun": Scene(sun=Sun(color=(1, 1, 1), elevation=20), sky=even),
        "sky": Scene(sun=None, sky=even),
    }[lit]
    view = camera(120, 90, 250, 20, 40, 4, (0, 0, 0.3))
    ground = Ground(pattern="plain", color=(0.5, 0.5, 0.5))
    plain = picture(box, scene.model_copy(update={"ground": ground, "finish": Finish(view=AS_IT_IS)}), view)
    irradiance = scene.sun.strength * math.sin(math.radians(scene.sun.elevation)) if scene.sun else 0.0
    colour = encoded(linear(np.full(3, 0.5)) * (0.5 + irradiance / math.pi))
    over = Finish(view=AS_IT_IS, background=Background(color=tuple(colour.tolist())))
    caught_scene = scene.model_copy(update={"ground": ground.model_copy(update={"catcher": True}), "finish": over})
    caught = picture(box, caught_scene, view)
    assert np.abs(plain.astype(int) - caught).max() <= 2
    assert plain.min() < 0.75 * 255 * colour[0]


@pytest.mark.parametrize("behind", [(0.9, 0.1, 0.1), (0.02, 0.02, 0.02), (0.8, 0.8, 0.8)])
def test_coloured_glass_tints_what_is_behind_it(even, behind):
    """One thin pane: what does not mirror lets each colour through by its tint, whatever the surroundings."""
    tint = np.array([0.7, 0.9, 0.4])
    glass = Material(base_color=(*tint, 1.0), roughness=0.0, transmission=1.0)
    triangles = np.concatenate([quad((-1, 0, -1), (2, 0, 0), (0, 0, 2)), quad((-2, 1, -2), (4, 0, 0), (0, 0, 4))])
    mesh = replace(
        flat(triangles),
        triangle_material=np.repeat([0, 1], 2).astype(np.int32),
        materials=(glass, Material(unlit=True, base_color=(*behind, 1.0))),
    )
    dark = even.model_copy(update={"strength": 0.0})
    light, seen = light_of(mesh, Scene(sun=None, sky=dark), camera(9, 9, 60, 0, 0, 4), ambient_occlusion="off")
    assert (seen < 2).all()
    assert light == pytest.approx(np.broadcast_to(0.96 * tint * behind / EXPOSURE, light.shape), rel=0.02)


@pytest.mark.parametrize("kind", ["point", "spot", "area"])
def test_the_ground_throws_back_the_light_of_lamps(kind):
    """The mean radiance of the ground as far around the targets as half their box is long."""
    plate = flat(quad((-0.05, -0.05, 0.8), (0, 0.1, 0), (0.1, 0, 0)), Material(roughness=1.0, specular=0.0))
    post = flat(cuboid((-0.01, -0.01, 0), (0.01, 0.01, 0.02)))
    at, down = (0.0, 0.0, 0.35), (0.0, 0.0, -0.4)  # from the middle of both, which is 0.4 m high
    lamp = {
        "point": PointLight(position=at, strength=2.0, radius=0.0),
        "spot": SpotLight(position=at, strength=2.0, radius=0.0, toward=down, angle_deg=160, blend=0.0),
        "area": AreaLight(position=at, strength=2.0, size=(1e-3, 1e-3), toward=down),
    }[kind]
    ground = Ground(pattern="plain", color=tuple(encoded(np.full(3, 0.5)).tolist()))
    stage = stage_of([plate, post], Scene(sun=None, sky=DARK, lights=(lamp,), ground=ground), ambient_occlusion="off")
    x = (np.arange(400) + 0.5) / 200 - 1
    square = (0.41 * x[:, None]) ** 2 + (0.41 * x) ** 2
    distance = 0.75**2 + square
    share = 0.75 / np.sqrt(distance) / distance * (0.75 / np.sqrt(distance) if kind == "area" else 1)
    expected = 0.5 * 2.0 * share[square <= 0.41**2].mean() / math.pi
    assert stage.baked(0).surrounding.lamps == pytest.approx(np.full(3, expected), rel=0.03)
