"""CSV files that users write beside a recipe or a model."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from io import StringIO
from pathlib import Path

from viewsphere.errors import RecipeError
from viewsphere.files import read_bytes

Cells = dict[str, str | None]


def table_rows(path: Path, columns: Sequence[str]) -> Iterator[tuple[str, Cells]]:
    """The rows of a table with these and possibly more columns, each with its place, `FILE:LINE`.

    Raises RecipeError, which names file and line, for a file that is not a table, or lacks a column.
    """
    rows = csv.DictReader(StringIO(_text(path, columns), newline=""), skipinitialspace=True)
    try:
        headers = [name.strip().lower() for name in rows.fieldnames or ()]
        rows.fieldnames = headers
        if not set(columns) <= set(headers):
            raise RecipeError(f"{path}:1: expected columns {', '.join(columns)}; found {known_columns(columns, headers)}")
        for row in rows:
            if None in row:
                raise RecipeError(
                    f"{path}:{rows.line_num}: expected {len(headers)} cells, as the first line has; found more: put text that "
                    'holds a comma in "quotes"'
                )
            yield f"{path}:{rows.line_num}", row
    except csv.Error as error:
        raise _unreadable(f"{path}:{rows.reader.line_num}", columns, error) from None


def known_columns(wanted: Sequence[str], found: Sequence[str]) -> str:
    """A table's columns for a message. If no column is a wanted one, the file is another kind of table, and nothing of it is
    quoted.
    """
    if not found:
        return "nothing"
    return ", ".join(found) if set(wanted) & set(found) else "none of these"


def _text(path: Path, columns: Sequence[str]) -> str:
    try:
        data = read_bytes(path, "MAX_TABLE_BYTES")
    except OSError as error:
        raise _unreadable(str(path), columns, error.strerror or error) from None
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1
        raise _unreadable(f"{path}:{line}", columns, error) from None


def _unreadable(where: str, columns: Sequence[str], problem: object) -> RecipeError:
    return RecipeError(f"{where}: expected a readable CSV file of {', '.join(columns)}; found: {problem}")
