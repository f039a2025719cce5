"""Backgrounds against closed forms: which part of a picture is seen, upright, blurred, and in its own bytes."""

from __future__ import annotations

import os
import struct
import zlib

import numpy as np
import pytest
from PIL import Image, ImageOps
from scipy.ndimage import gaussian_filter

from pictures import photograph, write
from quick import quick
from viewsphere.codecs.srgb import encoded, linear
from viewsphere.errors import UserError
from viewsphere.model.scene import Background
from viewsphere.rendering import background as module
from viewsphere.rendering.background import display_background

WHITE = (255, 255, 255)


def shown(background: Background, width: int, height: int) -> np.ndarray:
    """The background's sRGB bytes, (height, width, 3)."""
    light = display_background(background, width, height)
    assert light is not None
    assert light.shape == (height * width, 3)
    assert light.dtype == np.float32
    return np.round(encoded(light) * 255).astype(np.uint8).reshape(height, width, 3)


def ramps(width: int, height: int) -> np.ndarray:
    """Red grows to the right and green downwards, from 20 to 230."""
    x, y = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    return np.round(np.stack([20 + 210 * x, 20 + 210 * y, np.full_like(x, 90)], axis=-1)).astype(np.uint8)


def noisy(width: int, height: int, channels: int = 3) -> np.ndarray:
    return np.random.default_rng(3).integers(0, 256, (height, width, channels), np.uint8)


def test_a_colour_is_its_own_bytes():
    for byte in range(256):
        seen = shown(Background(color=(byte / 255, 0.5, 1 - byte / 255)), 3, 2)
        assert (seen == [byte, 128, 255 - byte]).all()


@pytest.mark.parametrize("background", [Background(), Background(transparent=True, color=(1, 0, 0))])
def test_neither_sky_nor_nothing_is_a_background(background):
    assert display_background(background, 4, 3) is None


@pytest.mark.parametrize("fit", ["stretch", "cover", "crop"])
@pytest.mark.parametrize("flip", [False, True])
def test_a_picture_of_the_frame_s_size_is_its_own_bytes(tmp_path, fit, flip):
    pixels = noisy(37, 23)
    seen = shown(Background(image=str(write(tmp_path / "noise.png", pixels)), fit=fit, flip=flip), 37, 23)
    np.testing.assert_array_equal(seen, pixels[:, ::-1] if flip else pixels)


FITS = [
    # fit, zoom, place, and what is seen of a picture 900 x 600 in a frame 60 x 60, as shares: left, top, right, bottom
    ("stretch", 1.0, (0.5, 0.5), (0, 0, 1, 1)),
    ("stretch", 3.0, (0.0, 1.0), (0, 0, 1, 1)),
    ("cover", 1.0, (0.5, 0.5), (1 / 6, 0, 5 / 6, 1)),
    ("cover", 4.0, (0.0, 0.0), (1 / 6, 0, 5 / 6, 1)),
    ("crop", 1.0, (0.5, 0.5), (1 / 6, 0, 5 / 6, 1)),
    ("crop", 1.0, (0.0, 0.3), (0, 0, 2 / 3, 1)),
    ("crop", 2.0, (0.0, 0.0), (0, 0, 1 / 3, 1 / 2)),
    ("crop", 2.0, (1.0, 1.0), (2 / 3, 1 / 2, 1, 1)),
    ("crop", 2.5, (0.25, 0.75), (0.25 * (1 - 4 / 15), 0.75 * 0.6, 0.25 * (1 - 4 / 15) + 4 / 15, 0.75 * 0.6 + 0.4)),
    ("crop", 20.0, (1.0, 0.0), (1 - 1 / 30, 0, 1, 1 / 20)),
]


@pytest.fixture(scope="module")
def ramp_files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("ramps")
    large = write(folder / "ramps.jpg", ramps(1800, 1200), quality=95)
    return {"png": write(folder / "ramps.png", ramps(900, 600)), "jpg": large}


@pytest.mark.parametrize(("fit", "zoom", "place", "part"), FITS)
@pytest.mark.parametrize(
    ("suffix", "flip"), quick([("png", False), ("png", True), ("jpg", False), ("jpg", True)], ("png", True), ("jpg", False))
)
def test_fits(ramp_files, fit, zoom, place, part, flip, suffix):
    """A ramp stays a ramp when resized: each pixel shows the place that its centre falls on."""
    seen = shown(Background(image=str(ramp_files[suffix]), fit=fit, zoom=zoom, place=place, flip=flip), 60, 60).astype(float)
    left, top, right, bottom = part
    across = (np.arange(60) + 0.5) / 60
    red = 20 + 210 * (left + (right - left) * (across[::-1] if flip else across))
    green = 20 + 210 * (top + (bottom - top) * across)
    inside = slice(3, -3)  # where the resampling filter does not meet the picture's border
    limit = 1.0 if suffix == "png" else 3.0  # JPEG is lossy
    assert np.abs(seen[..., 0] - red)[inside, inside].max() <= limit
    assert np.abs(seen[..., 1] - green[:, None])[inside, inside].max() <= limit
    assert np.abs(seen[..., 2] - 90).max() <= limit


@pytest.mark.parametrize("size", [(640, 480), (7, 400), (400, 7), (1, 1)])
@pytest.mark.parametrize("frame", [(64, 48), (48, 64), (300, 2)])
def test_a_crop_at_each_corner_shows_that_corner(tmp_path, size, frame):
    """Quarters of one colour each: at zoom 2 a corner's crop lies in its quarter, whatever the proportions."""
    width, height = size
    pixels = np.zeros((height, width, 3), np.uint8)
    colors = np.array([[(255, 0, 0), (0, 255, 0)], [(0, 0, 255), (255, 255, 0)]])
    pixels[:] = colors[(2 * np.arange(height) // height)[:, None], 2 * np.arange(width) // width]
    file = str(write(tmp_path / "quarters.png", pixels))
    for x in (0, 1):
        for y in (0, 1):
            seen = shown(Background(image=file, fit="crop", zoom=2, place=(x, y)), *frame)
            edge = tuple(slice(None, -2) if end == 0 else slice(2, None) for end in (y, x))  # not the filter's reach
            corner = seen[edge] if min(size) > 16 and min(frame) > 16 else seen[-1 if y else 0, -1 if x else 0]
            wanted = pixels[-1 if y else 0, -1 if x else 0]
            assert (np.abs(corner.astype(int) - wanted) <= 1).all()


@pytest.mark.parametrize("orientation", range(10))
@pytest.mark.parametrize("suffix", ["png", "jpg"])
def test_photographs_are_turned_as_the_camera_says(tmp_path, orientation, suffix):
    exif = Image.Exif()
    exif[0x0112] = orientation
    file = write(tmp_path / f"turned.{suffix}", photograph(96, 64), exif=exif)
    with Image.open(file) as image:
        upright = np.asarray(ImageOps.exif_transpose(image).convert("RGB"))
    height, width = upright.shape[:2]
    assert (width < height) == (5 <= orientation <= 8)
    np.testing.assert_array_equal(shown(Background(image=str(file)), width, height), upright)
    half = shown(Background(image=str(file)), width // 2, height // 2)
    mean = upright.reshape(height // 2, 2, width // 2, 2, 3).mean(axis=(1, 3))
    assert np.abs(half - mean).mean() < 4  # reduced while it is decoded, it is turned, too


def test_damaged_exif_counts_as_none(tmp_path):
    file = tmp_path / "damaged.jpg"
    Image.fromarray(ramps(32, 16)).save(tmp_path / "plain.jpg")
    Image.fromarray(ramps(32, 16)).save(file, exif=b"Exif\x00\x00MM\x00\x2a\xff\xff\xff\xff\xff")
    plain = shown(Background(image=str(tmp_path / "plain.jpg")), 32, 16)
    np.testing.assert_array_equal(shown(Background(image=str(file)), 32, 16), plain)


def test_clear_parts_show_the_background_s_colour(tmp_path):
    pixels = noisy(16, 16, 4)
    pixels[:4, :, 3], pixels[4:8, :, 3] = 0, 255
    file = str(write(tmp_path / "clear.png", pixels))
    alpha = pixels[..., 3:] / 255
    for background, under in ((Background(image=file), WHITE), (Background(image=file, color=(0.2, 0.4, 0.6)), (51, 102, 153))):
        seen = shown(background, 16, 16)
        assert np.abs(seen - (pixels[..., :3] * alpha + np.array(under) * (1 - alpha))).max() <= 1
        np.testing.assert_array_equal(seen[:4], np.broadcast_to(under, (4, 16, 3)))
        np.testing.assert_array_equal(seen[4:8], pixels[4:8, :, :3])


def greys(image: Image.Image) -> np.ndarray:
    return np.repeat(np.asarray(image.convert("L"))[..., None], 3, axis=2)


@pytest.mark.parametrize(
    ("mode", "suffix"),
    [("L", "png"), ("L", "jpg"), ("1", "png"), ("P", "png"), ("P", "gif"), ("CMYK", "jpg"), ("CMYK", "tiff"), ("RGB", "webp")],
)
def test_other_kinds_of_pictures(tmp_path, mode, suffix):
    """As Pillow shows them; JPEG and WebP are lossy, so the oracle reads the file too."""
    file = tmp_path / f"picture.{suffix}"
    Image.fromarray(photograph(48, 32)).convert(mode).save(file)
    with Image.open(file) as image:
        wanted = np.asarray(image.convert("RGB"))
    np.testing.assert_array_equal(shown(Background(image=str(file)), 48, 32), wanted)


def test_a_palette_with_a_clear_colour(tmp_path):
    file = tmp_path / "palette.gif"
    palette = Image.fromarray(np.repeat(np.arange(4, dtype=np.uint8)[None], 4, axis=0), "L").convert("P")
    palette.putpalette([10, 20, 30, 40, 50, 60, 70, 80, 90, 100, 110, 120])
    palette.save(file, transparency=2)
    seen = shown(Background(image=str(file)), 4, 4)[0]
    np.testing.assert_array_equal(seen, [(10, 20, 30), (40, 50, 60), WHITE, (100, 110, 120)])


@pytest.mark.parametrize("suffix", ["png", "tiff"])
def test_sixteen_bits_keep_their_upper_byte(tmp_path, suffix):
    values = np.arange(256, dtype=np.uint16).reshape(16, 16) * 257
    seen = shown(Background(image=str(write(tmp_path / f"deep.{suffix}", values))), 16, 16)
    np.testing.assert_array_equal(seen, np.repeat((values >> 8)[..., None], 3, axis=2))


def test_floats_are_shares(tmp_path):
    values = np.array([[0.0, 0.5, 1.0, 7.0], [-1.0, np.nan, 0.25, 0.75]], np.float32)
    seen = shown(Background(image=str(write(tmp_path / "float.tiff", values))), 4, 2)
    np.testing.assert_array_equal(seen[..., 1], [[0, 128, 255, 255], [0, 0, 64, 191]])


@pytest.mark.parametrize("share", quick([0.004, 0.01, 0.02, 0.05, 0.2, 1.0], 0.004, 0.02, 0.2))
@pytest.mark.parametrize("flip", [False, True])
def test_blur_is_a_gaussian_in_linear_light(tmp_path, share, flip):
    pixels = photograph(200, 150)
    pixels[40:43, 60:63] = 255
    seen = display_background(
        Background(image=str(write(tmp_path / "photo.png", pixels)), blur=share, flip=flip), 200, 150
    ).reshape(150, 200, 3)
    sharp = linear((pixels[:, ::-1] if flip else pixels) / 255)
    sigma = share * 200
    wanted = gaussian_filter(sharp, (sigma, sigma, 0), mode="reflect", truncate=6.0)
    assert np.abs(seen - wanted).max() < (1e-3 if sigma <= module.COARSE else 6e-3)
    np.testing.assert_allclose(seen.mean(axis=(0, 1)), sharp.mean(axis=(0, 1)), rtol=2e-3)  # no light is lost


@pytest.mark.parametrize("share", [0.001, 0.01, 0.1, 1.0])
def test_blur_leaves_one_colour_as_it_is(tmp_path, share):
    file = write(tmp_path / "plain.png", np.full((30, 40, 3), (200, 30, 90), np.uint8))
    assert (shown(Background(image=str(file), blur=share), 64, 48) == [200, 30, 90]).all()


def test_a_picture_is_kept_until_its_file_changes(tmp_path):
    background = Background(image=str(write(tmp_path / "photo.png", ramps(32, 16))))
    first = display_background(background, 32, 16)
    assert display_background(background, 32, 16) is first
    write(tmp_path / "photo.png", ramps(32, 16)[::-1].copy())
    os.utime(tmp_path / "photo.png", ns=(5, 5))
    np.testing.assert_array_equal(shown(background, 32, 16), ramps(32, 16)[::-1])


def test_only_so_many_pictures_are_kept(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "KEPT_BYTES", 4 * 32 * 16 * 2)
    shelf = module._Shelf()
    for turn in range(3):
        for i in range(4):
            file = tmp_path / f"{i}.png"
            if turn == 0:
                write(file, np.full((16, 32, 3), 40 * i, np.uint8))
            picture = shelf.picture(module._Wanted(str(file), 1, 1, WHITE))
            assert np.asarray(picture)[3, 3, 0] == 40 * i
            assert len(shelf._pictures) <= 2


def png_head(width: int, height: int) -> bytes:
    """The beginning of a PNG file whose pixels never come."""
    body = b"IHDR" + struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + struct.pack(">I", 13)
        + body
        + struct.pack(">I", zlib.crc32(body))
        + struct.pack(">I", 9)
        + b"IDAT"
    )


@pytest.mark.parametrize("size", [(10_001, 10_000), (40_000, 30_000)])
def test_too_many_pixels_are_refused_before_they_are_decoded(tmp_path, size):
    file = tmp_path / "huge.png"
    file.write_bytes(png_head(*size))
    with pytest.raises(
        UserError, match=r"huge\.png: expected at most 100,000,000 pixels, found (10001 x 10000|many more): make"
    ):
        display_background(Background(image=str(file)), 64, 48)


def truncated(file):
    write(file, noisy(64, 64))
    file.write_bytes(file.read_bytes()[:3000])


UNREADABLE = {
    "missing.png": lambda file: None,
    "folder.png": lambda file: file.mkdir(),
    "empty.png": lambda file: file.write_bytes(b""),
    "text.jpg": lambda file: file.write_text("no picture"),
    "postscript.eps": lambda file: file.write_text("%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n"),
    "truncated.png": truncated,
    "truncated.jpg": truncated,
    "none.png": lambda file: file.write_bytes(png_head(0, 8)),
}


@pytest.mark.parametrize("name", UNREADABLE)
def test_pictures_that_cannot_be_read_are_named_in_one_line(tmp_path, name):
    UNREADABLE[name](tmp_path / name)
    with pytest.raises(UserError, match=rf"{name}: expected a readable image, found \S.*: mend or remove it$") as caught:
        display_background(Background(image=str(tmp_path / name)), 64, 48)
    assert "\n" not in str(caught.value)


def test_a_wrong_ending_does_not_matter(tmp_path):
    Image.fromarray(ramps(32, 16)).save(tmp_path / "really.jpg", "PNG")
    np.testing.assert_array_equal(shown(Background(image=str(tmp_path / "really.jpg")), 32, 16), ramps(32, 16))
