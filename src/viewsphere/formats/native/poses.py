"""Writes `dataset1.json`, which is sorted by pose, from frames that come in another order."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO

from viewsphere.formats._paper import json_bytes, vehicles
from viewsphere.formats.native.entries import is_of_a_pose, pose, rendered
from viewsphere.model.sample import Sample
from viewsphere.store import Dataset

FILE_NAME = "dataset1.json"

Place = tuple[int, int, int, int]
"""An object's entry in the waiting file: pose, position of the pose's keys, position of the entry, and its end."""


@contextmanager
def poses(dataset: Dataset, folder: Path) -> Generator[Callable[[Sample], None]]:
    """Write the file into this folder: gives a function that appends a frame.

    Entries wait in a temporary file, and their positions in an SQLite table, which moves to disk once it is long.
    """
    with TemporaryFile(dir=folder) as waiting, closing(sqlite3.connect("")) as table:
        table.execute("PRAGMA journal_mode = OFF")
        table.execute("CREATE TABLE places (pose INTEGER, head INTEGER, start INTEGER, stop INTEGER)")

        def append(sample: Sample) -> None:
            if is_of_a_pose(sample):
                table.executemany("INSERT INTO places VALUES (?, ?, ?, ?)", _entries(dataset, sample, waiting))

        yield append
        with (folder / FILE_NAME).open("wb") as file:
            file.write(b'{"vehicles":' + json_bytes(vehicles(dataset.models)) + b',\n"poses":{')
            _write_poses(file, waiting, table.execute("SELECT * FROM places ORDER BY pose, start"))
            file.write(b"\n}}\n")


def _entries(dataset: Dataset, sample: Sample, waiting: IO[bytes]) -> Iterator[Place]:
    """Write a frame's entries, each behind the keys of its pose."""
    keys = json_bytes({**pose(dataset, sample), "vehicles_rendered": {}})[:-2]
    for name, entry in rendered(dataset, sample):
        head = waiting.tell()
        waiting.write(json_bytes(str(sample.pose.index)) + b":" + keys)
        start = waiting.tell()
        waiting.write(json_bytes(name) + b":" + json_bytes(entry))
        yield sample.pose.index, head, start, waiting.tell()


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
