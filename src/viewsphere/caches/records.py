"""Named tuples and dataclasses as plain data, for `arrays`."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields, is_dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from viewsphere.caches.arrays import Arrays, Content, number_type


def pack_records(value: Any) -> Content:
    """A value made of tuples, named tuples, dataclasses, arrays and numbers as plain data. Raises TypeError for others."""
    arrays: dict[str, NDArray[Any]] = {}
    return Content(_packed(value, arrays), arrays)


def unpack_records(content: Content, types: Iterable[type]) -> Any:
    """The value that `pack_records` made plain, of records of these types; others raise KeyError."""
    return _unpacked(content.about, content.arrays, {kind.__name__: kind for kind in types})


def _packed(value: Any, arrays: dict[str, NDArray[Any]]) -> Any:
    if value is None or (isinstance(value, bool | int | float | str) and not isinstance(value, np.generic)):
        return value
    if isinstance(value, np.ndarray):
        arrays[str(len(arrays))] = value
        return {"array": str(len(arrays) - 1)}
    if isinstance(value, np.generic):
        return {"number": [value.dtype.str, value.item()]}
    values = [_packed(part, arrays) for part in _parts(value)]
    return {"record": [type(value).__name__, values]} if type(value) is not tuple else {"tuple": values}


def _parts(value: Any) -> Iterable[Any]:
    if isinstance(value, tuple):
        return cast("tuple[Any, ...]", value)
    if is_dataclass(value):
        return [getattr(value, field.name) for field in fields(value)]
    raise TypeError(f"{type(value).__name__} is no record")


def _unpacked(about: Any, arrays: Arrays, types: dict[str, type]) -> Any:
    if not isinstance(about, dict):
        return about
    ((kind, held),) = cast("dict[str, Any]", about).items()
    if kind == "array":
        return arrays[held]
    if kind == "number":
        return number_type(held[0]).type(held[1])
    name, values = (None, held) if kind == "tuple" else held
    parts = [_unpacked(part, arrays, types) for part in values]
    return tuple(parts) if name is None else types[name](*parts)
