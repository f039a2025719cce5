"""Differences between two values of JSON, each in one line."""

from __future__ import annotations

import json
from collections.abc import Iterator
from itertools import islice
from textwrap import shorten
from typing import Any

MOST = 5
"""Maximum number of reported differences per file: one wrong field of a recipe often changes many fields of a plan."""

Difference = tuple[str, Any, Any]
"""The path of a field, the expected value and the stored one."""


class _Absent:
    """Represents a missing field."""

    def __repr__(self) -> str:
        return "no such field"


ABSENT = _Absent()


def differences(expected: Any, found: Any, path: str = "") -> Iterator[Difference]:
    """Yield the leaves at which two JSON values differ. Lists of different lengths differ as a whole."""
    if isinstance(expected, dict) and isinstance(found, dict):
        keys: dict[str, None] = dict.fromkeys((*expected, *found))
        for key in keys:
            where = f"{path}.{key}" if path else key
            yield from differences(expected.get(key, ABSENT), found.get(key, ABSENT), where)
    elif isinstance(expected, list) and isinstance(found, list) and len(expected) == len(found):  # pyright: ignore[reportUnknownArgumentType]
        for i, (one, other) in enumerate(zip(expected, found, strict=True)):  # pyright: ignore[reportUnknownArgumentType, reportUnknownVariableType]
            yield from differences(one, other, f"{path}[{i}]")
    elif type(expected) is not type(found) or expected != found:
        yield path, expected, found


def in_words(found: Iterator[Difference], file: str, source: str) -> Iterator[str]:
    """The first differences between a file and the values from `source`, in words."""
    for path, expected, value in islice(found, MOST):
        yield f"{file}: {path}: expected {_short(expected)}, which {source} gives; found {_short(value)}"


def _short(value: Any) -> str:
    text = repr(value) if isinstance(value, _Absent) else json.dumps(value)
    return shorten(text, 100, placeholder=" ...") if " " in text else text[:100]
