"""What files promise at their heads is known, and refused, before anything is unpacked."""

import io
import struct
import tracemalloc
import zipfile

import numpy as np
import pytest

from viewsphere.codecs.heads import JXL_BARE, JXL_BOXES, jxl_size, qoi_size
from viewsphere.codecs.npz import decode_npz, encode_npz
from viewsphere.codecs.pictures import decode_picture, encode_picture
from viewsphere.errors import UserError

LARGE = r"expected at most 268,435,456 pixels \(limit MAX_STORED_PIXELS\), found 60,000 x 60,000; set"
SIZES = [(1, 1), (8, 8), (256, 64), (640, 480), (641, 479), (1920, 1080), (1, 3000), (2000, 2)]


@pytest.mark.parametrize("size", SIZES)
def test_sizes_are_those_that_the_encoders_wrote(size):
    width, height = size
    picture = np.zeros((height, width, 3), np.uint8)
    assert qoi_size(encode_picture(picture, "qoi", None)) == size
    bare = encode_picture(picture, "jxl", None)
    assert jxl_size(bare) == size
    if bare.startswith(JXL_BARE):
        box = struct.pack(">I4s", 8 + len(bare), b"jxlc") + bare
        assert jxl_size(JXL_BOXES + struct.pack(">I4s4s", 12, b"ftyp", b"jxl ") + box) == size
        assert jxl_size(JXL_BOXES + struct.pack(">I4sQ", 1, b"jxlc", 16 + len(bare)) + bare) == size


@pytest.mark.parametrize("kind", ["qoi", "jxl"])
def test_cut_off_heads_are_refused(kind):
    data = encode_picture(np.zeros((40, 30, 3), np.uint8), kind, None)
    for end in range(len(JXL_BARE) + 2, min(len(data), 20)):
        with pytest.raises((ValueError, OSError, SyntaxError, UserError)):
            decode_picture(data[:end], 3)


def test_pictures_of_too_many_pixels_are_not_unpacked():
    promises = [
        b"qoif" + struct.pack(">IIBB", 60_000, 60_000, 3, 0) + bytes(7) + b"\1",
        JXL_BARE + (0 | 2 << 1 | 59_999 << 3 | 1 << 21).to_bytes(10, "little") + bytes(8),
    ]
    for data in promises:
        with pytest.raises(UserError, match=LARGE):
            decode_picture(data, 3)


@pytest.mark.parametrize("shape", [(60_000, 60_000), (60_000, 60_000, 3)])
def test_an_array_of_too_many_pixels_is_not_unpacked(shape):
    head, file = io.BytesIO(), io.BytesIO()
    np.lib.format.write_array_header_1_0(head, {"descr": "<f4", "fortran_order": False, "shape": shape})
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("depth.npy", head.getvalue() + bytes(1 << 24))
    tracemalloc.start()
    try:
        with pytest.raises(UserError, match=LARGE):
            decode_npz(file.getvalue(), "depth")
        assert tracemalloc.get_traced_memory()[1] < 1 << 22
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("shape", [(7,), (4, 5), (4, 5, 3)])
def test_arrays_within_the_limit_are_read_back(shape):
    array = np.arange(np.prod(shape), dtype=np.float32).reshape(shape)
    assert np.array_equal(decode_npz(encode_npz(array, "depth"), "depth"), array)
