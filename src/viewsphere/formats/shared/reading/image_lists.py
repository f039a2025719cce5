"""The import of pictures in splits, each with label files, from data sets of other tools into a store."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from viewsphere.errors import StoreError, UserError
from viewsphere.files import read_bytes, read_text
from viewsphere.formats.shared.reading.exif import upright
from viewsphere.model.sample import Sample
from viewsphere.store import Category
from viewsphere.store.foreign import ForeignDataset, ForeignFrame, ForeignModel, refuse_broken
from viewsphere.store.paths import file_inside, is_name
from viewsphere.validation.errors import dotted, first_of

SUFFIXES = (".jpg", ".jpeg", ".png", ".webp", ".bmp")
MISTAKES = (LookupError, TypeError, ValueError, AttributeError, ArithmeticError, OSError, SyntaxError, UserError)
"""Errors of files that are broken, missing or outside the folder, or that have an unexpected structure."""

SPLITS = TRAIN, VAL, TEST = ("train", "val", "test")
"""Splits that are reported first, in this order."""


@dataclass(frozen=True)
class Listed:
    """A picture of a split: its name in the data set, its size as shown, and its label files (None for a missing one)."""

    split: str
    name: str
    file: Path
    size: tuple[int, int]
    said: tuple[Path | None, ...]


Picture = TypeVar("Picture", bound=Listed)


def one_line(error: object) -> str:
    """An error's message without line breaks: for values out of bounds the first one with its field; Python's own messages get
    a frame.
    """
    match error:
        case ValidationError():
            place = error.errors(include_url=False)[0]["loc"]
            text = f"{dotted(place)}: {first_of(error)}" if place else first_of(error)
        case KeyError():
            text = f"found no {error}"
        case LookupError() | TypeError() | AttributeError() | ArithmeticError():
            text = f"found another structure than expected ({error})"
        case _:
            text = str(error)
    return " ".join(text.split())


def text_of(file: Path) -> list[str]:
    """The lines of a text within the size limit. Raises ValueError for invalid UTF-8."""
    return read_text(file, "MAX_ANNOTATION_BYTES").splitlines()


def lists(root: Path, folder: str, problems: list[str]) -> Iterator[tuple[str, Path, Sequence[str]]]:
    """The splits of a folder of lists, `<split>.txt`, below the root: train, val and test first, each with its file and its
    non-empty lines. `trainval` is skipped if train and val exist; the problems of unreadable lists are appended.
    """
    files = {file.stem: file for file in sorted((root / folder).glob("*.txt"))}
    if {TRAIN, VAL} <= files.keys():
        files.pop("trainval", None)
    for split in _ordered(files):
        try:
            rows = text_of(file_inside(root, files[split].relative_to(root).as_posix()))
        except MISTAKES as error:
            problems.append(f"{files[split]}: expected names of pictures; found: {one_line(error)}")
            continue
        if is_name(split):
            yield split, files[split], [row.strip() for row in rows if row.strip()]


def listed_dataset(
    path: Path,
    pictures: Sequence[Picture],
    categories: Iterable[Category],
    most: int,
    shown: Callable[[Picture, int], Sample],
    problems: Sequence[str],
    keep_going: bool,
    models: Sequence[ForeignModel] = (),
    also: str = "",
) -> ForeignDataset:
    """A data set of these pictures. `most`: the largest number of objects in a picture, or their largest id; `shown` returns
    the sample of a picture with this number; `also`: further text for the data set's digest.

    Raises StoreError for the problems, unless it is to keep going, and if there are no pictures.
    """
    if not keep_going:
        refuse_broken(problems)
    if not pictures:
        raise StoreError(f"{path}: expected pictures that can be used; found none")
    return ForeignDataset(
        name=(path.parent if path.is_file() else path).resolve().name,
        digest=_digest(pictures, (also, *problems)),
        categories=tuple(categories),
        splits=_ordered(picture.split for picture in pictures),
        channels=("rgb",),
        count=len(pictures),
        poses=0,
        max_objects=max(1, most),
        frames=partial(_frames, pictures, shown),
        models=tuple(models),
        left_out=tuple(problems),
    )


def _ordered(splits: Iterable[str]) -> tuple[str, ...]:
    """Each split once."""
    found = dict.fromkeys(splits)
    return (*(name for name in SPLITS if name in found), *(name for name in found if name not in SPLITS))


def unposed(picture: Listed, index: int, objects: Sequence[Any], source: Mapping[str, Any]) -> Sample:
    """A sample of a picture with an unknown camera pose."""
    return Sample(index, picture.split, None, None, tuple(objects), {}, {}, picture.size, source)


def _digest(pictures: Sequence[Listed], texts: Sequence[str]) -> str:
    """SHA-256 of the pictures' label files (each once), of their names, and of these texts."""
    digest, seen = hashlib.sha256(), set[Path]()
    for picture in pictures:
        digest.update(f"{picture.split}/{picture.name}\0".encode(errors="backslashreplace"))
        for file in picture.said:
            if file is None or file not in seen:
                digest.update(hashlib.sha256(read_bytes(file, "MAX_ANNOTATION_BYTES") if file else b"").digest())
                seen |= {file} if file else set()
    digest.update("\n".join(texts).encode(errors="backslashreplace"))
    return digest.hexdigest()


def _frames(pictures: Sequence[Picture], shown: Callable[[Picture, int], Sample]) -> Iterator[ForeignFrame]:
    for index, picture in enumerate(pictures):
        yield ForeignFrame(shown(picture, index), {"rgb": upright(picture.file, picture.size)})
