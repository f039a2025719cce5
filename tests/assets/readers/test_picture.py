"""A picture becomes an upright plane that shows it."""

import io

import numpy as np
import pytest
from PIL import Image

from viewsphere.assets.cache import load_normalised
from viewsphere.assets.load import load_model
from viewsphere.assets.readers import readers
from viewsphere.errors import ModelError
from viewsphere.model.model_spec import ModelSpec

KINDS = {"bmp": "BMP", "jpg": "JPEG", "jpeg": "JPEG", "png": "PNG", "tif": "TIFF", "tiff": "TIFF", "webp": "WEBP"}


def encoded(pixels, kind="PNG"):
    file = io.BytesIO()
    Image.fromarray(np.asarray(pixels, np.uint8)).save(file, kind)
    return file.getvalue()


def rgba(alpha):
    alpha = np.asarray(alpha, np.uint8)
    return np.dstack([np.full((*alpha.shape, 3), 200, np.uint8), alpha])


@pytest.mark.parametrize("suffix", readers()["picture"].suffixes)
def test_every_kind_is_a_plane_in_front(write, suffix):
    quarters = np.zeros((20, 40, 3), np.uint8)
    quarters[:10, :20], quarters[:10, 20:], quarters[10:, :20] = (255, 0, 0), (0, 255, 0), (0, 0, 255)
    mesh, facts = load_model(write(f"card.{suffix.upper()}", encoded(quarters, KINDS[suffix])))
    assert (facts.format, facts.up, facts.forward, facts.unit) == (suffix, "+z", "-y", 1)
    np.testing.assert_array_equal(mesh.bounds, [[-1, 0, 0], [1, 0, 1]])
    np.testing.assert_array_equal(mesh.normals, [[0, -1, 0]] * 4)
    assert mesh.parts == ("card",)
    (material,) = mesh.materials
    assert material.alpha_mode == "OPAQUE"
    assert material.double_sided
    # Seen from -Y, x runs to the right: upper left is red, upper right green, lower left blue.
    (image,) = mesh.images
    for (x, z), color in {(-0.5, 0.75): (255, 0, 0), (0.5, 0.75): (0, 255, 0), (-0.5, 0.25): (0, 0, 255)}.items():
        u, v = uv_at(mesh, x, z)
        pixel = image.pixels[int(v * 20), int(u * 40), :3].astype(int)
        assert np.abs(pixel - color).max() < 30


def uv_at(mesh, x, z):
    """Texture coordinates at a point of the plane, by barycentric coordinates."""
    for corners in mesh.triangles:
        matrix = np.column_stack([mesh.vertices[corners][:, [0, 2]], np.ones(3)]).T.astype(float)
        weights = np.linalg.solve(matrix, [x, z, 1])
        if (weights >= -1e-9).all():
            return weights @ mesh.uv0[corners]
    raise AssertionError("outside")


def test_a_photograph_is_turned_upright(write):
    file, exif = io.BytesIO(), Image.Exif()
    exif[0x0112] = 6  # the camera lay on its left side
    Image.new("RGB", (40, 20)).save(file, "JPEG", exif=exif)
    mesh, _ = load_model(write("a.jpg", file.getvalue()))
    np.testing.assert_array_equal(mesh.bounds, [[-0.25, 0, 0], [0.25, 0, 1]])


def test_the_front_is_counter_clockwise(write):
    mesh, _ = load_model(write("a.png", encoded(np.zeros((3, 3, 3)))))
    a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
    assert (np.cross(b - a, c - a)[:, 1] < 0).all()


def test_clear_texels_cut_and_many_in_between_blend(write):
    disk = np.hypot(*np.mgrid[-20:20, -20:20]) < 15
    mesh, _ = load_model(write("cut.png", encoded(rgba(255 * disk))))
    assert mesh.materials[0].alpha_mode == "MASK"
    mesh, _ = load_model(write("fade.png", encoded(rgba(np.linspace(0, 255, 1600).reshape(40, 40)))))
    assert mesh.materials[0].alpha_mode == "BLEND"


def test_unit_is_the_height(write):
    path = write("man.png", encoded(np.zeros((40, 20, 3))))
    spec = ModelSpec(key="a", source=str(path), category="x", category_id=1, unit=1.8, centring="floor")
    np.testing.assert_allclose(load_normalised(spec).bounds, [[-0.45, 0, 0], [0.45, 0, 1.8]], rtol=1e-6)


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "empty"),
        (b"not a picture", "not an image"),
        (encoded(np.random.default_rng(1).integers(0, 255, (50, 50, 3)))[:900], "cannot be decoded"),
        (encoded(rgba(np.zeros((4, 4)))), "clear all over"),
    ],
)
def test_what_shows_nothing_is_refused(write, data, said):
    with pytest.raises(ModelError, match=said) as error:
        load_model(write("bad.png", data))
    assert str(error.value).count("bad.png") == 1
    assert "\n" not in str(error.value)


def test_a_large_picture_is_reduced_and_keeps_its_proportions(write, monkeypatch):
    from viewsphere.assets.paths import folder

    monkeypatch.setattr(folder, "SHARPEST", 16)
    shades = np.repeat(np.arange(40, dtype=np.uint8) * 6, 20).reshape(40, 20)
    mesh, _ = load_model(write("tall.png", encoded(np.dstack([shades] * 3))))
    (image,) = mesh.images
    assert image.pixels.shape == (14, 7, 4)
    np.testing.assert_array_equal(mesh.bounds, [[-0.25, 0, 0], [0.25, 0, 1]])
    means = np.arange(40, dtype=float)[:39].reshape(13, 3).mean(axis=1) * 6
    assert np.abs(image.pixels[:13, 0, 0] - means).max() <= 1
