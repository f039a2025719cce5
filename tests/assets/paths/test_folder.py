"""Which files a model may name, and what an unusable one costs."""

import io
import struct
import zlib

import numpy as np
import pytest
from PIL import Image

from viewsphere.assets.load import load_model
from viewsphere.assets.paths.folder import ModelFolder, UnreadableError, decode_image
from viewsphere.errors import ModelError


def png(image):
    file = io.BytesIO()
    image.save(file, "PNG")
    return file.getvalue()


@pytest.fixture
def folder(write):
    return ModelFolder(write("model/car.obj", "v 0 0 0\n"))


def test_files_below_the_folder_are_read_and_remembered(folder, write):
    write("model/maps/Skin.PNG", b"x")
    assert folder.read("maps\\Skin.PNG") == b"x"
    assert folder.read("maps/skin.png") == b"x"
    assert "Skin.PNG" in {file.name for file in folder.files}


@pytest.mark.parametrize("name", ["../secret.txt", "maps/../../secret.txt", "{root}/secret.txt", "link.txt", "..%2Fsecret.txt"])
def test_nothing_outside_is_read_without_consent(folder, write, tmp_path, name):
    write("secret.txt", b"secret")
    (folder.model.parent / "link.txt").symlink_to(tmp_path / "secret.txt")
    name = name.format(root=tmp_path)
    with pytest.raises(UnreadableError, match="outside the model's folder, not read"):
        folder.read(name)
    assert ModelFolder(folder.model, confined=False).read(name) == b"secret"


@pytest.mark.parametrize("name", ["http://localhost/a.png", "ftp://localhost/a.png", "a\0b.png"])
def test_only_paths_are_followed(folder, name):
    with pytest.raises(UnreadableError, match="not fetched"):
        folder.read(name)


@pytest.mark.parametrize("name", ["C:\\work\\tex\\wood.png", "/home/someone/wood.png", "../../wood.png", "old/wood.png"])
def test_a_lost_file_beside_the_model_is_found(folder, write, name):
    write("model/wood.png", b"wood")
    assert folder.read(name, "texture") == b"wood"
    assert "does not exist there; 'wood.png' was read instead" in folder.warnings[0]


def test_16_bit_and_palette_images(folder):
    ramp = np.array([[0, 0x80FF, 0xFFFF]], np.uint16)
    pixels = decode_image(png(Image.fromarray(ramp)), "t")
    assert pixels[0, :, 0].tolist() == [0, 0x80, 0xFF]
    palette = Image.new("P", (1, 1), 1)
    palette.putpalette([0, 0, 0, 9, 8, 7])
    assert decode_image(png(palette), "t")[0, 0].tolist() == [9, 8, 7, 255]


def saved(image, kind):
    file = io.BytesIO()
    image.save(file, kind)
    return file.getvalue()


GREY = np.linspace(0, 255, 16).astype(np.uint8).reshape(4, 4)


@pytest.mark.parametrize("mode", ["L", "LA", "1", "RGB", "RGBA", "CMYK", "YCbCr", "P", "F", "I;16"])
def test_every_kind_of_pixel_shows_its_picture(mode):
    """TIFF holds them all: a grey ramp stays one, and nothing becomes black."""
    grey = Image.fromarray(GREY)
    image = {
        "F": lambda: Image.fromarray(GREY.astype(np.float32) / 255),
        "I;16": lambda: Image.fromarray(GREY.astype(np.uint16) * 257),
        "1": lambda: grey.point(lambda value: 255 * (value > 127), "1"),
        "P": lambda: grey.convert("RGB").quantize(256),
    }.get(mode, lambda: grey.convert("RGB").convert(mode))()
    pixels = decode_image(saved(image, "TIFF"), "t")
    expected = np.where(GREY > 127, 255, 0) if mode == "1" else GREY
    assert np.abs(pixels[..., :3] - expected[..., None].astype(int)).max() <= 1
    assert (pixels[..., 3] == 255).all()


def test_floats_that_are_no_numbers_are_black_or_white():
    image = Image.fromarray(np.array([[np.nan, np.inf, -np.inf, 0.5, 7]], np.float32))
    assert decode_image(saved(image, "TIFF"), "t")[0, :, 0].tolist() == [0, 255, 0, 128, 255]


def test_jpegs_for_print_are_not_inverted():
    pixels = decode_image(saved(Image.fromarray(GREY).resize((32, 32)).convert("RGB").convert("CMYK"), "JPEG"), "t")
    assert pixels[0, 0, 0] < 20
    assert pixels[-1, -1, 0] > 235


def test_a_wrong_suffix_does_not_matter(folder, write):
    write("model/really.png", saved(Image.fromarray(GREY), "JPEG"))
    assert folder.image("really.png", "really.png") == 0
    assert folder.warnings == []


def png_without_pixels(width, height):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + head + chunk(b"IDAT", zlib.compress(b"")) + chunk(b"IEND", b"")


EMPTY = {
    "png": png_without_pixels(0, 0),
    "one side": png_without_pixels(0, 5),
    "ppm": b"P6 0 3 255\n",
    "tga": b"\0\0\2" + b"\0" * 13 + b"\x18\0",
    "gif": b"GIF89a" + b"\0" * 7 + b";",
}


@pytest.mark.parametrize("kind", EMPTY)
def test_a_picture_without_pixels_is_a_warning(folder, kind):
    assert folder.image("#a", "empty", EMPTY[kind]) is None
    assert "has no pixels; the material's plain factor is used" in folder.warnings[0]


def test_a_very_large_texture_is_reduced_with_a_word(folder, monkeypatch):
    from viewsphere.assets.paths import folder as module

    monkeypatch.setattr(module, "SHARPEST", 16)
    pixels = np.zeros((30, 50, 4), np.uint8)
    pixels[:, ::2] = (200, 100, 50, 255)
    pixels[:, 1::2] = (9, 9, 9, 0)
    assert folder.image("#a", "big", png(Image.fromarray(pixels))) == 0
    assert folder.warnings == ["car.obj: texture 'big': 50 x 30 pixels are reduced to 13 x 8 (at most 16 a side)"]
    assert folder.images[0].pixels.shape == (8, 13, 4)
    np.testing.assert_allclose(folder.images[0].pixels[2, 3], [200, 100, 50, 128], atol=1)


@pytest.mark.parametrize("data", [b"", b"not an image", png(Image.new("RGB", (64, 64), "red"))[:100]])
def test_a_bad_image_is_a_warning(folder, write, data):
    write("model/bad.png", data)
    assert folder.image("bad.png", "bad.png") is None
    assert "bad.png" in folder.warnings[0]
    assert "factor is used" in folder.warnings[0]


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("a.x3d", "X3D files are not read; convert it to GLB .in Blender"),
        ("a.blend", "no such file"),
        ("a.blend/Object/Car", "a.blend: no such file"),
        ("a.blend/Car", "expected a.blend/Object/NAME or a.blend/Collection/NAME, found a.blend/Car"),
        ("a.usdz", "no such file"),
        ("a.step", "STEP .CAD. files are not read; convert it to GLB .with its program"),
        ("a.xyz", "glb, gltf, obj"),
        ("a", "found 'none'"),
        ("e", "e: expected a model file, found a folder: name a file in it"),
        ("a.obj", "no such file"),
        ("d.obj", "a file"),
    ],
)
def test_paths_that_are_no_models(tmp_path, name, message):
    (tmp_path / "d.obj").mkdir()
    (tmp_path / "e").mkdir()
    with pytest.raises(ModelError, match=message):
        load_model(tmp_path / name)
