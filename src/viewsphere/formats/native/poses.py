"""Writes `dataset1.json`, which is sorted by pose, from frames that come in another order."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO

from viewsphere.formats.native.entries import Entry
from viewsphere.formats.shared.paper import json_bytes, vehicles
from viewsphere.store import Dataset

FILE_NAME = "dataset1.json"

Place = tuple[int, int, int, int]
"""An object's entry in the waiting file: pose, position of the pose's keys, position of the entry, and its end."""


@contextmanager
def poses(dataset: Dataset, folder: Path) -> Generator[Callable[[Sequence[Entry]], None]]:
    """Write the file into this folder: gives a function that appends a frame's entries.

    Entries wait in a temporary file, and their positions in an SQLite table, which moves to disk once it is long.
    """
    with TemporaryFile(dir=folder) as waiting, closing(sqlite3.connect("")) as table:
        table.execute("PRAGMA journal_mode = OFF")
        table.execute("CREATE TABLE places (pose INTEGER, head INTEGER, start INTEGER, stop INTEGER)")

        def append(entries: Sequence[Entry]) -> None:
            table.executemany("INSERT INTO places VALUES (?, ?, ?, ?)", _places(entries, waiting))

        yield append
        with (folder / FILE_NAME).open("wb") as file:
            file.write(b'{"vehicles":' + json_bytes(vehicles(dataset.models)) + b',\n"poses":{')
            _write_poses(file, waiting, table.execute("SELECT * FROM places ORDER BY pose, start"))
            file.write(b"\n}}\n")


def _places(entries: Sequence[Entry], waiting: IO[bytes]) -> Iterator[Place]:
    """Write a frame's entries, each behind the keys of its pose."""
    for entry in entries:
        head = waiting.tell()
        start = head + waiting.write(entry.keys)
        yield entry.pose, head, start, start + waiting.write(entry.own)


def _write_poses(file: IO[bytes], waiting: IO[bytes], places: Iterable[Place]) -> None:
    """Copy the entries, gathered by pose; the keys of a pose are those of its first frame."""
    last = None
    for number, head, start, stop in places:
        waiting.seek(head)
        if number != last:
            file.write((b"}},\n" if last is not None else b"\n") + waiting.read(start - head))
        else:
            file.write(b",\n")
            waiting.seek(start)
        file.write(waiting.read(stop - start))
        last = number
    if last is not None:
        file.write(b"}}")
