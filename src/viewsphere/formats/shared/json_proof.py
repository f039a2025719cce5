"""The comparison of an exported JSON file with a new export."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Iterator
from itertools import islice
from pathlib import Path
from typing import Any, Final, cast

from viewsphere.formats.shared.json_rows import Row, Where, rows
from viewsphere.formats.shared.writing.export_files import same_bytes
from viewsphere.plugins.format import Remark

ABSENT: Final = object()
"""The placeholder for a value that one of two files lacks."""

MOST_SHOWN = 3
"""Number of differences to name for one row."""


def check_json(
    wanted: Path, found: Path, opened: Collection[Where], frame_of: Callable[[Where, Any], int | None]
) -> Iterator[Remark]:
    """Yield the rows (see `rows`) of the file `found` that differ from `wanted`; `frame_of` returns the frame of a row.

    Equal files are read only as bytes. For other files, only the rows that have moved are held in memory.
    """
    if not found.is_file() or same_bytes(wanted, found):
        return
    same = True
    try:
        for where, one, other in _differing(rows(wanted, opened), rows(found, opened)):
            same = False
            lines = list(islice(_changes(one, other), MOST_SHOWN + 1))
            told = "; ".join(lines[:MOST_SHOWN]) + ("; ..." if len(lines) > MOST_SHOWN else "")
            yield frame_of(where, other if one is ABSENT else one), f"{found.name}: {'.'.join(where)}: {told}: export again"
    except (ValueError, RecursionError) as error:
        yield None, f"{found.name}: expected the JSON that is exported, found: {error}: export again"
        return
    if same:
        yield None, f"{found.name}: expected the bytes that are exported, found the same values in others: export again"


def _differing(wanted: Iterator[Row], found: Iterator[Row]) -> Iterator[tuple[Where, Any, Any]]:
    """Keys of the rows that differ with both values, in any order of rows; ABSENT for a missing row."""
    waiting: tuple[dict[Where, Any], dict[Where, Any]] = {}, {}  # rows without a match so far
    sides = {0: wanted, 1: found}
    while sides:
        for side, row in [(side, next(it, None)) for side, it in sides.items()]:
            if row is None:
                del sides[side]
            elif row[0] in waiting[1 - side]:
                other = waiting[1 - side].pop(row[0])
                if any(_changes(other, row[1])):
                    yield (row[0], other, row[1]) if side else (row[0], row[1], other)
            elif row[0] in waiting[side]:
                yield (row[0], ABSENT, row[1]) if side else (row[0], row[1], ABSENT)
            else:
                waiting[side][row[0]] = row[1]
    yield from ((where, value, ABSENT) for where, value in waiting[0].items())
    yield from ((where, ABSENT, value) for where, value in waiting[1].items())


def _changes(wanted: Any, found: Any, where: str = "") -> Iterator[str]:
    """Yield every leaf that differs. True and 1 are equal in Python but not in JSON."""
    if isinstance(wanted, dict) and isinstance(found, dict):
        one, other = cast(dict[str, Any], wanted), cast(dict[str, Any], found)
        for key in dict.fromkeys((*one, *other)):
            yield from _changes(one.get(key, ABSENT), other.get(key, ABSENT), f"{where}.{key}" if where else key)
    elif isinstance(wanted, list) and isinstance(found, list) and len(wanted) == len(found):
        for i, (one, other) in enumerate(zip(cast(list[Any], wanted), cast(list[Any], found), strict=True)):
            yield from _changes(one, other, f"{where}[{i}]")
    elif wanted != found or isinstance(wanted, bool) != isinstance(found, bool):
        yield f"{where + ': ' if where else ''}expected {_shown(wanted)}, found {_shown(found)}"


def _shown(value: Any) -> str:
    return "nothing" if value is ABSENT else f"{json.dumps(value):.60}"
