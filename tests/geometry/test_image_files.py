from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image

from viewsphere.codecs.png_tiff import decode_png, decode_tiff, encode_png, encode_tiff
from viewsphere.errors import UserError

SIZES = [(1, 1), (1, 9), (7, 1), (13, 17), (32, 40)]


def random_picture(shape: tuple[int, ...], dtype: type, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    if dtype is np.bool_:
        return rng.random(shape) < 0.5
    if dtype is np.float32:
        return rng.normal(size=shape).astype(np.float32)
    info = np.iinfo(dtype)
    return rng.integers(info.min, info.max, shape, dtype, endpoint=True)


def pillow(data: bytes) -> Image.Image:
    picture = Image.open(io.BytesIO(data))
    picture.load()
    return picture


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize(
    ("components", "dtype", "mode"),
    [
        (0, np.bool_, "1"),
        (0, np.uint8, "L"),
        (0, np.uint16, "I;16"),
        (3, np.uint8, "RGB"),
        (4, np.uint8, "RGBA"),
    ],
)
def test_png_round_trip_and_pillow(size, components, dtype, mode):
    array = random_picture(size + ((components,) if components else ()), dtype)
    before = array.copy()
    data = encode_png(array)
    assert data == encode_png(array.copy())
    np.testing.assert_array_equal(array, before)
    back = decode_png(data)
    assert back.dtype == array.dtype
    np.testing.assert_array_equal(back, array)
    picture = pillow(data)
    assert picture.mode == mode
    np.testing.assert_array_equal(np.asarray(picture), array)


def rendering(rng: np.random.Generator, height: int, width: int, components: int) -> np.ndarray:
    """A picture of one of the kinds that renderings are made of: flat, in bands, smooth, textured, noise, or patches of all."""
    y, x = np.mgrid[:height, :width]
    kinds = [
        np.broadcast_to(rng.integers(0, 256, components), (height, width, components)),
        rng.integers(0, 256, (height, 1, components)).repeat(width, 1),
        (y[..., None] * rng.uniform(-3, 3) + x[..., None] * rng.uniform(-3, 3, components)) % 256,
        rng.normal(128, rng.uniform(0, 9), (height, width, components)),
        rng.integers(0, 256, (height, width, components)),
    ]
    kind = int(rng.integers(6))
    if kind < 5:
        return kinds[kind].astype(np.uint8)
    which = rng.integers(0, 5, (height // 8 + 1, width // 8 + 1)).repeat(8, 0).repeat(8, 1)[:height, :width]
    return np.select([(which == k)[..., None] for k in range(5)], kinds).astype(np.uint8)


@pytest.mark.parametrize("seed", range(60))
def test_rendered_pictures_come_back_from_every_reader(seed):
    codecs = pytest.importorskip("imagecodecs")
    rng = np.random.default_rng(seed)
    shape = (*(int(n) for n in rng.integers(1, [5, 400] if seed % 3 else [200, 90])), int(rng.integers(3, 5)))
    array = rendering(rng, *shape)
    data = encode_png(array, rendered=True)
    assert data == encode_png(array.copy(), rendered=True)
    for back in (decode_png(data), np.asarray(pillow(data)), codecs.png_decode(data)):
        assert back.dtype == np.uint8
        np.testing.assert_array_equal(back, array)


@pytest.mark.parametrize("seed", range(4))
def test_specks_on_nothing_come_back(seed):
    """Behind a run of zeros a pixel of four rare bytes takes the most bits that one pixel can take."""
    rng = np.random.default_rng(seed)
    array = np.zeros((240, 320, 4), np.uint8)
    array[60:180, 80:240] = (100 + 20 * np.sin(np.arange(160) / 40))[None, :, None]
    for _ in range(200):
        array[rng.integers(240), rng.integers(320)] = rng.integers(1, 256, 4)
    data = encode_png(array, rendered=True)
    np.testing.assert_array_equal(np.asarray(pillow(data)), array)
    np.testing.assert_array_equal(decode_png(data), array)


@pytest.mark.parametrize("dtype", [np.bool_, np.uint8, np.uint16])
def test_what_is_no_picture_of_colours_is_written_as_ever(dtype):
    array = random_picture((20, 30), dtype)
    assert encode_png(array, rendered=True) == encode_png(array)


def test_png_of_a_view_is_that_of_its_copy():
    array = random_picture((20, 30, 3), np.uint8)
    for view in (array[::2, ::-1], array.transpose(1, 0, 2), array[..., 1]):
        np.testing.assert_array_equal(decode_png(encode_png(view)), view)
        np.testing.assert_array_equal(np.asarray(pillow(encode_png(view))), view)
    flags = array[..., 0] > 99
    np.testing.assert_array_equal(decode_png(encode_png(flags[:, 3:14])), flags[:, 3:14])


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("dtype", [np.float32, np.int32])
@pytest.mark.parametrize("components", [0, 1, 2, 3])
def test_tiff_round_trip(size, components, dtype):
    array = random_picture(size + ((components,) if components else ()), dtype)
    back = decode_tiff(encode_tiff(array))
    expected = array[..., 0] if components == 1 else array
    assert back.dtype == dtype
    assert back.shape == expected.shape
    np.testing.assert_array_equal(back, expected)
    assert encode_tiff(array) == encode_tiff(array[::-1][::-1])


@pytest.mark.parametrize("dtype", [np.float32, np.int32])
def test_pillow_reads_single_component_tiff(dtype):
    array = random_picture((21, 34), dtype)
    np.testing.assert_array_equal(np.asarray(pillow(encode_tiff(array))), array)


def test_tiff_keeps_every_bit():
    array = np.array([[np.inf, -np.inf, np.nan, -0.0, 1e-42, 3.4e38]], np.float32)
    assert decode_tiff(encode_tiff(array)).tobytes() == array.tobytes()


@pytest.mark.parametrize(
    "array",
    [
        np.zeros((4, 4), np.int64),
        np.zeros((4, 4, 2), np.uint8),
        np.zeros((4, 4, 3), np.uint32),
        np.zeros((0, 4), np.uint8),
        np.zeros((4, 4, 3), np.bool_),
        np.zeros(4, np.uint8),
    ],
)
def test_png_refuses_what_it_cannot_hold(array):
    with pytest.raises(ValueError, match="encode_png: expected"):
        encode_png(array)


@pytest.mark.parametrize(
    "array",
    [np.zeros((4, 4)), np.zeros((4, 4, 4), np.float32), np.zeros((0, 4), np.int32), np.zeros(3, np.float32)],
)
def test_tiff_refuses_what_it_cannot_hold(array):
    with pytest.raises(ValueError, match="encode_tiff: expected"):
        encode_tiff(array)


@pytest.mark.parametrize(
    ("encode", "decode", "dtype"),
    [(encode_png, decode_png, np.uint8), (encode_tiff, decode_tiff, np.float32)],
)
def test_damage_is_a_clear_error(encode, decode, dtype):
    data = encode(random_picture((16, 16), dtype))
    for cut in (0, 3, 20, len(data) // 2, len(data) - 1):
        with pytest.raises(UserError, match=r"PNG|TIFF"):
            decode(data[:cut])
    for place in (1, len(data) // 2):
        damaged = bytearray(data)
        damaged[place] ^= 0x5A
        with pytest.raises(UserError, match=r"PNG|TIFF"):
            decode(bytes(damaged))


def test_another_programs_files_are_refused():
    png, tiff = io.BytesIO(), io.BytesIO()
    picture = Image.fromarray(random_picture((16, 16, 3), np.uint8)).quantize(16)
    picture.save(png, "PNG")
    picture.convert("RGB").save(tiff, "TIFF")
    with pytest.raises(UserError, match="another program"):
        decode_png(png.getvalue())
    with pytest.raises(UserError, match="another program"):
        decode_tiff(tiff.getvalue())
