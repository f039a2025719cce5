"""Picture files that cannot be used are told from their heads and their ends, before anything is rendered."""

import struct
import zlib

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from viewsphere.errors import RecipeError
from viewsphere.limits import limits
from viewsphere.planning.plan import check_images, plan
from viewsphere.recipe.recipe import Recipe

FIELDS = {
    "background": "scene.background.image",
    "folder": "scene.background.images",
    "ground": "scene.ground.image",
    "normals": "scene.ground.normal_image",
    "plane": "scene.planes[0].image",
}


def scene(use, path):
    return {
        "background": {"background": {"image": str(path)}},
        "folder": {"background": {"images": str(path.parent)}},
        "ground": {"ground": {"image": str(path)}},
        "normals": {"ground": {"normal_image": str(path)}},
        "plane": {"planes": [{"image": str(path), "height": 1, "at": [0, 4, 0]}]},
    }[use]


def look_at(scene):
    check_images(plan(Recipe(models=[{"source": "zoo:car"}], viewpoints={"distance": 5}, scene=scene)))


def refused(scene) -> str:
    with pytest.raises(RecipeError) as caught:
        look_at(scene)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def noise(mode="RGB", size=(200, 150)):
    return Image.fromarray(np.random.default_rng(0).integers(0, 256, (size[1], size[0], 3), np.uint8)).convert(mode)


def png_head(width, height):
    body = b"IHDR" + struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + struct.pack(">I", 13) + body + struct.pack(">I", zlib.crc32(body)) + b"\0\0\0\x09IDAT"


@pytest.mark.parametrize("use", FIELDS)
def test_one_limit_for_all_pictures(use, tmp_path):
    assert limits.MAX_PICTURE_PIXELS == 100_000_000
    path = tmp_path / "a.png"
    for size, found in (((10_001, 10_000), "100,010,000 (10001 x 10000)"), ((20_000, 20_000), "400,000,000")):
        path = tmp_path / f"{size[0]}.png"
        path.write_bytes(png_head(*size))
        said = refused(scene(use, path))
        assert said.startswith(
            f"{FIELDS[use]}: expected at most 100,000,000 pixels (limit MAX_PICTURE_PIXELS); found {found} in "
        )
        assert said.endswith(f"{path}: make it smaller")
        path.unlink()


@pytest.mark.parametrize("use", FIELDS)
@pytest.mark.parametrize("kind", ["jpg", "png"])
def test_a_file_that_ends_early_is_told(use, kind, tmp_path):
    path = tmp_path / f"a.{kind}"
    noise().save(path)
    look_at(scene(use, path))
    data = path.read_bytes()
    cut = tmp_path / f"b.{kind}"
    cut.write_bytes(data[: len(data) * 2 // 3])
    said = refused(scene(use, cut))
    assert said.startswith(f"{FIELDS[use]}: expected a readable image; found ") and said.endswith(f"{cut}: mend or remove it")


def test_what_cameras_write_behind_a_picture_does_no_harm(tmp_path):
    path = tmp_path / "a.jpg"
    noise().save(path)
    path.write_bytes(path.read_bytes() + bytes(1000))
    look_at(scene("background", path))


@pytest.mark.parametrize("content", [b"", b"no picture", b"\xff\xd8\xff", png_head(0, 8), b"GIF89a", b"BM", b"II*\0"])
def test_what_is_no_picture_is_told(content, tmp_path):
    path = tmp_path / "a.png"
    path.write_bytes(content)
    for use, field in FIELDS.items():
        assert refused(scene(use, path)).startswith(f"{field}: expected a readable image; found ")


@pytest.mark.parametrize("mode", ["1", "L", "P", "LA", "RGBA", "CMYK", "I;16", "F"])
def test_all_kinds_of_pixels_will_do(mode, tmp_path):
    path = tmp_path / ("a.tif" if mode in ("CMYK", "F") else "a.png")
    image = Image.fromarray(np.full((8, 8), 900, np.uint16)) if mode == "I;16" else noise(mode, (8, 8))
    image.save(path)
    look_at(scene("folder", path))


def exr(path, channels):
    with OpenEXR.File({"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}, channels) as file:
        file.write(str(path))
    return path


def spheres(folder):
    """Files that cannot be skies, and what is said of them."""
    pixels = np.ones((16, 32, 3), np.float32)
    good = exr(folder / "good.exr", {"RGB": pixels}).read_bytes()
    (folder / "head.exr").write_bytes(good[:60])
    (folder / "noise.exr").write_bytes(good[:4] + np.random.default_rng(1).bytes(500))
    (folder / "large.hdr").write_bytes(b"#?RADIANCE\n\n-Y 20000 +X 40000\n")
    (folder / "square.hdr").write_bytes(b"#?RADIANCE\n\n-Y 20 +X 20\n")
    (folder / "sizeless.hdr").write_bytes(b"#?RADIANCE\n")
    (folder / "text.hdr").write_bytes(b"text")
    return {
        exr(
            folder / "wide.exr", {"RGB": np.ones((16, 50, 3), np.float32)}
        ): "expected a picture twice as wide as high, found 50 x 16",
        exr(folder / "depth.exr", {"Z": pixels[..., 0]}): "found channels Z; it needs R, G and B",
        folder / "head.exr": "head cannot be read",
        folder / "noise.exr": "head cannot be read",
        folder / "large.hdr": "expected at most 100 megapixels (limit MAX_PICTURE_PIXELS), found 40000 x 20000",
        folder / "square.hdr": "twice as wide as high, found 20 x 20",
        folder / "sizeless.hdr": "without a picture's size",
        folder / "text.hdr": "expected an OpenEXR or Radiance HDR file; found another kind",
    }


def test_the_head_of_a_sky_is_read_when_it_is_planned(tmp_path, capfd):
    for path, problem in spheres(tmp_path).items():
        said = refused({"sky": {"choice": ["daylight", str(path)]}})
        assert said.startswith("scene.sky.hdri: ") and str(path) in said and problem in said
    look_at({"sky": str(tmp_path / "good.exr")})
    assert capfd.readouterr() == ("", "")
