"""Writes pictures, masks, depth and `dataset1.json`."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Collection, Generator, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO

from viewsphere.formats.native.entries import Entry, entries_of, files
from viewsphere.formats.shared.json_proof import check_json
from viewsphere.formats.shared.json_rows import Where
from viewsphere.formats.shared.writing.export_files import Expected, check_files, models, put
from viewsphere.formats.shared.writing.paper import json_bytes, vehicles
from viewsphere.model.sample import Sample
from viewsphere.plugins.format import Remark
from viewsphere.scratch import temporary
from viewsphere.store import Dataset

OPENED: tuple[Where, ...] = (
    *((), ("vehicles",), ("poses",)),
    *(("poses", "*"), ("poses", "*", "vehicles_rendered")),
)
"""The parts of the JSON that the proof compares item by item."""


FILE_NAME = "dataset1.json"
Place = tuple[int, int, int, int]
"""An object's entry in the waiting file: pose, position of the pose's keys, position of the entry, and its end."""


def preparer(dataset: Dataset, folder: Path) -> Callable[[Sample], list[Entry]]:
    """Puts a sample's picture, masks and depth in place, and makes its entries of `dataset1.json`."""

    def prepare(sample: Sample) -> list[Entry]:
        for _, name, content in files(dataset, sample):
            put(dataset, content, folder / name)
        return entries_of(dataset, sample)

    return prepare


@contextmanager
def writer(dataset: Dataset, folder: Path, note: Callable[[str], None]) -> Generator[Callable[[list[Entry]], None]]:
    """Write `dataset1.json`, and models."""
    with _poses(dataset, folder) as append:
        yield append
    dataset.link_models(folder / "MODELS")


@contextmanager
def _poses(dataset: Dataset, folder: Path) -> Generator[Callable[[Sequence[Entry]], None]]:
    """Write the file into this folder. Yields a function that appends a frame's entries.

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
    """Write a frame's entries, each after the keys of its pose."""
    for entry in entries:
        head = waiting.tell()
        start = head + waiting.write(entry.keys)
        yield entry.pose, head, start, start + waiting.write(entry.own)


def _write_poses(file: IO[bytes], waiting: IO[bytes], places: Iterable[Place]) -> None:
    """Copy the entries, gathered by pose; a pose has the keys of its first frame."""
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


def verify(dataset: Dataset, folder: Path, sampled: Collection[int]) -> Iterator[Remark]:
    """Yield every difference from the current export; no proof is limited to the `sampled` frames."""
    with temporary("native") as scratch_folder:
        with _poses(dataset, scratch_folder) as append:
            again = _expected(dataset, lambda entries: None)
            yield from check_files(dataset, folder, _expected(dataset, append), again, [FILE_NAME])
        yield from check_json(scratch_folder / FILE_NAME, folder / FILE_NAME, OPENED, lambda where, value: None)


def _expected(dataset: Dataset, append: Callable[[Sequence[Entry]], None]) -> Iterator[Expected]:
    """Yield every file but the JSON; for the JSON, `append` receives each frame."""
    for sample in dataset:
        append(entries_of(dataset, sample))
        yield from files(dataset, sample)
    yield from models(dataset)
