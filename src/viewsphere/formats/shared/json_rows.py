"""Reads JSON files of any size row by row; the format defines which values are rows."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import IO, Any

from viewsphere.files import open_text

BLOCK = 1 << 16
LONGEST = 1 << 24
"""Fewest characters read at once (`BLOCK`), and most characters of a row (`LONGEST`)."""

LONGEST_NUMBER = 32
"""Number of characters to read after a number to be sure that it has ended."""

Where = tuple[str, ...]
"""Keys from the top of a file to a value in it; the key of a list's item is the item's `id`, or else its index."""

Row = tuple[Where, Any]


def rows(file: Path, opened: Collection[Where]) -> Iterator[Row]:
    """The values of a JSON file and their keys; objects and lists whose keys are in `opened` ("*" is any key) are replaced by
    their items.

    Raises ValueError for an invalid JSON file, OSError for an unreadable file.
    """
    with open_text(file, newline="") as text:
        reader = _Reader(text)
        yield from _below((), reader, opened, numbered=False)
        reader.end()


def _below(where: Where, reader: _Reader, opened: Collection[Where], *, numbered: bool) -> Iterator[Row]:
    kind = reader.peek()
    if kind in "{[" and any(len(p) == len(where) and all(a in ("*", b) for a, b in zip(p, where, strict=True)) for p in opened):
        yield from _items(where, reader, opened, named=kind == "{")
        return
    value = reader.value()
    if numbered and isinstance(value, dict) and "id" in value:
        where = (*where[:-1], f"id {value['id']}")
    yield where, value


def _items(where: Where, reader: _Reader, opened: Collection[Where], *, named: bool) -> Iterator[Row]:
    """The items of an object (`named`) or of a list."""
    reader.take("{" if named else "[")
    place = 0
    while reader.peek() != ("}" if named else "]"):
        if place:
            reader.take(",")
        key = str(place)
        if named:
            key = str(reader.value())
            reader.take(":")
        yield from _below((*where, key), reader, opened, numbered=not named)
        place += 1
    reader.take("}" if named else "]")


class _Reader:
    """A reader of values from the rest of a text, which holds only as much text as the next value needs."""

    def __init__(self, text: IO[str]) -> None:
        self._text = text
        self._buffer, self._at, self._gone = "", 0, 0
        self._decoder = json.JSONDecoder()

    def peek(self) -> str:
        """The next character other than white space; raises ValueError at the end of the text."""
        while True:
            while self._at < len(self._buffer) and self._buffer[self._at] in " \t\n\r":
                self._at += 1
            if self._at < len(self._buffer):
                return self._buffer[self._at]
            if not self._more():
                raise ValueError("expected more JSON, found the file's end: it is cut off")

    def take(self, character: str) -> None:
        """Skip the next character, which must be this one."""
        found = self.peek()
        if found != character:
            raise ValueError(f"character {self._gone + self._at:,}: expected {character!r}, found {found!r}")
        self._at += 1

    def value(self) -> Any:
        """The next complete value."""
        self.peek()
        while True:
            try:
                value, end = self._decoder.raw_decode(self._buffer, self._at)
                if len(self._buffer) - end > LONGEST_NUMBER or not self._more():
                    self._at = end
                    return value
            except json.JSONDecodeError as error:
                if len(self._buffer) > LONGEST or not self._more():
                    raise ValueError(f"character {self._gone + error.pos:,}: {error.msg}") from None

    def end(self) -> None:
        """Check the end of the text. Raises ValueError if anything but white space is left."""
        try:
            found = self.peek()
        except ValueError:
            return
        raise ValueError(f"character {self._gone + self._at:,}: expected the file's end, found {found!r}")

    def _more(self) -> bool:
        """Read another block, larger within a long value; False at the file's end."""
        block = self._text.read(max(BLOCK, len(self._buffer) - self._at))
        if block:
            self._gone += self._at
            self._buffer, self._at = self._buffer[self._at :] + block, 0
        return bool(block)
