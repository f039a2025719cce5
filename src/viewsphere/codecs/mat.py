"""MATLAB's files of version 5 (R2006b and -v7), read within a memory limit, which scipy does not offer.

Source: MathWorks, MAT-File Format, https://www.mathworks.com/help/pdf_doc/matlab/matfile_format.pdf.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Container, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from viewsphere.limits import limits

HEAD, TAG = 128, 8
DTYPES = {
    1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8", 16: "u1", 17: "u2", 18: "u4",
}  # fmt: skip
MATRIX, COMPRESSED, UTF8, UTF16 = 14, 15, 16, 17
FLAGS, SIZES, NAMES, TEXTS = (6,), (5,), (1, 2, UTF8), (1, 2, 4, UTF16, 18)
"""Types of the elements that hold an array's flags, its sizes and lengths, its names, and texts in units of 1, 2 or 4 bytes."""

ENCODINGS = {1: "latin-1", 2: "utf-16-le", 4: "utf-32-le"}
CELL, STRUCT, CHAR, FIRST_NUMBER, LAST_NUMBER = 1, 2, 4, 6, 15
COMPLEX = 0x0800
DEEPEST = 16
"""Greatest nesting depth of arrays: each level takes several calls of Python's stack."""

MOST_AXES = 32
"""Greatest number of axes of an array: all versions of numpy support this many."""

Struct = list[dict[str, Any]]
"""A struct array, column by column."""


@dataclass
class _Reader:
    """The elements of some bytes, and how many arrays may still come."""

    order: str
    left: int = field(default_factory=lambda: limits.MAX_MAT_ARRAYS)

    def elements(self, data: memoryview) -> Iterator[tuple[int, memoryview]]:
        """The types and the bytes of all elements, one after another."""
        at = 0
        while at < len(data):
            if len(data) - at < TAG:
                raise ValueError("found a file that is cut off")
            kind, size = struct.unpack_from(self.order + "II", data, at)
            begin, step = at + TAG, size + (-size % 8 if kind != COMPRESSED else 0)
            if kind >> 16:  # up to four bytes are stored in the tag itself
                kind, size, begin, step = kind & 0xFFFF, kind >> 16, at + 4, 0
            if size > len(data) - begin or (step == 0 and begin == at + 4 and size > 4):
                raise ValueError("found a file that is cut off")
            yield kind, data[begin : begin + size]
            at += TAG + step

    def array(self, data: memoryview, depth: int) -> tuple[str, Any]:
        """An array's name and value."""
        self.left -= 1
        self._check(0)
        if depth > DEEPEST:
            raise ValueError(f"expected at most {DEEPEST} arrays within one another; found more")
        if not len(data):
            return "", np.zeros((0, 0))
        parts = self.elements(data)
        flags, sizes = int(self._next(parts, FLAGS, 2)[0]), self._next(parts, SIZES, 2)
        name = bytes(self._next(parts, NAMES)).decode("latin-1")
        kind, shape = flags & 0xFF, tuple(sizes[:MOST_AXES].tolist())
        if sizes.size > MOST_AXES or min(shape) < 0:
            raise ValueError(f"found an array of size {shape!r:.60}")
        count = math.prod(shape)
        if kind == CELL:
            return name, self._arrays(parts, count, depth)
        if kind == STRUCT:
            return name, self._struct(parts, count, depth)
        if flags & COMPLEX or not (kind == CHAR or FIRST_NUMBER <= kind <= LAST_NUMBER):
            raise ValueError(f"found an array of class {kind}, which is not read")
        return name, self._text(parts, shape) if kind == CHAR else _shaped(self._next(parts), shape)

    def _check(self, count: int) -> None:
        """Raise ValueError if this many further arrays exceed the limit."""
        if count > self.left:
            raise ValueError(f"expected at most {limits.MAX_MAT_ARRAYS:,} arrays (limit MAX_MAT_ARRAYS); found more")

    def _next(self, parts: Iterator[tuple[int, memoryview]], kinds: Container[int] = DTYPES, least: int = 0) -> Any:
        """Read the next element, which needs one of these types and at least this many numbers."""
        kind, data = next(parts, (0, memoryview(b"")))
        if kind not in kinds:
            raise ValueError(f"found an element of type {kind} where another belongs, or a file that is cut off")
        dtype = np.dtype(self.order + DTYPES[kind])
        if len(data) % dtype.itemsize or len(data) < least * dtype.itemsize:
            raise ValueError("found numbers that are cut off")
        return np.frombuffer(data, dtype)

    def _arrays(self, parts: Iterator[tuple[int, memoryview]], count: int, depth: int) -> list[Any]:
        """The values of the next arrays."""
        self._check(count)
        found: list[Any] = []
        for _ in range(count):
            kind, data = next(parts, (0, memoryview(b"")))
            if kind != MATRIX:
                raise ValueError("found a file that is cut off")
            found.append(self.array(data, depth + 1)[1])
        return found

    def _struct(self, parts: Iterator[tuple[int, memoryview]], count: int, depth: int) -> Struct:
        length, names = self._next(parts, SIZES), bytes(self._next(parts, NAMES))
        if length.size != 1 or not 0 < length[0] <= len(names) + 1 or len(names) % int(length[0]):
            raise ValueError("found a struct without names of fields")
        step = int(length[0])
        self._check(len(names) // step)
        fields = [names[i : i + step].split(b"\0")[0].decode("latin-1") for i in range(0, len(names), step)]
        if not fields:
            return []
        values = self._arrays(parts, count * len(fields), depth)
        return [dict(zip(fields, values[i : i + len(fields)], strict=True)) for i in range(0, len(values), len(fields))]

    def _text(self, parts: Iterator[tuple[int, memoryview]], shape: tuple[int, ...]) -> str:
        """A text; several rows are joined one after another."""
        kind, data = next(parts, (0, memoryview(b"")))
        if kind == UTF8:
            return _decoded(bytes(data), "utf-8")
        codes = self._next(iter([(kind, data)]), TEXTS)
        if kind != UTF16 or codes.size == math.prod(shape):
            codes = _shaped(codes, shape).ravel()
        return _decoded(codes.astype(codes.dtype.newbyteorder("<")).tobytes(), ENCODINGS[codes.itemsize])


def _decoded(data: bytes, encoding: str) -> str:
    try:
        return data.decode(encoding)
    except UnicodeDecodeError:
        raise ValueError(f"found a text that is no {encoding.upper()}") from None


def _shaped(numbers: Any, shape: tuple[int, ...]) -> Any:
    if numbers.size != math.prod(shape):
        raise ValueError(f"found {numbers.size:,} numbers in an array of size {shape!r:.60}")
    return numbers.reshape(shape, order="F")


def read_mat(data: bytes, most: int) -> dict[str, Any]:
    """The variables of a file by their names: arrays of numbers, texts, lists (cells) and `Struct`s.

    Raises ValueError for other files and for files that unpack to more than `most` bytes. It also does for classes, functions,
    sparse arrays and complex numbers, which are not supported.
    """
    mark = data[HEAD - 2 : HEAD]
    if mark not in (b"IM", b"MI") or data[:10] == b"MATLAB 7.3":
        raise ValueError("expected a MATLAB file of version 5 to 7; found another: save it again with -v7")
    reader, found, left = _Reader("<" if mark == b"IM" else ">"), dict[str, Any](), most
    for kind, body in reader.elements(memoryview(data)[HEAD:]):
        inner, parts = body, [(kind, body)]
        if kind == COMPRESSED:
            inner = _inflated(body, left)
            parts = reader.elements(inner)
        left -= len(inner)
        for own, content in parts:
            if own == MATRIX:
                name, value = reader.array(content, 1)
                found[name] = value
    return found


def _inflated(data: memoryview, most: int) -> memoryview:
    machine = zlib.decompressobj()
    try:
        found = machine.decompress(data, max(1, most))
    except zlib.error as error:
        raise ValueError(f"found bytes that cannot be unpacked: {error}") from None
    if not machine.eof:
        raise ValueError(f"found a file that unpacks to more than {most:,} bytes, or is cut off")
    return memoryview(found)
