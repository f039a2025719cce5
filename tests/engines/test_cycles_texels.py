"""Pictures of models that are no finer than a frame can show: closed forms, and what Cycles makes of them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from cycles_scenes import asked

from shots import still_shot
from viewsphere.assets.mesh import Image, Material, Mesh, Texture
from viewsphere.codecs.srgb import encoded
from viewsphere.engines import cycles
from viewsphere.engines.shared.blender.texels import BUMPED, CONTENTS, FINEST, Kind, halved, spread_of
from viewsphere.geometry.camera import orbit_center, orbit_rotation
from viewsphere.model.instant import Viewpoint
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Scene
from viewsphere.model.sensors.camera import Camera, Intrinsics
from viewsphere.model.thing import Motion, Repaint, Thing
from viewsphere.truth.raster.visibility import rasterize

RNG = np.random.default_rng(5)
SPEC = ModelSpec(key="model", source="memory", category="thing", category_id=1)
PLACED = Thing(id=1, model=SPEC)
TURNED = Thing(id=2, model=SPEC, motion=Motion.still(((0, -1, 0, 3), (1, 0, 0, 1), (0, 0, 1, 2), (0, 0, 0, 1))))
SIDE, RADIUS = 2.0, math.sqrt(2)
CORNERS = np.array([(-1, 0, -1), (1, 0, -1), (1, 0, 1), (-1, 0, 1)], np.float32)
UPRIGHT = np.array([(0, 1), (1, 1), (1, 0), (0, 0)], np.float32)


def picture(width=256, height=256, alpha=255) -> Image:
    pixels = RNG.integers(0, 256, (height, width, 4), np.uint8)
    pixels[..., 3] = alpha
    return Image("picture", pixels)


def square(material: Material, *images: Image, uv=UPRIGHT, **fields) -> Mesh:
    """Upright, two metres a side, around the origin."""
    return Mesh(
        **{
            "vertices": CORNERS,
            "triangles": np.array([(0, 1, 2), (0, 2, 3)], np.int32),
            "normals": np.tile(np.float32([0, -1, 0]), (4, 1)),
            "triangle_material": np.zeros(2, np.int32),
            "triangle_part": np.zeros(2, np.int32),
            "materials": (material,),
            "uv0": np.array(uv, np.float32),
            "images": images,
            **fields,
        }
    )


def view(distance: float, focal=100.0, size=2, placed=PLACED) -> Camera:
    """A few pixels around the axis: no ray is oblique."""
    rotation = orbit_rotation(0.4, 0.3)
    middle = np.array(placed.world_from_object)[:3, 3]
    lens = Intrinsics(width=size, height=size, fx=focal, fy=focal, cx=size / 2, cy=size / 2)
    return Camera(lens, rotation, -rotation @ (middle + orbit_center(0.4, 0.3, distance)))


def level(mesh: Mesh, camera: Camera, name="base_color_texture", things=(PLACED,), repaints=()) -> int:
    (row,) = Kind(mesh, repaints, True, things).levels([camera])
    return row[list(CONTENTS).index(name)]


def halvings(texels: float, distance: float, focal=100.0) -> int:
    """Of a picture with so many texels a metre."""
    pixels = focal * (1 + 2 / focal**2) / (distance - RADIUS)
    return max(math.floor(math.log2(texels / pixels / FINEST)), 0)


COLORED = Material(base_color_texture=Texture(0))


@pytest.mark.parametrize("distance", [1.5, 2.1, 4.3, 9.0, 30.0])
def test_as_many_texels_are_left_as_a_pixel_shows(distance):
    mesh = square(COLORED, picture())
    expected = min(halvings(256 / SIDE, distance), 8)
    assert level(mesh, view(distance)) == expected
    # Each halving more would leave too few, each less would leave twice as many as needed.
    left = 256 / SIDE / 2**expected * (distance - RADIUS) / (100 + 2 / 100)
    assert expected == 0 or left >= FINEST
    assert expected == 8 or left < 2 * FINEST


def test_the_nearest_of_the_things_counts():
    mesh = square(COLORED, picture())
    both = level(mesh, view(9.0), things=(PLACED, TURNED))
    near = np.linalg.norm(view(9.0).center - np.array((3, 1, 2)))
    assert both == halvings(256 / SIDE, min(9.0, near))
    assert level(mesh, view(1.4)) == 0  # within the ball around it


def test_the_way_with_fewest_texels_counts():
    assert level(square(COLORED, picture(512, 128)), view(9.0)) == halvings(128 / SIDE, 9.0)
    stretched = replace(COLORED, base_color_texture=Texture(0, scale=(4.0, 2.0), rotation=0.7))
    assert level(square(stretched, picture()), view(9.0)) == halvings(2 * 256 / SIDE, 9.0)
    sheared = square(COLORED, picture(), uv=UPRIGHT @ np.float32([[1, 0], [3, 1]]))
    fewest = np.linalg.svd([[1, 3], [0, 1]], compute_uv=False)[1]
    assert level(sheared, view(9.0)) == halvings(fewest * 256 / SIDE, 9.0)


@pytest.mark.parametrize(
    "mesh",
    [
        square(replace(COLORED, alpha_mode="MASK"), picture(alpha=RNG.integers(0, 256, (256, 256)))),
        square(replace(COLORED, alpha_mode="BLEND"), picture(alpha=RNG.integers(0, 256, (256, 256)))),
        square(COLORED, picture(), uv=np.full((4, 2), 0.3)),
        square(replace(COLORED, base_color_texture=Texture(0, wrap_s="clamp", wrap_t="clamp")), picture(), uv=UPRIGHT + 1),
        square(replace(COLORED, base_color_texture=Texture(0, wrap_s="clamp")), picture()),
        square(replace(COLORED, base_color_texture=Texture(0, texcoord=1)), picture()),
        square(COLORED, picture(255, 256)),
    ],
    ids=["mask", "blend", "palette", "border", "two wraps", "no coordinates", "odd"],
)
def test_what_a_mean_would_change_stays(mesh):
    assert level(mesh, view(60.0)) == 0


def test_opaque_cut_outs_and_slivers_do_not_matter():
    assert level(square(replace(COLORED, alpha_mode="MASK"), picture()), view(9.0)) > 0
    sliver = {"triangles": np.array([(0, 1, 2), (0, 2, 3), (1, 1, 2)], np.int32), "triangle_material": np.zeros(3, np.int32)}
    assert level(square(COLORED, picture(), **sliver, triangle_part=np.zeros(3, np.int32)), view(9.0)) > 0


def test_texels_are_means_of_light():
    checks = np.zeros((4, 8, 4), np.uint8)
    checks[::2, ::2] = checks[1::2, 1::2] = 255
    for content, mean in (("color", round(255 * float(encoded(0.5)))), ("data", 128)):
        assert (halved(checks, 1, content)[..., :3] == mean).all()
        assert (halved(checks, 1, content)[..., 3] == 128).all()
        np.testing.assert_array_equal(halved(checks, 2, content), np.tile(halved(checks, 1, content)[:1, :1], (1, 2, 1)))
    flat = np.full((512, 4, 4), (200, 100, 50, 255), np.uint8)
    for content in ("color", "data"):
        np.testing.assert_array_equal(halved(flat, 2, content), flat[:128, :1])


def test_bumps_become_roughness():
    """Two directions, each turned by an angle to the other side, have a mean as long as its cosine."""
    tilts = np.tile(np.uint8([[(204, 128, 230, 255), (51, 128, 230, 255)]]), (4, 2, 1))
    np.testing.assert_allclose(halved(tilts, 1, "normal")[..., :3], np.broadcast_to((128, 128, 255), (2, 2, 3)), atol=1)
    squared = 0.64
    np.testing.assert_allclose(spread_of(tilts, 1), 2 * (1 - squared) / (3 - squared) / 0.8, rtol=0.01)
    assert (spread_of(np.full((4, 4, 4), (204, 128, 230, 255), np.uint8), 1) == 0).all()


BUMPY = Material(roughness=0.5, normal_texture=Texture(1), metallic_roughness_texture=Texture(0), normal_scale=0.5)


def test_normals_are_halved_only_where_roughness_takes_what_they_lose():
    bumps = Image("bumps", np.tile(np.uint8([[(153, 128, 252, 255), (102, 128, 252, 255)]]), (128, 64, 1)))
    surface = picture(128, 128)
    aligned = square(BUMPY, surface, bumps)
    assert level(aligned, view(30.0), "normal_texture") == level(aligned, view(30.0), "metallic_roughness_texture") > 0
    kind = Kind(aligned, (), True, (PLACED,))
    (material,), images = kind.pictured(kind.levels([view(30.0)]))
    rough = images[material.metallic_roughness_texture.image].pixels
    k = 128 // len(rough)
    means = surface.pixels.reshape(128 // k, k, 128 // k, k, 4).mean(axis=(1, 3))
    plain = means[..., 1] / 255 * 0.5
    squared = 0.9597  # of the mean of a tilt by 0.2 and its opposite
    spread = 2 * (1 - squared) / (3 - squared) / math.sqrt(squared) * 0.5**2
    np.testing.assert_allclose(rough[..., 1] / 255 * material.roughness, (plain**4 + BUMPED * spread) ** 0.25, atol=0.005)
    np.testing.assert_allclose(
        rough[..., 2], surface.pixels[..., 2].reshape(128 // k, k, 128 // k, k).mean(axis=(1, 3)), atol=0.5
    )
    for other in (
        square(replace(BUMPY, metallic_roughness_texture=None), surface, bumps),
        square(replace(BUMPY, normal_texture=Texture(1, scale=(2.0, 2.0))), surface, bumps),
        square(BUMPY, picture(64, 64), bumps),
        square(replace(BUMPY, roughness=0.1), surface, bumps),
    ):
        assert level(other, view(30.0), "normal_texture") == 0
    assert level(aligned, view(30.0), "normal_texture", repaints=(Repaint(roughness=0.1),)) == 0


def test_pictures_are_shared_and_others_are_left_out():
    two = square(COLORED, picture(), picture(), materials=(COLORED, replace(COLORED, emissive_texture=Texture(0))))
    kind = Kind(two, (), True, (PLACED,))
    (level,) = {row[0] for row in kind.levels([view(9.0)])[:1]}
    materials, images = kind.pictured(((level,) * len(CONTENTS),) * 2)
    assert len(images) == 1
    assert {m.base_color_texture.image for m in materials} == {materials[1].emissive_texture.image} == {0}
    none = kind.pictured(((0,) * len(CONTENTS),) * 2)
    assert none[1][0] is two.images[0]


# Cycles.

TEXELS, FAR, NEAR = 1024, 6.0, 1.9
BLENDER = [pytest.mark.slow, pytest.mark.usefixtures("blender")]


def hammered(size=TEXELS) -> Mesh:
    """A shining sheet with fine colours, bumps and roughness, and a window cut out of it by another picture's alpha."""
    noise = RNG.random((size, size))
    noise = (noise + np.roll(noise, 1, 0) + np.roll(noise, 1, 1) + np.roll(noise, (1, 1), (0, 1))) / 4
    slope = [np.roll(noise, -1, axis) - np.roll(noise, 1, axis) for axis in (1, 0)]
    normal = np.stack([-slope[0], slope[1], np.ones_like(noise)], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    color = np.stack([noise, noise**2, 1 - noise], axis=-1)
    surface = np.stack([noise, 0.4 + 0.4 * noise, np.ones_like(noise)], axis=-1)
    images = [Image(name, _opaque(values)) for name, values in (("c", color), ("s", surface), ("n", normal / 2 + 0.5))]
    holes = images[0].pixels.copy()
    holes[..., 3] = 255 * (np.add.outer(np.arange(size) // 8, np.arange(size) // 8) % 2)
    sheet = Material(
        base_color_texture=Texture(0),
        metallic=1.0,
        roughness=0.6,
        metallic_roughness_texture=Texture(1),
        normal_texture=Texture(2),
    )
    grid = Material(base_color_texture=Texture(3), alpha_mode="MASK")
    return square(sheet, *images, Image("h", holes), materials=(sheet, grid), triangle_material=np.array([0, 1], np.int32))


def _opaque(values) -> np.ndarray:
    return np.dstack([np.round(255 * values), np.full(values.shape[:2], 255)]).astype(np.uint8)


def stage_with(mesh: Mesh, distances, **engine):
    lens = Intrinsics(width=48, height=48, fx=80, fy=80, cx=24, cy=24)
    around = [Viewpoint(index=i, azimuth_deg=15, elevation_deg=10, distance=d) for i, d in enumerate(distances)]
    options = {"samples": 16, "denoise": "off", "bounces": 1, **engine}
    shot = still_shot([PLACED], lens, around, scene=Scene(ground=None), engine="cycles", engine_options=options)
    return cycles.stage(shot, lambda _: mesh)


def pictures(stage) -> list[bytes]:
    cameras = map(stage.shot.camera, range(len(stage.shot.instants)))
    return [stage.paint(i, 0, rasterize(stage.at(i), camera), ("rgb",))["rgb"].tobytes() for i, camera in enumerate(cameras)]


class TestInBlender:
    pytestmark = BLENDER

    def test_frames_do_not_know_one_another(self):
        mesh = hammered(256)
        far, near, again = pictures(stage_with(mesh, [FAR, NEAR, FAR]))
        assert far == again != near
        assert pictures(stage_with(mesh, [NEAR])) == [near]
        assert pictures(stage_with(mesh, [FAR])) == [far]

    def test_halved_pictures_are_no_farther_from_the_truth(self):
        mesh = hammered()
        stage = stage_with(mesh, [FAR]).arrangement(0)
        camera = stage.shot.camera(0)
        levels = stage.kinds[0].levels([camera])
        assert levels[0][:3] == (3, 3, 3)
        assert levels[1] == (0,) * len(CONTENTS)
        coarse = stage._radiance(camera, True)
        whole = stage_with(mesh, [FAR]).arrangement(0)
        full = asked(whole, camera)["picture"]
        reference = asked(stage_with(mesh, [FAR], samples=1024).arrangement(0), camera)["picture"]
        smooth = stage_with(mesh, [FAR], samples=1024).arrangement(0)._radiance(camera, True)
        assert np.abs(smooth[..., :3] - reference[..., :3]).mean() < 0.04 * reference[..., :3].mean()
        assert smooth[..., :3].mean() == pytest.approx(reference[..., :3].mean(), rel=0.01)
        error = [float(((p - reference)[..., :3] ** 2).mean()) for p in (coarse, full)]
        assert error[0] < error[1]
        np.testing.assert_array_equal(coarse[..., 3], full[..., 3])  # cut out alike, sample by sample
