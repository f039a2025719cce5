"""Deflate of runs, EXR and NPZ: every bit comes back, other programs read it, damage is said."""

from __future__ import annotations

import io
import zipfile
import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewsphere.codecs.deflate import deflate
from viewsphere.codecs.deflate.kernels_deflate import STORED
from viewsphere.codecs.exr import decode_exr, encode_exr
from viewsphere.codecs.npz import decode_npz, encode_npz
from viewsphere.codecs.png_tiff import encode_tiff
from viewsphere.errors import UserError

SHAPES = [(1, 1), (1, 9), (7, 1), (16, 5), (17, 13), (1, 1, 3), (5, 1, 3), (33, 40, 3)]
ODD = np.array([np.inf, -np.inf, np.nan, -0.0, 1e-42, 3.4e38, 1 / 3], np.float32)


def numbers(shape, dtype=np.float32):
    rng = np.random.default_rng(sum(shape))
    array = rng.integers(-(2**31), 2**31, shape).astype(np.int32)
    if dtype is np.int32:
        return array
    array = rng.normal(size=shape).astype(np.float32)
    array[len(array) // 2 :] = array[0, 0]
    array.flat[: len(ODD)] = ODD[: array.size]
    return array


def assert_comes_back(array):
    stream, checksum = deflate(array)
    machine = zlib.decompressobj(-15)
    assert machine.decompress(stream) == array.tobytes()
    assert machine.eof
    assert not machine.unused_data
    assert checksum == zlib.adler32(array)


@pytest.mark.slow
@given(st.lists(st.tuples(st.integers(1, 700), st.booleans()), min_size=1, max_size=12), st.sampled_from([1, 3]))
def test_any_runs_come_back(runs, components):
    rng = np.random.default_rng(len(runs))
    pixels = [np.repeat(rng.random((1, components)), n, 0) if same else rng.random((n, components)) for n, same in runs]
    array = np.concatenate(pixels).astype(np.float32)[None]
    array = array[..., 0] if components == 1 else array
    assert_comes_back(array)


def test_every_length_of_a_run_comes_back():
    for length in range(1, 900):
        array = np.full((1, length), 0.3, np.float32)
        array[0, 0] = 7
        assert_comes_back(array)


def test_deflate_is_small_for_runs_and_never_much_larger_than_its_input():
    noise = np.random.default_rng(0).random((300, 301, 3)).astype(np.float32)
    assert_comes_back(noise)
    assert len(deflate(noise)[0]) <= noise.nbytes + 5 * (noise.nbytes // STORED) + 64
    assert len(deflate(np.zeros((480, 640, 3), np.float32))[0]) < 3 * 480 * 640 * 4 / 100


def test_the_checksum_of_long_runs():
    for shape in ((1, 700_001), (2_000, 1_500, 3)):
        array = np.full(shape, -3e38, np.float32)
        array[-1, -1] = np.nan
        assert deflate(array)[1] == zlib.adler32(array)


def test_deflate_of_other_arrays():
    for array in (np.arange(24, dtype=np.int32).reshape(4, 6), np.ones((4, 5, 2), np.float32), np.eye(9, dtype=np.uint8)):
        assert_comes_back(array)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("dtype", [np.float32, np.int32])
def test_exr_round_trip(shape, dtype):
    array = numbers(shape, dtype)
    data = encode_exr(array)
    back = decode_exr(data)
    assert (back.dtype, back.shape) == (array.dtype, array.shape)
    assert back.tobytes() == array.tobytes()
    assert encode_exr(array[::-1][::-1]) == data


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("dtype", [np.float32, np.int32])
def test_openexr_reads_exr(shape, dtype, tmp_path):
    exr = pytest.importorskip("OpenEXR")
    array = numbers(shape, dtype)
    (tmp_path / "a.exr").write_bytes(encode_exr(array))
    channels = exr.File(str(tmp_path / "a.exr")).channels()
    name = "Z" if len(shape) == 2 else "RGB"
    assert list(channels) == [name]
    pixels = channels[name].pixels
    assert pixels.shape == shape
    assert np.ascontiguousarray(pixels).tobytes() == array.tobytes()


def test_exr_is_compressed():
    depth = np.tile(np.linspace(2, 9, 480, dtype=np.float32)[:, None], (1, 640))
    assert len(encode_exr(depth)) < depth.nbytes / 20


@pytest.mark.parametrize("array", [np.zeros((4, 4)), np.zeros((4, 4, 4), np.float32), np.zeros((0, 4), np.int32)])
def test_exr_refuses_what_it_cannot_hold(array):
    with pytest.raises(ValueError, match="encode_exr: expected"):
        encode_exr(array)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("dtype", [np.float32, np.int32])
def test_numpy_reads_npz(shape, dtype):
    array = numbers(shape, dtype)
    data = encode_npz(array, "depth")
    with np.load(io.BytesIO(data)) as found:
        assert found.files == ["depth"]
        assert (found["depth"].dtype, found["depth"].shape) == (array.dtype, array.shape)
        assert found["depth"].tobytes() == array.tobytes()
    assert zipfile.ZipFile(io.BytesIO(data)).testzip() is None
    assert decode_npz(data, "depth").tobytes() == array.tobytes()
    with pytest.raises(UserError, match="NPZ"):
        decode_npz(data, "normals")


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("dtype", [np.float32, np.int32])
def test_tifffile_reads_tiff(shape, dtype):
    tifffile = pytest.importorskip("tifffile")
    array = numbers(shape, dtype)
    found = tifffile.imread(io.BytesIO(encode_tiff(array)))
    assert (found.dtype, found.shape) == (array.dtype, array.shape)
    assert found.tobytes() == array.tobytes()


@pytest.mark.parametrize("shape", [(40, 30), (40, 30, 3)])
def test_damage_is_a_clear_error(shape):
    array = numbers(shape)
    exr, npz = encode_exr(array), encode_npz(array, "a")
    for cut in (0, 3, 8, 40, 200, 400, len(exr) // 2, len(exr) - 1):
        with pytest.raises(UserError, match="EXR"):
            decode_exr(exr[:cut])
    for cut in (0, 3, 40, 200, len(npz) // 2, len(npz) - 1):
        with pytest.raises(UserError, match="NPZ"):
            decode_npz(npz[:cut], "a")
    spoilt = bytearray(npz)
    spoilt[len(npz) // 2] ^= 0x5A
    with pytest.raises(UserError, match="NPZ"):
        decode_npz(bytes(spoilt), "a")


def test_exr_of_another_program_is_refused(tmp_path):
    exr = pytest.importorskip("OpenEXR")
    for compression in (exr.PIZ_COMPRESSION, exr.NO_COMPRESSION):
        exr.File({"compression": compression}, {"Z": numbers((9, 9))}).write(str(tmp_path / "a.exr"))
        with pytest.raises(UserError, match="another program"):
            decode_exr((tmp_path / "a.exr").read_bytes())
