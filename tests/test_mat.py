"""MATLAB's files, as scipy writes them, read as scipy reads them; what is cut off, crowded, deep or a bomb is refused."""

from __future__ import annotations

import struct
import tracemalloc
import zlib
from contextlib import suppress
from io import BytesIO

import numpy as np
import pytest

from viewsphere.codecs.mat import DEEPEST, read_mat

io = pytest.importorskip("scipy.io")

MOST_BYTES = 1 << 22
VALUES = {
    "table": np.arange(6.0).reshape(2, 3),
    "cube": np.arange(24, dtype=np.int16).reshape(2, 3, 4),
    "bytes": np.array([[1, 2, 255]], np.uint8),
    "single": np.array([[1.5]], np.float32),
    "long": np.array([[-(2**40)]], np.int64),
    "text": "d'été <à> 日本",
    "none": np.zeros((0, 0)),
    "flag": np.array([[True, False]]),
    "rec": {"filename": "a.jpg", "inner": {"x": 1.25, "deep": {"name": "é"}}},
}


def written(values, packed=True):
    file = BytesIO()
    io.savemat(file, values, do_compression=packed, long_field_names=True, oned_as="row")
    return file.getvalue()


def same(ours, scipys):
    if isinstance(ours, np.ndarray):
        assert ours.shape == scipys.shape and np.array_equal(ours, scipys) and ours.dtype.kind == scipys.dtype.kind
    elif isinstance(ours, str):
        assert ours == "".join(scipys.tolist())
    elif scipys.dtype.names:
        rows = scipys.ravel(order="F")
        assert len(ours) == len(rows)
        for one, row in zip(ours, rows, strict=True):
            assert list(one) == list(row.dtype.names)
            for name in one:
                same(one[name], row[name])
    else:
        cells = scipys.ravel(order="F")
        assert len(ours) == len(cells)
        for one, other in zip(ours, cells, strict=True):
            same(one, other)


@pytest.mark.parametrize("packed", [True, False])
def test_what_scipy_reads(packed):
    structs, cells = np.empty((2, 2), [("name", object), ("place", object)]), np.empty((1, 3), object)
    for i in range(4):
        structs[i // 2, i % 2] = (f"n{i}", np.array([[i, i + 0.5]]))
    cells[0] = ["a", np.eye(2), structs]
    data = written({**VALUES, "rows": structs, "cells": cells, "empty": structs[:0]}, packed)
    ours, scipys = read_mat(data, MOST_BYTES), io.loadmat(BytesIO(data), chars_as_strings=True)
    assert list(ours) == [name for name in scipys if not name.startswith("__")]
    for name, value in ours.items():
        same(value, scipys[name])


def big_endian(data, shape=(1, 2), kind=6, stored=9):
    """A file of one array, put together by hand."""
    body = struct.pack(">IIII", 6, 8, kind, 0) + struct.pack(">IIii", 5, 8, *shape) + struct.pack(">HH", 1, 1) + b"a\0\0\0"
    body += struct.pack(">II", stored, len(data)) + data + bytes(-len(data) % 8)
    return b"MATLAB 5.0".ljust(124) + b"\1\0MI" + struct.pack(">II", 14, len(body)) + body


def test_the_other_order_of_bytes_and_numbers_that_are_stored_smaller():
    for data in (big_endian(struct.pack(">2d", 1.5, -2)), big_endian(bytes([7, 9]), stored=2)):
        assert np.array_equal(read_mat(data, 999)["a"], io.loadmat(BytesIO(data))["a"])


def nested(levels):
    data = b""
    for _ in range(levels):
        body = struct.pack("<IIII", 6, 8, 1, 0) + struct.pack("<IIii", 5, 8, 1, 1) + struct.pack("<II", 1, 0) + data
        data = struct.pack("<II", 14, len(body)) + body
    return b"MATLAB 5.0".ljust(124) + b"\0\1IM" + data


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "expected a MATLAB file of version 5 to 7; found another"),
        (b"\x89HDF\r\n".ljust(200, b"x"), "expected a MATLAB file of version 5 to 7; found another"),
        (b"MATLAB 7.3 MAT-file".ljust(124) + b"\0\2IM" + bytes(400), "save it again with -v7"),
        (nested(DEEPEST + 1), "within one another"),
        (nested(2_000), "within one another"),
        (big_endian(b"", (-1, 2)), r"found an array of size \(-1, 2\)"),
        (big_endian(bytes(16), (2**30, 2**30)), "found 2 numbers in an array of size"),
        (big_endian(b"", (2**30, 2**30), kind=1), r"expected at most 1,000,000 arrays \(limit MAX_MAT_ARRAYS\)"),
        (big_endian(bytes(16), kind=3), "found an array of class 3, which is not read"),
        (big_endian(bytes(16), kind=5), "found an array of class 5, which is not read"),
        (big_endian(bytes(15)), "found numbers that are cut off"),
        (written({"z": np.array([[1j]])}), "found an array of class 6, which is not read"),
    ],
)
def test_what_is_refused(data, message):
    with pytest.raises(ValueError, match=message):
        read_mat(data, MOST_BYTES)


def element(kind, *values, code="I"):
    data = struct.pack(f"<{len(values)}{code}", *values)
    return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)


def of(*parts):
    """A file of one array of these elements."""
    body = b"".join(parts)
    return b"MATLAB 5.0".ljust(124) + b"\0\1IM" + struct.pack("<II", 14, len(body)) + body


def flags(kind):
    return element(6, kind, 0)


ONE, A, INF = element(5, 1, 1, code="i"), element(1, 97, code="b"), float("inf")
TYPED = {
    "flags that are none": (element(6), ONE, A, element(9, 1.0, code="d")),
    "flags of other numbers": (element(9, INF, code="d"), ONE, A, element(9, 1.0, code="d")),
    "a size of other numbers": (flags(1), element(9, 1.5, 1, code="d"), A),
    "a size of too many axes": (flags(6), element(5, *[1] * 33, code="i"), A, element(9, 1.0, code="d")),
    "a size of one axis": (flags(6), element(5, 1, code="i"), A, element(9, 1.0, code="d")),
    "a text of other numbers": (flags(4), ONE, A, element(9, 65.0, code="d")),
    "a text beyond Unicode": (flags(4), ONE, A, element(18, 0x110000)),
    "a text of half a pair": (flags(4), ONE, A, element(17, 0xD800, code="H")),
    "a text that is no UTF-8": (flags(4), ONE, A, element(16, 0xFF, code="B")),
    "names' length of other numbers": (flags(2), ONE, A, element(9, 0.5, code="d"), element(1, 97, code="b")),
}


@pytest.mark.parametrize("what", TYPED)
def test_elements_of_other_types_are_refused(what):
    with pytest.raises(ValueError, match=r"^found (an element|an array of size|numbers that|a text that)") as error:
        read_mat(of(*TYPED[what]), MOST_BYTES)
    assert type(error.value) is ValueError


@pytest.mark.parametrize(
    ("kind", "text"),
    [(2, "latin \xe9".encode("latin-1")), (4, "\U0001f600".encode("utf-16-le")), (18, "\U0001f600 a".encode("utf-32-le"))],
)
def test_texts_of_units_of_each_size(kind, text):
    units = len(text) // {2: 1, 4: 2, 18: 4}[kind]
    stored = struct.pack("<II", kind, len(text)) + text + bytes(-len(text) % 8)
    expected = text.decode({2: "latin-1", 4: "utf-16-le", 18: "utf-32-le"}[kind])
    assert read_mat(of(flags(4), element(5, 1, units, code="i"), A, stored), MOST_BYTES) == {"a": expected}


def peak(data):
    """The bytes that reading takes at most, whether or not it ends in a message."""
    tracemalloc.start()
    with suppress(ValueError):
        read_mat(data, MOST_BYTES)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return most


def test_memory_is_a_few_times_what_the_file_unpacks_to():
    count = MOST_BYTES // 2
    text = struct.pack("<II", 2, count) + b"a" * count
    fields = struct.pack("<II", 1, count) + bytes(count)
    none = element(5, 0, 0, code="i")
    assert peak(of(flags(4), element(5, 1, count, code="i"), A, text)) < 6 * count
    assert peak(of(flags(2), none, A, element(5, 1, code="i"), fields)) < 6 * count


@pytest.mark.slow
def test_a_bomb_is_not_unpacked():
    bomb = zlib.compress(bytes(MOST_BYTES * 50), 9)
    data = b"MATLAB 5.0".ljust(124) + b"\0\1IM" + struct.pack("<II", 15, len(bomb)) + bomb
    with pytest.raises(ValueError, match=f"found a file that unpacks to more than {MOST_BYTES:,} bytes"):
        read_mat(data, MOST_BYTES)
    many = struct.pack("<II", 15, len(zlib.compress(bytes(1000)))) + zlib.compress(bytes(1000))
    with pytest.raises(ValueError, match="found a file that unpacks to more than"):
        read_mat(b"MATLAB 5.0".ljust(124) + b"\0\1IM" + many * 5, 3000)


@pytest.mark.parametrize("packed", [True, False])
def test_half_written_and_damaged_files_end_in_a_message(packed):
    data, rng = written(VALUES, packed), np.random.default_rng(1)
    for end in range(0, len(data), 3):
        with suppress(ValueError):
            assert len(read_mat(data[:end], MOST_BYTES)) < len(VALUES)
    for _ in range(300):
        damaged = bytearray(data)
        for at in rng.integers(128, len(data), 3):
            damaged[at] = rng.integers(256)
        with suppress(ValueError):
            read_mat(bytes(damaged), MOST_BYTES)
