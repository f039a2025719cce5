"""The ground's pictures as a glTF material."""

from __future__ import annotations

import os

import numpy as np
import pytest

from pictures import bricks, write
from viewsphere.assets.paths.folder import SHARPEST
from viewsphere.codecs.srgb import linear
from viewsphere.errors import UserError
from viewsphere.model.scene import Ground
from viewsphere.rendering.ground.material import ground_albedo, ground_frame, ground_material


def test_plain_ground_has_its_colour_in_linear_light():
    material, images = ground_material(Ground(color=(0.5, 0.25, 1.0), metallic=0.25, roughness=0.5))
    assert images == ()
    np.testing.assert_allclose(material.base_color, [*linear([0.5, 0.25, 1.0]), 1.0])
    assert (material.metallic, material.roughness, material.alpha_mode) == (0.25, 0.5, "OPAQUE")
    np.testing.assert_allclose(ground_albedo(material, images), linear([0.5, 0.25, 1.0]))


def test_each_picture_goes_to_its_slot(tmp_path):
    textures = bricks(64)
    material, images = ground_material(Ground(color=(1, 1, 1), **textures.save(tmp_path)))
    color, rough, normal = (
        images[t.image].pixels
        for t in (material.base_color_texture, material.metallic_roughness_texture, material.normal_texture)
    )
    np.testing.assert_array_equal(color[..., :3], textures.color)
    np.testing.assert_array_equal(rough[..., 1], textures.roughness)
    assert (rough[..., 2] == 255).all()  # metallic stays the ground's own
    np.testing.assert_array_equal(normal[..., :3], textures.normal)
    assert all((image.pixels[..., 3] == 255).all() for image in images)
    np.testing.assert_allclose(ground_albedo(material, images), linear(textures.color / 255).mean(axis=(0, 1)))


def test_one_ground_keeps_its_images_until_a_file_changes(tmp_path):
    ground = Ground(**bricks(32).save(tmp_path))
    first = ground_material(ground)[1]
    assert all(a is b for a, b in zip(first, ground_material(ground)[1], strict=True))
    changed = (tmp_path / "color.png").stat().st_mtime_ns
    write(tmp_path / "color.png", np.zeros((8, 8, 3), np.uint8))
    os.utime(tmp_path / "color.png", ns=(changed, changed))  # of another size at least
    assert ground_material(ground)[1][0].pixels.shape == (8, 8, 4)


@pytest.mark.parametrize("origin", [(0.0, 0.0, 0.0), (3.7, -2.9, 1.0), (123_456.7, -98_765.4, 0.0)])
@pytest.mark.parametrize("size", [(32, 32), (48, 32)])
def test_texture_coordinates_repeat_over_the_world(tmp_path, origin, size):
    """u runs along x once a tile; v against y, once for the height that the picture's proportions ask for."""
    width, height = size
    file = write(tmp_path / "ground.png", np.zeros((height, width, 3), np.uint8))
    ground, unit = Ground(image=str(file), tile=1.5), 2.5
    material, _ = ground_material(ground)
    per_length, u0, v0 = ground_frame(ground, material, origin, unit)
    assert abs(u0) < 1
    points = np.random.default_rng(0).uniform(-4, 4, (100, 2))  # in units from the origin
    uv = np.stack([u0 + per_length * points[:, 0], v0 - per_length * points[:, 1], np.ones(100)])
    found = (material.base_color_texture.matrix @ uv).T
    world = np.array(origin[:2]) + unit * points
    expected = world / [1.5, -1.5 * height / width]
    off = (found - expected) % 1
    assert np.minimum(off, 1 - off).max() < 1e-9
    assert np.abs(found).max() < 12  # single precision keeps a ten-thousandth of a texel


def test_clear_parts_show_the_ground_s_colour(tmp_path):
    pixels = np.zeros((2, 2, 4), np.uint8)
    pixels[0] = 10, 20, 30, 255
    pixels[1] = 10, 20, 30, 0
    _, images = ground_material(Ground(image=str(write(tmp_path / "clear.png", pixels))))
    np.testing.assert_array_equal(images[0].pixels[0, 0], [10, 20, 30, 255])
    np.testing.assert_array_equal(images[0].pixels[1, 0], [255, 255, 255, 255])


def test_a_large_picture_is_reduced(tmp_path):
    file = write(tmp_path / "long.png", np.zeros((4, SHARPEST + 2, 3), np.uint8))
    _, images = ground_material(Ground(image=str(file)))
    assert images[0].pixels.shape == (2, SHARPEST // 2 + 1, 4)


@pytest.mark.parametrize("field", ["image", "roughness_image", "normal_image"])
def test_pictures_that_cannot_be_used_are_named(tmp_path, field):
    with pytest.raises(UserError, match=rf"^scene\.ground\.{field}: expected an image file, found .*missing\.png$"):
        ground_material(Ground(**{field: str(tmp_path / "missing.png")}))
    broken = tmp_path / "broken.png"
    broken.write_bytes(b"no picture")
    with pytest.raises(UserError, match=rf"^scene\.ground\.{field}: .*broken\.png") as caught:
        ground_material(Ground(**{field: str(broken)}))
    assert "\n" not in str(caught.value)
    cut = write(tmp_path / "cut.png", bricks(64).color)
    cut.write_bytes(cut.read_bytes()[:2000])
    with pytest.raises(UserError, match=rf"^scene\.ground\.{field}: .*cut\.png"):
        ground_material(Ground(**{field: str(cut)}))
