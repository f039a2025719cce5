"""The form of most formats: a tree of files. Every sample adds some whole files, and parts of other files.

A format's module defines a subclass of `Tree` and derives its functions from it:

    preparer, writer, verify = functions(Yolo)
"""

from __future__ import annotations

import shutil
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Generator, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import Any, NamedTuple

from viewsphere.errors import NotKeptError, UserError
from viewsphere.files import open_file
from viewsphere.formats.shared.writing.export_files import Content, Expected, check_files, put, same_bytes
from viewsphere.formats.shared.writing.paper import json_bytes
from viewsphere.labels import channels
from viewsphere.model.sample import Sample
from viewsphere.plugins.format import Remark
from viewsphere.scratch import temporary
from viewsphere.store import Dataset

FOLDER_SIZE = 10_000
"""Greatest number of files in a folder, unless a format sets another one."""


@dataclass(frozen=True)
class File:
    """A whole file, by its path from the export's folder."""

    path: str
    content: Content


@dataclass(frozen=True)
class Piece:
    """The next bytes of a section of a file to which many or all samples contribute. `between` precedes all pieces but the
    first. `count`: the number of the section's items in these bytes.
    """

    path: str
    data: bytes
    section: str = ""
    between: bytes = b""
    count: int = 1


def line(path: str, *values: object) -> Piece:
    """A line of words and numbers separated by spaces; floats have enough digits to be read back exactly."""
    return Piece(path, (" ".join(map(str, values)) + "\n").encode())


def item(path: str, value: Any, section: str = "") -> Piece:
    """An item of a JSON list."""
    return Piece(path, json_bytes(value), section, b",\n")


Layout = Iterable[bytes | str]
"""The parts of a file, in order: bytes, and every piece of the sections of these names."""

LINES: Layout = ("",)
LIST: Layout = (b"[\n", "", b"\n]\n")
OBJECT: Layout = (b"{\n", "", b"\n}\n")


class Tree(ABC):
    """The files that a format makes from a data set; each format defines a subclass. Some errors of the data set only appear
    during writing. They are raised as UserError, and leave no files.
    """

    def __init__(self, dataset: Dataset, *options: Any) -> None:
        self.dataset = dataset

    def stem(self, sample: Sample) -> str:
        """A path for the files of one sample, `<split>/<index>`, without an ending; large data sets have numbered folders
        between.
        """
        folder = self.dataset.plan.folder_of(sample.index, FOLDER_SIZE)
        return "/".join((sample.split or "all", *([] if folder is None else [f"{folder:04d}"]), f"{sample.index:08d}"))

    @abstractmethod
    def sample_files(self, sample: Sample) -> Iterator[File | Piece]:
        """Yield the files and pieces that a sample adds. Samples may come in any order, in several processes; their pieces are
        joined in the order of frames.
        """

    def rest(self) -> Iterator[File]:
        """Files that belong to no sample."""
        yield from ()

    def layout(self, path: str, counts: Mapping[str, int]) -> Layout:
        """Return the parts of a file; `counts` are the numbers of items in its sections."""
        return LIST if path.endswith(".json") else LINES

    def notes(self) -> Iterator[str]:
        """Lines for the user."""
        yield from ()


class _Functions(NamedTuple):
    """The functions that a format's module derives from a tree: see `viewsphere.plugins.format.FormatSpec`."""

    preparer: Callable[..., Callable[[Sample], list[Piece]]]
    writer: Callable[..., Any]
    verify: Callable[..., Iterator[Remark]]


def functions(kind: type[Tree]) -> _Functions:
    """The functions of the format of this tree."""

    def preparer(dataset: Dataset, folder: Path, *options: Any) -> Callable[[Sample], list[Piece]]:
        tree = kind(dataset, *options)

        def prepare(sample: Sample) -> list[Piece]:
            pieces: list[Piece] = []
            with _lacking_told(tree, sample):
                for one in tree.sample_files(sample):
                    if isinstance(one, Piece):
                        pieces.append(one)
                    else:
                        put(dataset, one.content, folder / one.path)
            return pieces

        return prepare

    @contextmanager
    def writer(
        dataset: Dataset, folder: Path, note: Callable[[str], None], *options: Any
    ) -> Generator[Callable[[list[Piece]], None]]:
        tree = kind(dataset, *options)
        with _collecting(tree, folder) as collected:
            yield collected.add
        for file in tree.rest():
            put(dataset, file.content, folder / file.path)
        for told in tree.notes():
            note(f"note: {told}")

    def verify(dataset: Dataset, folder: Path, sampled: Collection[int], *options: Any) -> Iterator[Remark]:
        tree = kind(dataset, *options)
        with temporary("proof") as scratch_folder:
            with _collecting(tree, scratch_folder) as collected:
                expected, again = _expected(tree, collected.add), _expected(tree, _nowhere)
                yield from check_files(dataset, folder, expected, again, collected.files.keys())
            for path in collected.files:
                yield from _different(scratch_folder / path, folder / path)

    return _Functions(preparer, writer, verify)


@contextmanager
def _lacking_told(tree: Tree, sample: Sample) -> Generator[None]:
    """Convert a missing channel or object label, which imported data sets may lack, into UserError."""
    try:
        yield
    except KeyError as error:
        if error.args and error.args[0] in channels():
            lacking = f"expected channel {error.args[0]}, found none: leave this format out"
            raise UserError(f"{tree.dataset.root}: frame {sample.index}: {lacking}") from None
        raise
    except NotKeptError as error:
        raise UserError(f"{tree.dataset.root}: frame {sample.index}: {error}") from None


def _nowhere(pieces: list[Piece]) -> None:
    """Ignore pieces, for callers that need none."""


def _expected(tree: Tree, add: Callable[[list[Piece]], None]) -> Iterator[Expected]:
    for sample in tree.dataset:
        for one in tree.sample_files(sample):
            if isinstance(one, Piece):
                add([one])
            else:
                yield sample.index, one.path, one.content
    yield from ((None, file.path, file.content) for file in tree.rest())


@contextmanager
def _collecting(tree: Tree, folder: Path) -> Generator[_Collected]:
    """Collect pieces, and assemble their files at the end."""
    with temporary("pieces") as scratch_folder:
        collected = _Collected(scratch_folder)
        yield collected
        for path, sections in collected.files.items():
            _assemble(tree, path, sections, folder / path)


def _assemble(tree: Tree, path: str, sections: Mapping[str, _Section], file: Path) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    with file.open("wb") as out:
        for part in tree.layout(path, {name: section.count for name, section in sections.items()}):
            if isinstance(part, bytes):
                out.write(part)
            elif part in sections:
                with open_file(sections[part].file) as pieces:
                    shutil.copyfileobj(pieces, out)


@dataclass
class _Section:
    """The pieces of a section, one after another, and their number of items."""

    file: Path
    count: int = 0


class _Collected:
    """Pieces in the order of their arrival, on disk, by file and section."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._count = 0
        self.files: dict[str, dict[str, _Section]] = {}

    def add(self, pieces: Iterable[Piece]) -> None:
        """Add pieces to the ends of their sections."""
        for piece in pieces:
            sections = self.files.setdefault(piece.path, {})
            if piece.section not in sections:
                self._count += 1
                folder = self._folder / f"{self._count // FOLDER_SIZE}"
                folder.mkdir(exist_ok=True)
                sections[piece.section] = _Section(folder / str(self._count))
            section = sections[piece.section]
            with section.file.open("ab") as file:
                file.write(piece.between + piece.data if section.count else piece.data)
            section.count += piece.count


def _different(wanted: Path, found: Path) -> Iterator[Remark]:
    """Yield the first difference between a file of joined pieces and the expected file."""
    if not found.is_file() or same_bytes(wanted, found):
        return
    with open_file(wanted) as ours, open_file(found) as theirs:
        for number, (one, other) in enumerate(zip_longest(ours, theirs, fillvalue=b""), 1):
            if one != other:
                at = next((i for i, (a, b) in enumerate(zip(one, other, strict=False)) if a != b), min(len(one), len(other)))
                begin = max(0, at - 40)
                told = f"expected {one[begin : at + 40]!r}, found {other[begin : at + 40]!r}"
                yield None, f"{found.name}: line {number}, byte {at}: {told}: export again"
                return
