"""The elements of a PLY file as arrays: text and both orders of bytes (https://paulbourke.net/dataformats/ply/)."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.primitive import Int
from viewsphere.assets.readers.shared.numbers import numbers_in
from viewsphere.assets.readers.shared.text import decode

TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2", "uint16": "u2",
    "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "int64": "i8", "uint64": "u8", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
STRUCT_CODES = {
    "i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "i8": "q", "u8": "Q", "f4": "f", "f8": "d",
}  # fmt: skip
COMMENT = re.compile(rb"(?m)^[ \t]*(?:comment|obj_info)\b[^\r\n]*")
"""Some programs write comments between rows, too."""

MAX_HEADER = 1 << 20
"""Greatest length of a header in bytes: the longest known ones have a few thousand."""


@dataclass(frozen=True)
class _Property:
    """A column of an element: its type, and the type of the count before each list; None for single numbers."""

    name: str
    type: str
    count: str | None = None


@dataclass(frozen=True)
class _Element:
    """An element of a file: a table with a name, rows and columns."""

    name: str
    rows: int
    properties: tuple[_Property, ...]


@dataclass(frozen=True, eq=False)
class Lists:
    """The lists of a column, one after another, and the length of each."""

    values: NDArray[np.generic]
    counts: Int


Columns = dict[str, "NDArray[np.generic] | Lists"]


@dataclass(frozen=True, eq=False)
class PlyFile:
    """The content of a file: tables by name, in the order of the file, their columns, and the file's comments."""

    elements: dict[str, _Element]
    columns: dict[str, Columns]
    comments: tuple[str, ...]


def read_elements(folder: ModelFolder, data: bytes) -> PlyFile:
    """The elements of a PLY file; of two with the same name, the first. Raises ModelError for damaged files and other
    formats.
    """
    head, body = _split(folder, data)
    order, elements, comments = _header(folder, head)
    if order:
        columns, _ = _columns(folder, data, elements, order, body)
        return PlyFile(_by_name(elements), columns, comments)
    text, before = COMMENT.sub(b"", data[body:]), data.count(b"\n", 0, body)
    columns, rest = _text_columns(folder, text, elements, before)
    if rest:
        text, elements = _fitting(folder, text, elements, before)
        columns, _ = _text_columns(folder, text, elements, before)
    return PlyFile(_by_name(elements), columns, comments)


def _by_name(elements: Sequence[_Element]) -> dict[str, _Element]:
    return {element.name: element for element in reversed(elements)}


def _columns(
    folder: ModelFolder, data: bytes, elements: Sequence[_Element], order: str, at: int
) -> tuple[dict[str, Columns], int]:
    """Columns of all elements, and the number of bytes left."""
    columns: dict[str, Columns] = {}
    for element in elements:
        found, at = _Table(folder, data, element, order).read(at)
        columns.setdefault(element.name, found)
    return columns, len(data) - at


def _text_columns(
    folder: ModelFolder, text: bytes, elements: Sequence[_Element], before: int
) -> tuple[dict[str, Columns], int]:
    """The equivalent of `_columns` for a text, whose numbers are first converted to a binary file of doubles."""
    doubles = [replace(e, properties=tuple(_as_double(p) for p in e.properties)) for e in elements]
    return _columns(folder, numbers_in(folder, text, before).tobytes(), doubles, "<", 0)


def _fitting(folder: ModelFolder, text: bytes, elements: Sequence[_Element], before: int) -> tuple[bytes, list[_Element]]:
    """A text and its elements without the surplus numbers of lines that hold more than the header declares.

    MeshLab once wrote such lines. In such an element, columns after the last list are unreliable, and are left out, too.
    """
    lines = [(number, words) for number, line in enumerate(text.splitlines(), before + 1) if (words := line.split())]
    if len(lines) != (promised := sum(element.rows for element in elements)):
        raise folder.error(f"holds {len(lines):,} lines of numbers, its header promises {promised:,}; export the model again")
    kept: list[_Element] = []
    rows: list[bytes] = []
    for element in elements:
        part = lines[len(rows) : len(rows) + element.rows]
        kept.append(_trusted(folder, element, part))
        rows += [b" ".join(words[: _width(kept[-1], words)]) for _, words in part]
    return b"\n".join(rows), kept


def _trusted(folder: ModelFolder, element: _Element, lines: Sequence[tuple[int, list[bytes]]]) -> _Element:
    """The element with the columns whose positions in its lines are certain."""
    wrong = next(((number, words) for number, words in lines if _width(element, words) != len(words)), None)
    if wrong is None:
        return element
    found = f"line {wrong[0]:,} holds {len(wrong[1])} numbers for {_width(element, wrong[1])} in the header"
    folder.warn(f"{found}; the last columns of element {element.name!r} are not read")
    last = max((i for i, column in enumerate(element.properties) if column.count), default=len(element.properties))
    return replace(element, properties=element.properties[: last + 1])


def _width(element: _Element, words: Sequence[bytes]) -> int:
    """The number of words in a row whose lists have these lengths."""
    at = 0
    for column in element.properties:
        at += 1 + (int(float(words[at])) if column.count and at < len(words) else 0)
    return at


def _as_double(column: _Property) -> _Property:
    return replace(column, type="f8", count=column.count and "f8")


def _split(folder: ModelFolder, data: bytes) -> tuple[str, int]:
    """The header's text, and the offset of the body."""
    if not re.match(rb"ply\s", data):
        raise folder.error("expected a PLY file, which begins with 'ply'")
    end = re.compile(rb"[\r\n]end_header[ \t]*(\r\n|\r|\n|$)").search(data, 0, MAX_HEADER)
    if end is None:
        raise folder.error("its PLY header does not end (no 'end_header'): truncated or damaged")
    # After a header whose lines end in \r alone, a body may begin with the byte \n.
    is_mac = b"\n" not in data[: end.start() + 1]
    return decode(data[: end.start()]), end.end() - (1 if is_mac and end[1] == b"\r\n" else 0)


def _header(folder: ModelFolder, text: str) -> tuple[str, list[_Element], tuple[str, ...]]:
    order, elements, comments = None, list[_Element](), list[str]()
    for number, line in enumerate(re.split(r"\r\n|\r|\n", text), 1):
        words = line.split()
        try:
            if not words or words[0] in {"ply", "obj_info"}:
                continue
            if words[0] == "comment":
                comments.append(line.strip()[len("comment") :].strip())
            elif words[0] == "format":
                order = ORDERS[words[1]]
            elif words[0] == "element":
                elements.append(_Element(words[1], int(words[2]), ()))
            elif words[0] == "property":
                elements[-1] = replace(elements[-1], properties=(*elements[-1].properties, _property(words)))
            elif elements:
                raise ValueError
            else:  # before any element, it can only be a comment
                folder.warn(f"line {number} of its PLY header is ignored: {line.strip()[:80]!r}")
        except (KeyError, IndexError, ValueError):
            raise folder.error(f"line {number} of its PLY header cannot be read: {line.strip()[:80]!r}") from None
    if order is None or any(element.rows < 0 for element in elements):
        raise folder.error("its PLY header lacks a format, or has an element of fewer than 0 rows")
    return order, elements, tuple(comments)


def _property(words: list[str]) -> _Property:
    if words[1] == "list":
        return _Property(words[4].lower(), TYPES[words[3]], TYPES[words[2]])
    return _Property(words[2].lower(), TYPES[words[1]])


@dataclass(frozen=True, eq=False)
class _Table:
    """One element within the bytes of a file."""

    folder: ModelFolder
    data: bytes
    element: _Element
    order: str

    def read(self, at: int) -> tuple[Columns, int]:
        """The columns, and the offset of the next element."""
        if not self.element.properties or not self.element.rows:
            return {}, at
        least = sum(np.dtype(p.count or p.type).itemsize for p in self.element.properties)
        if self.element.rows * least > len(self.data) - at:
            raise self._truncated()
        return self._even(at) or self._ragged(at)

    def _truncated(self) -> Exception:
        return self.folder.error(
            f"promises {self.element.rows:,} rows of element {self.element.name!r}, but holds fewer: truncated or damaged"
        )

    def _dtype(self, kind: str) -> np.dtype[np.generic]:
        return np.dtype(self.order + kind)

    def _even(self, at: int) -> tuple[Columns, int] | None:
        """The columns if each list has the same length in all rows; None otherwise."""
        lengths = self._lengths(at)
        fields: list[tuple[str, np.dtype[np.generic], tuple[int, ...]]] = []
        for i, (column, length) in enumerate(zip(self.element.properties, lengths, strict=True)):
            if column.count:
                fields.append((f"n{i}", self._dtype(column.count), ()))
            fields.append((f"v{i}", self._dtype(column.type), (length,) if column.count else ()))
        row = np.dtype(fields)
        if at + self.element.rows * row.itemsize > len(self.data):
            if not any(column.count for column in self.element.properties):
                raise self._truncated()
            return None
        table = np.frombuffer(self.data, row, self.element.rows, at)
        columns: Columns = {}
        for i, (column, length) in enumerate(zip(self.element.properties, lengths, strict=True)):
            if column.count and (table[f"n{i}"] != length).any():
                return None
            values = table[f"v{i}"].reshape(-1)
            counts = np.full(self.element.rows, length, np.int64)
            columns.setdefault(column.name, Lists(values, counts) if column.count else values)
        return columns, at + self.element.rows * row.itemsize

    def _lengths(self, at: int) -> list[int]:
        """Length of each list of the first row, 1 for single numbers."""
        lengths: list[int] = []
        for column in self.element.properties:
            lengths.append(self._length(at, column.count) if column.count else 1)
            at += self._dtype(column.count).itemsize if column.count else 0
            at += lengths[-1] * self._dtype(column.type).itemsize
        return lengths

    def _length(self, at: int, kind: str) -> int:
        try:
            (length,) = struct.unpack_from((self.order) + STRUCT_CODES[kind], self.data, at)
        except struct.error:
            raise self._truncated() from None
        if not 0 <= length <= len(self.data):
            raise self.folder.error(f"a list of element {self.element.name!r} has {length:.12g} entries: damaged")
        return int(length)

    def _ragged(self, at: int) -> tuple[Columns, int]:
        """The columns of an element whose lists have different lengths."""
        lists = [p for p in self.element.properties if p.count]
        begins, at = self._begins(at)
        columns: Columns = {}
        base, step, offset = begins[0][:, 0] - self._before(lists[0]), 0, 0  # `base`: the row, then the end of its last list
        for column in self.element.properties:
            kind = self._dtype(column.type)
            if column.count:
                head = begins[step][:, 0]
                counts = begins[step][:, 1]
                places = head + self._dtype(column.count).itemsize
                columns.setdefault(column.name, Lists(self._gathered(places, counts, kind), counts))
                base, step, offset = places + counts * kind.itemsize, step + 1, 0
            else:
                columns.setdefault(column.name, self._gathered(base + offset, np.ones(len(base), np.int64), kind))
                offset += kind.itemsize
        return columns, at

    def _before(self, first: _Property) -> int:
        """Bytes of a row before its first list."""
        properties = self.element.properties
        return sum(self._dtype(p.type).itemsize for p in properties[: properties.index(first)])

    def _begins(self, at: int) -> tuple[list[Int], int]:
        """For each list column, the offset of each row's list and its length, (rows, 2); and the offset of the rows' end.

        This runs row by row, since a row's offset follows from the lengths before it.
        """
        steps, skip = [], 0
        for column in self.element.properties:
            size = self._dtype(column.type).itemsize
            if column.count:
                count = struct.Struct(self.order + STRUCT_CODES[column.count])
                steps.append((skip, count.unpack_from, count.size, size, list[int](), list[int]()))
                skip = 0
            else:
                skip += size
        try:
            at = _walk(self.data, at, self.element.rows, steps, skip)
        except (struct.error, ValueError, OverflowError):  # a list whose length is NaN or infinity
            raise self._truncated() from None
        if at > len(self.data):
            raise self._truncated()
        return [np.column_stack([places, lengths]).astype(np.int64) for *_, places, lengths in steps], at

    def _gathered(self, places: Int, counts: Int, kind: np.dtype[np.generic]) -> NDArray[np.generic]:
        """Values at these offsets, `counts` of them at each."""
        before = np.cumsum(counts) - counts
        at = np.repeat(places - before * kind.itemsize, counts) + np.arange(int(counts.sum())) * kind.itemsize
        octets = np.frombuffer(self.data, np.uint8)[at[:, None] + np.arange(kind.itemsize)]
        return np.ascontiguousarray(octets).view(kind).reshape(-1)


def _walk(data: bytes, at: int, rows: int, steps: Sequence[_Step], tail: int) -> int:
    """The offset of the end of the rows that begin here; each list's offset and length are added to its step."""
    for _ in range(rows):
        for before, unpack, head, size, places, lengths in steps:
            at += before
            length = int(unpack(data, at)[0])
            if length < 0:
                raise ValueError
            places.append(at)
            lengths.append(length)
            at += head + length * size
        at += tail
    return at


_Step = tuple[int, Callable[[bytes, int], tuple[Any, ...]], int, int, list[int], list[int]]
"""A list of a row: bytes before it, reader of its length, bytes of the length, bytes of an entry; offsets and lengths found."""
