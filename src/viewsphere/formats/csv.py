r"""A table for spreadsheets and data frames: one row for each object, with plain numbers and words.

    objects.csv                  a header, then a row for each object; UTF-8, commas, RFC 4180 with line ends \n
    <split>/<index>.png, ...     the pictures that the rows name, of any depth, as they are stored

Empty cells mean unknown or none. Frames without objects have a row with their picture alone.

Spreadsheets run texts that begin with =, +, -, @, a tab or a carriage return as formulas: such texts have a ' in front. `safe:
false` writes them as they are.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Collection, Generator, Iterator
from contextlib import contextmanager
from itertools import zip_longest
from pathlib import Path, PurePosixPath
from typing import Any

from pydantic import Field

from viewsphere.files import open_file
from viewsphere.formats import Scope
from viewsphere.formats.shared.writing.export_files import Expected, check_files, put
from viewsphere.formats.shared.writing.refusals import no_lone_mosaic
from viewsphere.model.channel import ALL_PICTURES
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.plugins.format import FormatSpec, Remark
from viewsphere.scratch import temporary
from viewsphere.store import Dataset

TABLE = "objects.csv"
BOXES = ("box2d", "box2d_projected", "box2d_unclipped")  # x0, y0, x1, y1 in pixels
OF_SAMPLE = ("image", "index", "split", "width", "height", "sequence", "sensor", "instant", "time")
OF_OBJECT = (
    "id",
    "category",
    "supercategory",
    "category_id",
    "key",
    "track",
    "area",
    "visibility",
    "truncation",
    "pose_category",
)
OF_VIEW = ("azimuth_deg", "elevation_deg", "distance", "tilt_deg")  # of the camera, seen from the object
LISTS = {
    **dict.fromkeys(BOXES, ("x0", "y0", "x1", "y1")),
    "quaternion": ("w", "x", "y", "z"),  # of camera_from_object
    "translation": ("x", "y", "z"),
    "size": ("width", "height", "length"),
}
FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""Beginnings of texts that spreadsheets run as formulas (https://owasp.org/www-community/attacks/CSV_Injection)."""

HEAD = (*OF_SAMPLE, *OF_OBJECT, *OF_VIEW, *(f"{name}_{part}" for name, parts in LISTS.items() for part in parts))


class _Options(Frozen):
    """Options of texts in the table."""

    safe: bool = Field(default=True, description="`true`: a ' in front of texts that spreadsheets would run as formulas")


def _preparer(dataset: Dataset, folder: Path, options: _Options) -> Callable[[Sample], list[list[Any]]]:
    """Puts a sample's picture in place, and makes its rows."""

    def prepare(sample: Sample) -> list[list[Any]]:
        for _, name, content in _picture(sample):
            put(dataset, content, folder / name)
        return list(_rows(sample, options))

    return prepare


@contextmanager
def _writer(
    dataset: Dataset, folder: Path, note: Callable[[str], None], options: _Options
) -> Generator[Callable[[list[list[Any]]], None]]:
    """Write the table."""
    with _table(folder / TABLE) as append:
        yield append


def _verify(dataset: Dataset, folder: Path, sampled: Collection[int], options: _Options) -> Iterator[Remark]:
    """Yield every difference from the current export."""
    with temporary("csv") as scratch_folder:
        with _table(scratch_folder / TABLE) as append:
            ours, others = _expected(dataset, options, append), _expected(dataset, options, lambda rows: None)
            yield from check_files(dataset, folder, ours, others, [TABLE])
        if (folder / TABLE).is_file():
            yield from _rows_that_differ(scratch_folder / TABLE, folder / TABLE)


def _expected(dataset: Dataset, options: _Options, append: Callable[[list[list[Any]]], None]) -> Iterator[Expected]:
    for sample in dataset:
        append(list(_rows(sample, options)))
        yield from _picture(sample)


def _picture(sample: Sample) -> Iterator[Expected]:
    if sample.picture_file is not None:
        yield sample.index, _name(sample), sample.picture_file


def _name(sample: Sample) -> str:
    """Return the path of the sample's picture in the export; empty without a picture."""
    if sample.picture_file is None:
        return ""
    return f"{sample.split or 'all'}/{sample.index:08d}{PurePosixPath(sample.picture_file).suffix}"


@contextmanager
def _table(file: Path) -> Generator[Callable[[list[list[Any]]], None]]:
    """An open table with its header, and the function that appends rows."""
    with file.open("w", encoding="utf-8", newline="") as out:
        rows = csv.writer(out, lineterminator="\n")
        rows.writerow(HEAD)
        yield rows.writerows


def _rows(sample: Sample, options: _Options) -> Iterator[list[Any]]:
    cell = _safe if options.safe else _cell
    own = [cell(value) for value in (_name(sample), *(getattr(sample, name) for name in OF_SAMPLE[1:]))]
    for o in sample.objects:
        yield [*own, *map(cell, _values(o))]
    if not sample.objects:
        yield [*own, *[""] * (len(HEAD) - len(own))]


def _values(o: ObjectAnnotation) -> Iterator[Any]:
    yield from (getattr(o, name) for name in OF_OBJECT)
    yield from (getattr(o.view, name) for name in OF_VIEW)
    for name, parts in LISTS.items():
        values = o.camera_from_object[:3, 3].tolist() if name == "translation" else getattr(o, name)
        yield from [None] * len(parts) if values is None else values


def _cell(value: Any) -> Any:
    """The text of a cell: numbers with enough digits to be read back exactly; NaN and None are empty."""
    return "" if value is None or (isinstance(value, float) and math.isnan(value)) else value


def _safe(value: Any) -> Any:
    """The cell in a form that no spreadsheet runs as a formula."""
    return f"'{value}" if isinstance(value, str) and value.startswith(FORMULA) else _cell(value)


def _rows_that_differ(wanted: Path, found: Path) -> Iterator[Remark]:
    """Yield the differing rows of two tables."""
    with open_file(wanted) as ours, open_file(found) as theirs:
        for number, (one, other) in enumerate(zip_longest(ours, theirs, fillvalue=b"")):
            if one != other:
                yield _frame_of(one), f"{TABLE}: row {number}: expected {one[:200]!r}, found {other[:200]!r}: export again"


def _frame_of(row: bytes) -> int | None:
    cells = next(csv.reader([row.decode("utf-8")]), [])
    return int(cells[1]) if len(cells) == len(HEAD) and cells[1].isdecimal() else None


def _refuses(scope: Scope, options: _Options) -> Iterator[str]:
    """Reasons to refuse: pictures that rows cannot name."""
    yield from no_lone_mosaic(scope)


FORMAT = FormatSpec(
    parallel_rays=True,
    rolling=True,
    about=__doc__,
    holds=("boxes", "poses", "views", "sizes"),
    read_by=("pandas", "any spreadsheet"),
    options=_Options,
    channels=(),  # pictures are used if there are any
    names_credits=False,
    pictures=ALL_PICTURES,
    panoramas=True,
    refuses=_refuses,
    writer=_writer,
    preparer=_preparer,
    verify=_verify,
)
