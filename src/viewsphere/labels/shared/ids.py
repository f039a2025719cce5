"""The ids in a label's data, and the renumbering of each kind of id when data sets are joined.

A label declares the kinds of ids in its data together with their renumbering, so that none can be left out: whole numbers
without a declaration are refused when the label is loaded.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import DTypeLike, NDArray

IdKind = Literal["category", "object", "part"]
"""Ids of a data set's categories, of a shot's objects, and of a model's parts, materials and triangles."""

Table = Mapping[int, int]
"""New ids by old ids."""

Renumber = Callable[[Any, Table], Any]
"""Returns data with the ids of one kind replaced; does not change its argument."""

Ids = Mapping[IdKind, Renumber]
"""The kinds of ids in some data, each with its renumbering."""


def by_table(array: NDArray[Any], ids: Table) -> NDArray[Any]:
    """The array with the new ids in place of the old ones; ids without a new one and numbers below 0 stay."""
    table = np.arange(max([int(array.max(initial=0)), *ids]) + 1, dtype=array.dtype)
    table[list(ids)] = list(ids.values())
    return np.where(array < 0, array, table[np.maximum(array, 0)])


def in_column(name: str, renumber: Renumber = by_table) -> Renumber:
    """The renumbering of one column of rows."""

    def renumbered_rows(rows: NDArray[Any], ids: Table) -> NDArray[Any]:
        out = rows.copy()
        out[name] = renumber(rows[name], ids)
        return out

    return renumbered_rows


def by_number(value: int | tuple[int, ...], ids: Table) -> int | tuple[int, ...]:
    """A number or several numbers, with new ids for those in the table."""
    return tuple(ids.get(one, one) for one in value) if isinstance(value, tuple) else ids.get(value, value)


def in_attributes(*names: str) -> Renumber:
    """The renumbering of some attributes of a dataclass, or of several dataclasses."""

    def renumbered_parts(value: Any, ids: Table) -> Any:
        if isinstance(value, tuple):
            return tuple(renumbered_parts(one, ids) for one in value)
        return replace(value, **{name: by_number(getattr(value, name), ids) for name in names})

    return renumbered_parts


def renumbered(value: Any, ids: Ids | None, tables: Mapping[IdKind, Table]) -> Any:
    """The value with the ids of the kinds in `tables` renumbered; unchanged if it has none of these kinds."""
    for kind, table in tables.items():
        if value is not None and ids and kind in ids:
            value = ids[kind](value, table)
    return value


def check_ids(where: str, ids: Ids | None, has_numbers: bool, example: str = "by_number") -> None:
    """Raise ValueError for whole numbers that do not declare their ids, and for unknown kinds of ids."""
    if ids is None and has_numbers:
        raise ValueError(
            f"{where} holds whole numbers, and does not declare the ids among them. Set "
            f"`ids={{'category': {example}}}` (or 'object', 'part'), or `ids={{}}` if none of them is an id."
        )
    for kind, renumber in (ids or {}).items():
        if kind not in get_args(IdKind):
            raise ValueError(f"{where} declares ids of {kind!r}. Valid kinds are {', '.join(get_args(IdKind))}.")
        if not callable(renumber):
            raise ValueError(f"{where} declares ids of {kind!r} without a function that renumbers them.")


def has_whole_numbers(dtype: DTypeLike) -> bool:
    """Return whether arrays of a type hold whole numbers, in at least one column."""
    kind = np.dtype(dtype)
    if kind.fields:
        return any(has_whole_numbers(column) for column, *_ in kind.fields.values())
    return kind.base.kind in "iu"


def is_of_numbers(type_: Any) -> bool:
    """Return whether values of a field's type are whole numbers, or dataclasses that contain some."""
    if is_dataclass(type_):
        return any("int" in str(one.type) for one in fields(type_))
    return type_ is int
