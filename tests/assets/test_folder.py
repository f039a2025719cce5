"""Which files a model may name, and what an unusable one costs."""

import io

import numpy as np
import pytest
from PIL import Image

from viewsphere.assets.folder import ModelFolder, UnreadableError, decode_image
from viewsphere.assets.load import load_model
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


@pytest.mark.parametrize("name", ["../secret.txt", "maps/../../secret.txt", "{root}/secret.txt", "link.txt"])
def test_nothing_outside_is_read_without_consent(folder, write, tmp_path, name):
    write("secret.txt", b"secret")
    (folder.model.parent / "link.txt").symlink_to(tmp_path / "secret.txt")
    name = name.format(root=tmp_path)
    with pytest.raises(UnreadableError, match="outside the model's folder, not read"):
        folder.read(name)
    assert ModelFolder(folder.model, confined=False).read(name) == b"secret"


@pytest.mark.parametrize("name", ["http://localhost/a.png", "file:///etc/hostname", "a\0b.png"])
def test_only_paths_are_followed(folder, name):
    with pytest.raises(UnreadableError, match="not fetched"):
        folder.read(name)


@pytest.mark.parametrize("name", ["C:\\work\\tex\\wood.png", "/home/someone/wood.png", "../../wood.png", "old/wood.png"])
def test_a_lost_file_beside_the_model_is_found(folder, write, name):
    write("model/wood.png", b"wood")
    assert folder.read(name, "texture") == b"wood"
    assert "beside the model" in folder.warnings[0]


def test_16_bit_and_palette_images(folder):
    ramp = np.array([[0, 0x80FF, 0xFFFF]], np.uint16)
    pixels = decode_image(png(Image.fromarray(ramp)), "t")
    assert pixels[0, :, 0].tolist() == [0, 0x80, 0xFF]
    palette = Image.new("P", (1, 1), 1)
    palette.putpalette([0, 0, 0, 9, 8, 7])
    assert decode_image(png(palette), "t")[0, 0].tolist() == [9, 8, 7, 255]


@pytest.mark.parametrize("data", [b"", b"not an image", png(Image.new("RGB", (64, 64), "red"))[:100]])
def test_a_bad_image_is_a_warning(folder, write, data):
    write("model/bad.png", data)
    assert folder.image("bad.png", "bad.png") is None
    assert "bad.png" in folder.warnings[0]
    assert "factor is used" in folder.warnings[0]


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("a.blend", "Blender files are not read; convert it to GLB .in Blender"),
        ("a.usdz", "USD files are not read; convert it to GLB .in Blender"),
        ("a.step", "STEP .CAD. files are not read; convert it to GLB .with its program"),
        ("a.xyz", "glb, gltf, obj"),
        ("a", "found 'none'"),
        ("a.obj", "no such file"),
        ("d.obj", "a file"),
    ],
)
def test_paths_that_are_no_models(tmp_path, name, message):
    (tmp_path / "d.obj").mkdir()
    with pytest.raises(ModelError, match=message):
        load_model(tmp_path / name)
