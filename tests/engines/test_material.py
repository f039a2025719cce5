"""What samples are made of: glTF materials and normal maps against the specification's formulas."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from material_blocks import FRONT, card, flat_image, made, packed, view_of

from viewsphere.assets.mesh import Image, Material, Texture
from viewsphere.codecs.srgb import linear
from viewsphere.model.scene import Ground
from viewsphere.model.thing import Repaint

NOISE = np.random.default_rng(2).integers(0, 256, (32, 32, 4)).astype(np.uint8)


def one(material, images=(), given=None, repaints=(), **options):
    """The rows of one sample in the middle of a card, as numbers."""
    mesh = card(material, images, **options)
    return {name: float(row[0]) for name, row in made(*packed(mesh, repaints=repaints), given or {}).items()}


def vector(found, first):
    return np.array([found[first + axis] for axis in "XYZ"])


def test_factors_without_textures():
    material = Material(
        base_color=(0.5, 0.25, 1.0, 0.5), metallic=0.3, roughness=0.6, emissive=(1, 2, 3), ior=1.33, specular=0.5,
        specular_color=(1, 0.5, 0.1), clearcoat=0.7, clearcoat_roughness=0.2, transmission=0.5, alpha_mode="BLEND",
    )  # fmt: skip
    found = one(material, given={"RED": 0.5, "ALPHA": 0.5})
    dielectric = (0.33 / 2.33) ** 2
    expected = {
        "RED": 0.25, "GREEN": 0.25, "BLUE": 1.0, "ALPHA": 0.25, "METAL": 0.3, "ROUGH": 0.6, "ER": 1, "EG": 2, "EB": 3,
        "F0R": dielectric * 0.5, "F0G": dielectric * 0.25, "F0B": dielectric * 0.05, "COAT": 0.7, "COAT_ROUGH": 0.2,
        "TRANSMISSION": 0.35, "UNLIT": 0, "GROUND": 0, "CATCHER": 0, "BLENDED": 1, "AO": 1,
    }  # fmt: skip
    assert {name: found[name] for name in expected} == pytest.approx(expected, rel=1e-5, abs=1e-7)
    np.testing.assert_allclose(vector(found, "N"), [0, -1, 0], atol=1e-6)
    np.testing.assert_allclose(vector(found, "C"), [0, -1, 0], atol=1e-6)


def test_reflectance_stays_below_one():
    assert one(Material(ior=0.0))["F0R"] == 1
    assert one(Material(ior=5.0, specular_color=(9, 1, 1)))["F0R"] == 1


@pytest.mark.parametrize(("mode", "alpha"), [("OPAQUE", 1.0), ("MASK", 1.0), ("BLEND", 0.5 * 100 / 255)])
def test_alpha_counts_where_it_blends(mode, alpha):
    material = Material(base_color=(1, 1, 1, 0.5), base_color_texture=Texture(0), alpha_mode=mode)
    assert one(material, [flat_image(9, 9, 9, 100)])["ALPHA"] == pytest.approx(alpha, abs=1e-4)


TEXTURED = Material(
    base_color=(0.5, 1, 1, 1), base_color_texture=Texture(0), metallic=0.8, roughness=0.5,
    metallic_roughness_texture=Texture(1),
    occlusion_texture=Texture(1), occlusion_strength=0.5, emissive=(2, 1, 1), emissive_texture=Texture(0), clearcoat=0.5,
    clearcoat_texture=Texture(1), clearcoat_roughness=0.4, clearcoat_roughness_texture=Texture(1), transmission=1.0,
    transmission_texture=Texture(1), specular=0.8, specular_texture=Texture(1), specular_color_texture=Texture(0),
)  # fmt: skip


@pytest.mark.parametrize("sizes", [(4, 4), (4, 8)])
def test_each_channel_multiplies_what_the_specification_says(sizes):
    color, data = (200, 100, 50), (60, 120, 180, 240)
    found = one(TEXTURED, [flat_image(*color, size=sizes[0]), flat_image(*data, size=sizes[1])])
    light, (r, g, b, a) = linear(np.array(color) / 255), np.array(data) / 255
    metal = 0.8 * b
    expected = {
        "RED": 0.5 * light[0], "GREEN": light[1], "BLUE": light[2], "ROUGH": 0.5 * g, "METAL": metal, "AO": 1 + 0.5 * (r - 1),
        "ER": 2 * light[0], "EG": light[1], "COAT": 0.5 * r, "COAT_ROUGH": 0.4 * g, "TRANSMISSION": r * (1 - metal),
        "F0R": 0.04 * light[0] * 0.8 * a, "F0B": 0.04 * light[2] * 0.8 * a,
    }  # fmt: skip
    assert {name: found[name] for name in expected} == pytest.approx(expected, rel=2e-3, abs=1e-5)


def test_without_coordinates_the_factors_stand_alone():
    material = replace(TEXTURED, normal_texture=Texture(0))
    found = one(material, [flat_image(9, 9, 9), flat_image(9, 9, 9)], uv=None)
    assert found["RED"] == 0.5
    assert found["ROUGH"] == pytest.approx(0.5)
    np.testing.assert_allclose(vector(found, "N"), [0, -1, 0], atol=1e-6)


def test_the_second_coordinates_are_read_where_a_texture_names_them():
    uv1 = np.tile(np.array([[0.25, 0.5]], np.float32), (4, 1))
    pixels = np.zeros((1, 2, 4), np.uint8)
    pixels[0, 0], pixels[0, 1] = (255, 0, 0, 255), (0, 255, 0, 255)
    material = Material(base_color_texture=Texture(0, texcoord=1))
    found = one(material, [Image("a", pixels)], {"U0": 0.75, "U1": 0.25}, uv1=uv1)
    assert (found["RED"], found["GREEN"]) == pytest.approx((1, 0), abs=1e-4)


def test_repaints_change_the_materials_they_name():
    images = [flat_image(255, 128, 128, 255)]
    material = Material(name="body_paint", metallic=1, roughness=1, metallic_roughness_texture=Texture(0))
    body = Repaint(material="body*", tint=(0.5, 0.25, 2), roughness=0.1)
    found = one(material, images, repaints=(Repaint(tint=(0, 0, 0)), body))
    assert (found["RED"], found["GREEN"], found["BLUE"], found["ROUGH"]) == pytest.approx((0.5, 0.25, 2, 0.1), abs=1e-4)
    assert found["METAL"] == pytest.approx(128 / 255, abs=1e-4)
    found = one(material, images, repaints=(body, Repaint(material="glass", metallic=0.5)))
    assert found["ROUGH"] == pytest.approx(0.1, abs=1e-4)
    found = one(material, images, repaints=(Repaint(metallic=0.5),))
    assert (found["METAL"], found["ROUGH"]) == pytest.approx((0.5, 128 / 255), abs=1e-4)


# Normal maps. Tilted to the right (+x) by 0.6 or up (+y) by 0.6.
RIGHT, UP = flat_image(204, 128, 230), flat_image(128, 204, 230)
UPRIGHT = ((0, 1), (1, 1), (1, 0), (0, 0))


def tilt(image, uv=UPRIGHT, given=None, options=None, **material):
    used = Material(normal_texture=Texture(0, **(options or {})), **material)
    return vector(one(used, [image], given, uv=uv), "N")


@pytest.mark.parametrize(
    ("image", "uv", "expected"),
    [
        (RIGHT, UPRIGHT, (0.6, -0.8, 0)),
        (UP, UPRIGHT, (0, -0.8, 0.6)),
        # u runs to the left: the image is mirrored, and so are its bumps.
        (RIGHT, ((1, 1), (0, 1), (0, 0), (1, 0)), (-0.6, -0.8, 0)),
        (UP, ((1, 1), (0, 1), (0, 0), (1, 0)), (0, -0.8, 0.6)),
        # v runs upwards.
        (RIGHT, ((0, 0), (1, 0), (1, 1), (0, 1)), (0.6, -0.8, 0)),
        (UP, ((0, 0), (1, 0), (1, 1), (0, 1)), (0, -0.8, -0.6)),
        # A quarter turn: u runs upwards, v to the right.
        (RIGHT, ((0, 0), (0, 1), (1, 1), (1, 0)), (0, -0.8, 0.6)),
        (UP, ((0, 0), (0, 1), (1, 1), (1, 0)), (-0.6, -0.8, 0)),
    ],
)
def test_normal_maps_follow_the_image(image, uv, expected):
    np.testing.assert_allclose(tilt(image, uv), expected, atol=4e-3)


def test_a_normal_map_turns_with_its_texture_transform():
    # By KHR_texture_transform, u' = v and v' = -u: the image's right lies down the card, its up to the card's right.
    np.testing.assert_allclose(tilt(RIGHT, options={"rotation": np.pi / 2}), (0, -0.8, -0.6), atol=4e-3)
    np.testing.assert_allclose(tilt(UP, options={"rotation": np.pi / 2}), (0.6, -0.8, 0), atol=4e-3)


def test_a_bump_is_a_dent_from_behind():
    back = {"VY": 1, "GY": 1, "NY": 1}
    np.testing.assert_allclose(tilt(RIGHT, given=back), (-0.6, 0.8, 0), atol=4e-3)


def test_the_frame_stands_on_the_smooth_normal():
    smooth = np.array([0.6, -0.8, 0.0])
    given = {"NX": smooth[0], "NY": smooth[1]}
    np.testing.assert_allclose(tilt(flat_image(128, 128, 255), given=given), smooth, atol=4e-3)
    across = np.array([0.8, 0.6, 0.0])
    np.testing.assert_allclose(tilt(RIGHT, given=given), 0.6 * across + 0.8 * smooth, atol=4e-3)
    np.testing.assert_allclose(tilt(UP, given=given), 0.6 * np.array([0, 0, 1]) + 0.8 * smooth, atol=4e-3)


def test_normal_scale_multiplies_x_and_y():
    expected = np.array([0.3, -0.8, 0])
    np.testing.assert_allclose(tilt(RIGHT, normal_scale=0.5), expected / np.linalg.norm(expected), atol=4e-3)


@pytest.mark.parametrize("uv", [((0, 0),) * 4, ((0, 0), (1, 0), (1, 0), (0, 0)), ((0.5, 1e-30),) * 4])
def test_degenerate_coordinates_leave_the_plain_normal(uv):
    np.testing.assert_allclose(tilt(RIGHT, uv), (0, -1, 0), atol=1e-5)


@pytest.mark.parametrize("texel", [(0, 0, 0), (127, 127, 128), (128, 128, 0)])
def test_texels_that_are_no_direction_are_level(texel):
    np.testing.assert_allclose(tilt(flat_image(*texel)), (0, -1, 0), atol=5e-3)


def test_a_normal_never_looks_away():
    view = np.array([[0.995, -0.0998, 0]])
    found = made(*packed(card(Material(normal_texture=Texture(0)), [flat_image(40, 128, 180)])), {"V": view})
    normal = np.array([found["N" + axis][0] for axis in "XYZ"])
    assert 0.005 < normal @ view[0] < 0.03
    assert np.linalg.norm(normal) == pytest.approx(1, abs=1e-5)


def test_the_coat_has_normals_of_its_own():
    images = [RIGHT, UP]
    coat = Material(normal_texture=Texture(0), clearcoat=1.0)
    found = one(coat, images)
    np.testing.assert_allclose(vector(found, "C"), (0, -1, 0), atol=1e-5)
    found = one(replace(coat, clearcoat_normal_texture=Texture(1)), images)
    np.testing.assert_allclose(vector(found, "N"), (0.6, -0.8, 0), atol=4e-3)
    np.testing.assert_allclose(vector(found, "C"), (0, -0.8, 0.6), atol=4e-3)


def test_bumps_too_small_to_see_become_roughness():
    """Normals of a known spread, seen from far away, against the width of the lobe they span: alpha^2 + 2 spread^2."""
    spread = 0.2
    x, y = np.random.default_rng(3).normal(0, spread, (2, 256, 256))
    normal = np.stack([x, y, np.ones_like(x)], -1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    pixels = np.concatenate([np.round(normal * 127.5 + 127.5), np.full((256, 256, 1), 255)], -1).astype(np.uint8)
    material = Material(normal_texture=Texture(0), roughness=0.3)
    far = one(material, [Image("bumps", pixels)], {"PIXEL": 2.0})
    expected = (0.3**4 + 2 * spread**2) ** 0.25
    assert far["ROUGH"] == pytest.approx(expected, rel=0.04)
    np.testing.assert_allclose(vector(far, "N"), (0, -1, 0), atol=0.01)
    near = one(material, [flat_image(204, 128, 230)], {"PIXEL": 2.0})
    assert near["ROUGH"] == pytest.approx(0.3, abs=1e-3)
    hidden = one(replace(material, normal_scale=0.5), [Image("bumps", pixels)], {"PIXEL": 2.0})
    assert hidden["ROUGH"] == pytest.approx((0.3**4 + 2 * (spread / 2) ** 2) ** 0.25, rel=0.04)


def test_a_block_of_many_materials_is_each_alone():
    """Runs of all lengths, textured and plain, share a block."""
    images = [Image("noise", NOISE), flat_image(204, 128, 230, size=32)]
    textured = Material(base_color_texture=Texture(0), normal_texture=Texture(1), roughness=0.4)
    mesh = replace(card(textured, images), materials=(textured, Material(base_color=(0.1, 0.2, 0.3, 1), roughness=0.9)))
    surfaces, textures = packed(mesh)
    which = np.repeat(np.arange(60) % 2, np.arange(60) % 40 + 1).astype(np.int32)
    rng = np.random.default_rng(5)
    given = {"U0": rng.uniform(0, 1, len(which)), "V0": rng.uniform(0, 1, len(which)), "PIXEL": rng.uniform(0, 0.2, len(which))}
    together = made(surfaces, textures, given, which=which)
    for kind in (0, 1):
        chosen = which == kind
        alone = made(surfaces, textures, {name: value[chosen] for name, value in given.items()}, which=kind)
        for name in ("RED", "ROUGH", "NX", "NZ", "AO", "F0R"):
            np.testing.assert_allclose(together[name][chosen], alone[name], atol=1e-6)


def test_the_ground_is_the_last_material_and_repeats_in_the_world(tmp_path):
    from PIL import Image as Pillow

    Pillow.fromarray(NOISE[..., :3]).save(tmp_path / "a.png")
    Pillow.fromarray(RIGHT.pixels[..., :3]).save(tmp_path / "n.png")
    ground = Ground(image=str(tmp_path / "a.png"), normal_image=str(tmp_path / "n.png"), color=(1, 1, 1), tile=0.5)
    surfaces, textures = packed(card(Material()), ground)
    up = {name: np.tile([0, 0, 1], (64, 1)) for name in "VGN"}
    x, y = np.random.default_rng(1).uniform(-3, 3, (2, 64))
    view = view_of([[1, 0, 0], [0, -1, 0], [0, 0, -1]])
    given = up | {"U0": x * 2, "V0": -y * 2, "PIXEL": 1e-4}
    found = made(surfaces, textures, given, which=len(surfaces.looks) - 1, view=view)
    assert (found["GROUND"] == 1).all()
    np.testing.assert_allclose([found["NX"], found["NZ"]], [[0.6] * 64, [0.8] * 64], atol=5e-3)
    far = made(surfaces, textures, given | {"PIXEL": 10.0}, which=len(surfaces.looks) - 1, view=view)
    np.testing.assert_allclose(far["RED"], linear(NOISE[..., 0] / 255).mean(), atol=1e-3)
    # From pixel to pixel the coordinates go 2 per metre: 64 texels, the sixth level, at a metre a pixel.
    textures.texels[:] = 0
    bundle = surfaces.bundles[-1, 0]
    start, width, height = textures.levels[bundle, 3]
    textures.texels[start : start + width * height * 4 * textures.modes[bundle, 5]] = 65535
    found = made(surfaces, textures, given | {"PIXEL": np.array([2**3 / 64] * 64)}, which=len(surfaces.looks) - 1, view=view)
    np.testing.assert_allclose(found["RED"], 1, atol=3e-3)


def test_lenses_and_pinholes_agree_in_the_middle():
    surfaces, textures = packed(card(Material(base_color_texture=Texture(0)), [Image("noise", NOISE)]))
    v = np.array([0.5, -0.7, 0.5]) / np.linalg.norm([0.5, -0.7, 0.5])
    right = np.cross([0, 0, 1], -v)
    right /= np.linalg.norm(right)
    given = {"V": v[None], "PIXEL": np.array([0.2]), "U0": 0.3}
    pinhole = made(surfaces, textures, given, view=view_of([right, np.cross(-v, right), -v]))
    lens = made(surfaces, textures, given, view=view_of(FRONT.rotation, rays=np.ones((1, 3))))
    assert lens["RED"][0] == pytest.approx(pinhole["RED"][0], abs=2e-3)
