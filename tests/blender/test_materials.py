"""Materials and meshes in Cycles: against closed forms, against truth's cut-outs and against the raster engine.

All scenes are rendered once, by one Blender.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from blender_scenes import UPRIGHT, Scene, ball, camera, card, flat_image, raster_stage, rectangle, rendered

from viewsphere.assets.mesh import WRAPS, Image, Material, Texture
from viewsphere.codecs.exr import encode_exr
from viewsphere.codecs.srgb import encoded
from viewsphere.engines.raster.shading.painting import paint
from viewsphere.model import scene as model
from viewsphere.rendering.view import EXPOSURE
from viewsphere.truth.raster.visibility import rasterize

pytestmark = pytest.mark.slow

SCENES: dict[str, Scene] = {}
CLOSE = camera((4, 4), 8.0)
COLOR = (0.8, 0.4, 0.1, 1.0)
NOISE = Image("noise", np.random.default_rng(1).integers(0, 256, (4, 4, 4), np.uint8))


def unlit(texture=None, color=(1.0, 1.0, 1.0, 1.0), **fields):
    return Material(base_color=color, base_color_texture=texture, unlit=True, **fields)


def matte(**fields):
    """What only scatters."""
    return Material(roughness=1.0, specular=0.0, **fields)


@pytest.fixture(scope="module")
def seen(tmp_path_factory):
    return rendered(SCENES, tmp_path_factory.mktemp("blender"))


def middle(picture):
    """The mean colour there."""
    height, width = picture.shape[:2]
    part = picture[height * 3 // 8 : -(height * 3 // 8), width * 3 // 8 : -(width * 3 // 8)]
    return part.reshape(-1, 4)[:, :3].mean(axis=0)


# What surfaces do with light.

WHITE = (1.0, 1.0, 1.0, 1.0)
FURNACE = {
    "matte": matte(base_color=WHITE),
    "dielectric": Material(base_color=WHITE, roughness=0.5),
    "metal": Material(base_color=WHITE, roughness=0.3, metallic=1.0),
    "coated": Material(base_color=WHITE, roughness=0.6, clearcoat=1.0, clearcoat_roughness=0.2),
    "glass": Material(base_color=WHITE, roughness=0.0, transmission=1.0),
    "solid glass": Material(base_color=WHITE, roughness=0.0, transmission=1.0, thickness=0.01),
}
for name, material in FURNACE.items():
    SCENES[f"furnace {name}"] = Scene((ball(material),), camera((16, 16), 16.0, distance=4))


@pytest.mark.parametrize("name", FURNACE)
def test_a_white_ball_vanishes_in_a_white_world(seen, name):
    np.testing.assert_allclose(middle(seen[f"furnace {name}"]), 1, atol=0.02)


SCENES["emission"] = Scene((card(matte(base_color=(0, 0, 0, 1), emissive=(0.5, 0.25, 2.0))),), CLOSE)
SCENES["unlit"] = Scene((card(unlit(color=COLOR)),), CLOSE, sky=0.3)


def test_emission_is_radiance(seen):
    np.testing.assert_allclose(middle(seen["emission"]), (0.5, 0.25, 2.0), rtol=1e-4)


def test_unlit_colours_are_shown_as_they_are(seen):
    np.testing.assert_allclose(middle(seen["unlit"]) * EXPOSURE, COLOR[:3], rtol=1e-4)


GLASS = Material(base_color=COLOR, transmission=1.0, roughness=0.0)
CASTERS = {
    "nothing": None,
    "opaque": matte(base_color=(0, 0, 0, 1)),
    "unlit": unlit(),
    "glass": GLASS,
    "solid glass": replace(GLASS, thickness=0.01),
    "half": matte(base_color=(0, 0, 0, 0.5), alpha_mode="BLEND"),
}
FLOOR = rectangle((-2, -2, -1), (4, 0, 0), (0, 4, 0), matte(base_color=(0.1, 0.1, 0.1, 1)))  # lights little itself
for name, material in CASTERS.items():
    # On the way from where the camera looks to the sun.
    caster = () if material is None else (rectangle((-0.5, -1.0, 0.0), (1, 0, 0), (0, 0.5, 0), material),)
    SCENES[f"shadow {name}"] = Scene(
        (FLOOR, *caster),
        camera((4, 4), 40.0, azimuth=90, elevation=40, distance=3, target=(0, 0, -1)),
        sky=0.0,
        sun=(0.0, -0.6, 0.8),
        samples=32,
    )


def test_shadows_are_as_light_as_what_casts_them(seen):
    lit = 0.1 * 0.8 / math.pi
    np.testing.assert_allclose(middle(seen["shadow nothing"]), lit, rtol=1e-3)
    np.testing.assert_allclose(middle(seen["shadow opaque"]), 0, atol=1e-4)
    np.testing.assert_allclose(middle(seen["shadow half"]), lit / 2, rtol=0.02)
    for glass in ("shadow glass", "shadow solid glass"):
        np.testing.assert_allclose(middle(seen[glass]), lit * (1 - fresnel(0.8, 1.5)) * np.array(COLOR[:3]), rtol=0.02)


def test_unlit_surfaces_cast_shadows_and_light_nothing(seen):
    np.testing.assert_allclose(middle(seen["shadow unlit"]), 0, atol=1e-4)


def fresnel(cosine, ior):
    """Of unpolarised light that enters a dielectric."""
    inside = math.sqrt(1 - (1 - cosine**2) / ior**2)
    across = (cosine - ior * inside) / (cosine + ior * inside)
    along = (inside - ior * cosine) / (inside + ior * cosine)
    return (across**2 + along**2) / 2


GREY = unlit(color=(0.7, 0.7, 0.7, 1))
VEIL = card(matte(base_color=(0, 0, 0, 0.25), alpha_mode="BLEND"))
SCENES["through glass"] = Scene((card(GLASS), card(GREY, y=0.5)), CLOSE, sky=0.0, samples=256)
SCENES["through its back"] = Scene((card(GLASS), card(GREY, y=-0.5)), camera((4, 4), 8.0, azimuth=180), sky=0.0, samples=256)
for name, material in {
    "amber": GLASS,
    "textured amber": replace(GLASS, base_color=WHITE, base_color_texture=Texture(0)),
    "grey": replace(GLASS, base_color=(0.4, 0.4, 0.4, 1)),
}.items():
    amber = card(material, images=[flat_image(231, 170, 89)])
    SCENES[f"cut out {name}"] = Scene((amber,), CLOSE, transparent=True, samples=256)
SCENES["through a veil"] = Scene((VEIL, card(GREY, y=0.5)), CLOSE, sky=0.0, samples=256)
SCENES["veil"] = Scene((VEIL,), CLOSE, sky=0.0, transparent=True, samples=64)


RIGHT = rectangle((0, 4, -6), (6, 0, 0), (0, 0, 12), GREY)
for name, thickness in (("thin ball", 0.0), ("solid ball", 0.01)):
    one = ball(replace(GLASS, base_color=WHITE, thickness=thickness))
    SCENES[name] = Scene((one, RIGHT), camera((16, 16), 20.0, distance=4), sky=0.0, samples=64)


def test_a_solid_ball_shows_its_background_the_other_way_round(seen):
    """Behind its right half there is a card."""
    thin, solid = (seen[name][6:10, 5:11, :3].mean(axis=(0, 2)) for name in ("thin ball", "solid ball"))
    assert thin[:2].max() < 0.05
    assert thin[-2:].min() > 0.5
    assert solid[:2].min() > 0.5
    assert solid[-2:].max() < 0.05


@pytest.mark.parametrize("name", ["through glass", "through its back"])
def test_thin_glass_tints_what_is_straight_behind_it(seen, name):
    np.testing.assert_allclose(middle(seen[name]), 0.96 * np.array(COLOR[:3]), rtol=0.02)


@pytest.mark.parametrize(
    ("name", "color"), [("amber", COLOR[:3]), ("textured amber", (0.8, 0.4, 0.1)), ("grey", (0.4, 0.4, 0.4))]
)
def test_thin_glass_keeps_its_colour_without_a_background(seen, name, color):
    picture = seen[f"cut out {name}"]
    before_white = picture[..., :3] + (1 - picture[..., 3:])
    np.testing.assert_allclose(before_white.mean(axis=(0, 1)), 0.96 * np.array(color) + 0.04, rtol=0.03)
    assert picture[..., 3].mean() == pytest.approx(1 - 0.96 * min(color), abs=0.02)


def test_blended_surfaces_cover_by_their_alpha(seen):
    np.testing.assert_allclose(middle(seen["through a veil"]), 0.75, atol=0.02)
    assert seen["veil"][..., 3].mean() == pytest.approx(0.25, abs=0.02)


# Textures, texel by texel.

PICTURE = Image("picture", NOISE.pixels | np.array([0, 0, 0, 255], np.uint8))
WIDE = np.array(UPRIGHT, np.float32) * 3 - 1
LOOKUPS = {f"{s} {t}": Texture(0, wrap_s=s, wrap_t=t, nearest=True) for s, t in product(WRAPS, WRAPS)} | {
    "second set": Texture(0, texcoord=1, nearest=True),
    "offset": Texture(0, nearest=True, offset=(0.25, -0.5)),
    "scale": Texture(0, nearest=True, scale=(0.5, 2.0), offset=(0.06, 0.06)),
    "turned": Texture(0, nearest=True, rotation=0.5, scale=(1.0, 0.75), offset=(0.3, 0.1)),
    "mirrored": Texture(0, nearest=True, scale=(-1.0, 1.0), wrap_s="mirror", wrap_t="clamp"),
}
for name, texture in LOOKUPS.items():
    papered = card(unlit(texture), size=12.0, uv=WIDE, uv1=WIDE[:, ::-1].copy(), images=[PICTURE])
    SCENES[f"texels {name}"] = Scene((papered,), camera((12, 12), 1.0), sharp=True, samples=4)


def texel_at(image, texture, uv):
    """The texels (N, 4) that coordinates (N, 2) lie in, and whether they lie well inside of them."""
    place = uv @ texture.matrix[:, :2].T + texture.matrix[:, 2]
    size = np.array(image.pixels.shape[1::-1])
    place = np.stack([wrapped(place[:, k], wrap) for k, wrap in enumerate((texture.wrap_s, texture.wrap_t))], axis=1) * size
    column, row = np.clip(np.floor(place), 0, size - 1).astype(int).T
    return image.pixels[row, column], (np.abs(place - np.round(place)) > 0.03).all(axis=1)


def wrapped(x, wrap):
    if wrap == "clamp":
        return np.clip(x, 0.05, 0.95)  # in the middle of the first or last of four texels
    return x % 1 if wrap == "repeat" else 1 - np.abs(x % 2 - 1)


@pytest.mark.parametrize("name", LOOKUPS)
def test_texels_are_where_gltf_says(seen, name):
    texture = LOOKUPS[name]
    row, column = np.mgrid[0:12, 0:12].reshape(2, -1)
    uv = np.stack([(column + 0.5) / 4 - 1, (row + 0.5) / 4 - 1], axis=1)
    expected, is_inside = texel_at(PICTURE, texture, uv[:, ::-1] if texture.texcoord else uv)
    found = np.round(encoded(seen[f"texels {name}"].reshape(-1, 4)[:, :3] * EXPOSURE) * 255)
    assert is_inside.mean() > 0.4
    np.testing.assert_array_equal(found[is_inside], expected[is_inside, :3])


TINT = np.tile(np.float32([1.0, 0.5, 0.1, 1.0]), (4, 1))
SECOND = replace(unlit(Texture(0, texcoord=1)), normal_texture=Texture(0, texcoord=1))
HALVES = {"materials": (unlit(color=(1, 0, 0, 1)), unlit(color=(0, 1, 0, 1))), "triangle_material": np.int32([1, 0])}
CLEAR = flat_image(200, 100, 50, 0)
SCENES["vertex colours"] = Scene((card(unlit(color=(0.25, 0.5, 1.0, 1.0)), colors=TINT),), CLOSE)
SCENES["no coordinates"] = Scene((card(SECOND, images=[flat_image(9, 9, 9)]),), CLOSE)
SCENES["two materials"] = Scene((card(Material(), **HALVES),), camera((4, 4), 2.0), sharp=True)
SCENES["clear colours"] = Scene((card(unlit(Texture(0)), images=[CLEAR]),), CLOSE)


def test_vertex_colours_multiply(seen):
    np.testing.assert_allclose(middle(seen["vertex colours"]) * EXPOSURE, (0.25, 0.25, 0.1), rtol=1e-4)


def test_textures_without_coordinates_do_not_count(seen):
    np.testing.assert_allclose(middle(seen["no coordinates"]) * EXPOSURE, 1, rtol=1e-4)


def test_colours_under_clear_texels_stay(seen):
    found = np.round(encoded(middle(seen["clear colours"]) * EXPOSURE) * 255)
    assert found.tolist() == [200, 100, 50]


def test_every_triangle_has_its_own_material(seen):
    red, green, _, _ = np.moveaxis(seen["two materials"], -1, 0) > 0.1
    # The first triangle, the lower right one, has the second material. The other corners lie on both.
    beside = np.fliplr(~np.eye(4, dtype=bool))
    np.testing.assert_array_equal(green[beside], np.fliplr(np.tri(4, k=-1))[beside])
    np.testing.assert_array_equal(red[beside], ~green[beside])


HOLES = Material(
    base_color=(1, 1, 1, 0.9),
    base_color_texture=Texture(0, rotation=0.4, scale=(2.3, 1.7), wrap_t="mirror"),
    alpha_mode="MASK",
    alpha_cutoff=0.45,
)
HOLED = card(HOLES, images=[NOISE], colors=np.linspace(0.4, 1, 16, dtype=np.float32).reshape(4, 4))
ASKEW = camera((64, 48), 60.0, azimuth=25, elevation=20, distance=2.6)
SCENES["holes"] = Scene((HOLED,), ASKEW, transparent=True, sharp=True, samples=4)


def test_cut_outs_end_where_labels_do(seen):
    truth = rasterize(raster_stage(HOLED, model.Scene()).at(0), ASKEW).triangle >= 0
    assert 0.1 < truth.mean() < 0.6
    alpha = seen["holes"][..., 3]
    # The rays of a sharp picture still differ by a hundredth of a pixel.
    assert (np.isin(np.round(alpha, 3), (0, 1)) & ((alpha > 0.5) == truth)).mean() > 0.998


# Normals.

RIGHT, UP = flat_image(204, 128, 230), flat_image(128, 204, 230)  # tilted to the right or up by 0.6
LIGHT = np.array((0.4, -0.8, 0.2)) / math.sqrt(0.84)
BUMPS = {
    "right": (RIGHT, UPRIGHT, {}, (0.6, -0.8, 0)),
    "up": (UP, UPRIGHT, {}, (0, -0.8, 0.6)),
    # u runs to the left: the image is mirrored, and so are its bumps.
    "right, u mirrored": (RIGHT, ((1, 1), (0, 1), (0, 0), (1, 0)), {}, (-0.6, -0.8, 0)),
    "up, u mirrored": (UP, ((1, 1), (0, 1), (0, 0), (1, 0)), {}, (0, -0.8, 0.6)),
    "up, v upwards": (UP, ((0, 0), (1, 0), (1, 1), (0, 1)), {}, (0, -0.8, -0.6)),
    # A quarter turn: u runs upwards, v to the right.
    "right, turned": (RIGHT, ((0, 0), (0, 1), (1, 1), (1, 0)), {}, (0, -0.8, 0.6)),
    "up, turned": (UP, ((0, 0), (0, 1), (1, 1), (1, 0)), {}, (-0.6, -0.8, 0)),
    # By KHR_texture_transform, u' = v and v' = -u.
    "right, texture turned": (RIGHT, UPRIGHT, {"rotation": math.pi / 2}, (0, -0.8, -0.6)),
    "up, texture turned": (UP, UPRIGHT, {"rotation": math.pi / 2}, (0.6, -0.8, 0)),
    "right, texture mirrored": (RIGHT, UPRIGHT, {"scale": (-2.0, 1.0)}, (-0.6, -0.8, 0)),
    "up, texture upside down": (UP, UPRIGHT, {"scale": (1.0, -3.0)}, (0, -0.8, -0.6)),
    "level": (flat_image(128, 128, 255), UPRIGHT, {}, (0, -1, 0)),
}
for name, (image, uv, options, _) in BUMPS.items():
    bumpy = card(matte(base_color=WHITE, normal_texture=Texture(0, **options)), uv=uv, images=[image])
    SCENES[f"bump {name}"] = Scene((bumpy,), CLOSE, sky=0.0, sun=tuple(LIGHT))
WEAK = card(matte(base_color=WHITE, normal_texture=Texture(0), normal_scale=0.5), images=[RIGHT])
SCENES["weak bump"] = Scene((WEAK,), CLOSE, sky=0.0, sun=tuple(LIGHT))
BACKWARDS = card(matte(base_color=WHITE, normal_texture=Texture(0)), images=[RIGHT])
BACKWARDS = replace(BACKWARDS, triangles=BACKWARDS.triangles[:, ::-1].copy())
SCENES["backwards bump"] = Scene((BACKWARDS,), CLOSE, sky=0.0, sun=tuple(LIGHT))
BEHIND = LIGHT * (1, -1, 1)
DENT = card(matte(base_color=WHITE, normal_texture=Texture(0)), images=[RIGHT])
SCENES["dent"] = Scene((DENT,), camera((4, 4), 8.0, azimuth=180), sky=0.0, sun=tuple(BEHIND))


def lambert(normal, light=LIGHT):
    return max(float(np.dot(normal, light)), 0) / np.linalg.norm(normal) / math.pi


@pytest.mark.parametrize("name", BUMPS)
def test_normal_maps_follow_the_image(seen, name):
    np.testing.assert_allclose(middle(seen[f"bump {name}"]), lambert(BUMPS[name][3]), rtol=0.015)


def test_normal_scale_multiplies_x_and_y(seen):
    np.testing.assert_allclose(middle(seen["weak bump"]), lambert((0.3, -0.8, 0)), rtol=0.015)


def test_bumps_do_not_mind_the_winding(seen):
    np.testing.assert_allclose(middle(seen["backwards bump"]), lambert((0.6, -0.8, 0)), rtol=0.015)


def test_a_bump_is_a_dent_from_behind(seen):
    np.testing.assert_allclose(middle(seen["dent"]), lambert((-0.6, 0.8, 0), BEHIND), rtol=0.015)


PLAIN = card(matte(base_color=WHITE))
SMOOTH = np.tile(np.float32([0.6, -0.8, 0]), (4, 1))
NORMALS = {
    "smooth": (replace(PLAIN, normals=SMOOTH), (0.6, -0.8, 0)),
    "wound the other way": (replace(PLAIN, normals=SMOOTH, triangles=PLAIN.triangles[:, ::-1].copy()), (0.6, -0.8, 0)),
    "turned to the back": (replace(PLAIN, normals=-SMOOTH), (0.6, -0.8, 0)),
    "missing": (replace(PLAIN, normals=np.zeros((4, 3), np.float32)), (0, -1, 0)),
    "no numbers": (replace(PLAIN, normals=np.full((4, 3), np.nan, np.float32)), (0, -1, 0)),
}
for name, (mesh, _) in NORMALS.items():
    SCENES[f"normals {name}"] = Scene((mesh,), CLOSE, sky=0.0, sun=tuple(LIGHT))


@pytest.mark.parametrize("name", NORMALS)
def test_normals_stand_on_the_seen_side(seen, name):
    np.testing.assert_allclose(middle(seen[f"normals {name}"]), lambert(NORMALS[name][1]), rtol=1e-3)


# The raster engine shows the same.

TEXELS = Texture(0, nearest=True)
EVEN = camera((32, 32), 40.0, azimuth=20, elevation=30, distance=2.6)
LIKE_RASTER = {
    "matte": Material(base_color=COLOR, roughness=1.0),
    "plastic": Material(base_color=COLOR, roughness=0.4),
    "metal": Material(base_color=COLOR, roughness=0.3, metallic=1.0),
    "half metal": Material(base_color=COLOR, roughness=0.5, metallic=0.5),
    "little specular": Material(base_color=COLOR, roughness=0.4, specular=0.5),
    "high ior": Material(base_color=COLOR, roughness=0.4, ior=2.0),
    "tinted metal": Material(base_color=COLOR, roughness=0.4, metallic=1.0, specular_color=(1, 0.2, 0)),
    "coated": Material(base_color=COLOR, clearcoat=1.0, clearcoat_roughness=0.1),
    "coated metal": Material(base_color=COLOR, roughness=0.5, metallic=1.0, clearcoat=0.7, clearcoat_roughness=0.5),
    "glowing": Material(base_color=COLOR, emissive=(0.5, 0.25, 2.0)),
    "glass": Material(base_color=COLOR, roughness=0.0, transmission=1.0),
    "milky glass": Material(base_color=COLOR, roughness=0.5, transmission=1.0),
    "half glass": Material(base_color=COLOR, roughness=0.2, transmission=0.5),
    "coated glass": Material(base_color=COLOR, roughness=0.0, transmission=1.0, clearcoat=1.0),
    "blended": Material(base_color=(0.8, 0.4, 0.1, 0.3), alpha_mode="BLEND"),
    "unlit": unlit(color=COLOR),
    "unlit blended": unlit(color=(0.8, 0.4, 0.1, 0.5), alpha_mode="BLEND"),
    "textured": Material(base_color_texture=TEXELS, metallic_roughness_texture=Texture(1, nearest=True), metallic=0.5),
    "glowing texture": Material(emissive=(1, 0.5, 2), emissive_texture=TEXELS),
    "textured coat": Material(clearcoat=1.0, clearcoat_texture=TEXELS, clearcoat_roughness_texture=TEXELS),
    "textured specular": Material(specular_texture=TEXELS, specular_color_texture=TEXELS, ior=1.8),
    "textured glass": Material(base_color=COLOR, transmission=1.0, transmission_texture=TEXELS, roughness=0.0),
}
DATA = Image("data", NOISE.pixels // 2)  # not so rough that the engines' light between the facets would differ
for name, material in LIKE_RASTER.items():
    SCENES[f"even {name}"] = Scene((card(material, images=[NOISE, DATA]),), EVEN, samples=24)
REPAINTED = Material(base_color=COLOR, metallic_roughness_texture=Texture(1), metallic=0.5)
FIXED = {"fixed_metallic": 1.0, "fixed_roughness": 0.3}
SCENES["repainted"] = replace(SCENES["even metal"], meshes=(card(REPAINTED, images=[NOISE, DATA]),), fixed=FIXED)


@pytest.fixture(scope="module")
def even_sky(tmp_path_factory):
    file = tmp_path_factory.mktemp("sky") / "even.exr"
    file.write_bytes(encode_exr(np.ones((16, 32, 3), np.float32)))
    return model.Scene(sun=None, sky=model.Environment(file=str(file)))


@pytest.mark.parametrize("name", LIKE_RASTER)
def test_the_raster_engine_shows_the_same(seen, even_sky, name):
    scene = SCENES[f"even {name}"]
    stage = raster_stage(scene.meshes[0], even_sky)
    radiance = np.empty((EVEN.width * EVEN.height, 4), np.float32)
    visible = rasterize(stage.at(0), EVEN)
    paint(stage.baked(0), EVEN, visible, False, True, radiance)
    inner = np.zeros((EVEN.height, EVEN.width), bool)
    inner[8:24, 8:24] = True
    expected = radiance[inner.reshape(-1), :3].mean(axis=0)
    np.testing.assert_allclose(seen[f"even {name}"][inner][:, :3].mean(axis=0), expected, rtol=0.03, atol=0.003)


def test_repaints_stand_for_factors_and_textures(seen):
    np.testing.assert_allclose(seen["repainted"].mean(axis=(0, 1)), seen["even metal"].mean(axis=(0, 1)), rtol=0.01)
