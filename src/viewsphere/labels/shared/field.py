"""A field of a label: the type of its values, and their conversion to plain JSON data and back."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from viewsphere.labels.shared.ids import Ids, check_ids, is_of_numbers


@dataclass(frozen=True)
class Field:
    """One field of an object or of a picture. With an empty `shape` it is a number, a text, or a plain dataclass of these and
    of tuples of numbers. Otherwise it is a tuple of numbers or an array, whose `shape` has -1 where any length is allowed.
    `many` means a tuple of any number of such values. `optional` allows None for a missing value.

    `ids` are the kinds of ids in a value, each with a function that replaces them. Fields of whole numbers must declare `ids`;
    raises ValueError for those that do not.
    """

    name: str
    meaning: str
    type: Any
    shape: tuple[int, ...] = ()
    unit: str = ""
    axes: str = ""
    is_array: bool = False
    optional: bool = False
    many: bool = False
    ids: Ids | None = None

    def __post_init__(self) -> None:
        check_ids(f"field {self.name!r}", self.ids, is_of_numbers(self.type))

    @property
    def is_regular(self) -> bool:
        """Return whether all its values have one shape."""
        return not self.many and -1 not in self.shape

    def plain(self, value: Any) -> Any:
        """The value as plain JSON data; NaN becomes null."""
        if value is not None and self.many:
            return [self._plain(one) for one in value]
        return self._plain(value)

    def _plain(self, value: Any) -> Any:
        if hasattr(value, "__dataclass_fields__"):
            return {
                name: _without_nan(list(part) if isinstance(part, tuple) else part) for name, part in value.__dict__.items()
            }
        if isinstance(value, np.ndarray):
            return _without_nan(value.tolist())
        return _without_nan(list(value) if isinstance(value, tuple) else value)

    def value(self, plain: Any) -> Any:
        """The value that `plain` was made from, to the last bit."""
        value = tuple(map(self._value, plain)) if plain is not None and self.many else self._value(plain)
        self.check(value)
        return value

    def _value(self, plain: Any) -> Any:
        if plain is None and self.optional:
            return None
        if self.is_array:
            found = np.array(plain, self.type)
            return found if found.size or -1 not in self.shape else np.empty([max(n, 0) for n in self.shape], self.type)
        if plain is None:
            return math.nan
        if self.shape:
            return tuple(map(_number, plain))
        if hasattr(self.type, "__dataclass_fields__"):
            return self.type(**{n: tuple(part) if isinstance(part, list) else _number(part) for n, part in plain.items()})
        return plain

    def check(self, value: Any) -> None:
        """Raise ValueError for a value that the field cannot have; NaN means an unknown number."""
        if value is None and self.optional:
            return
        if not (isinstance(value, tuple) and all(map(self._is_right, value)) if self.many else self._is_right(value)):
            some = "any number of " if self.many else ""
            raise ValueError(f"{self.name}: expected {some}{self.type.__name__} {self.shape or ''}, found {value!r:.60}")

    def _is_right(self, value: Any) -> bool:
        if isinstance(value, np.ndarray):
            return _is_shaped(value.shape, self.shape) and not np.isinf(value).any()
        if self.shape:
            return isinstance(value, tuple) and len(value) == self.shape[0] and all(map(_is_number, value))
        if isinstance(value, str):
            return self.type is str
        if hasattr(self.type, "__dataclass_fields__"):
            return all(_is_part(getattr(value, name), str(one.type)) for name, one in self.type.__dataclass_fields__.items())
        return self.type in {int, float} and _is_number(value)

    def equals(self, one: Any, other: Any) -> bool:
        """Return whether two values are the same number for number; NaN equals itself."""
        if one is None or other is None:
            return one is other
        if self.many:
            return len(one) == len(other) and all(map(self._equals, one, other))
        return self._equals(one, other)

    def _equals(self, one: Any, other: Any) -> bool:
        return np.array_equal(one, other, equal_nan=True) if self.is_array and self.type is not bool else _plainly(one, other)


def _is_part(value: Any, kind: str) -> bool:
    """Return whether a value fits a field of a dataclass: a text, numbers or a number."""
    if kind.startswith("tuple"):
        return isinstance(value, tuple) and all(map(_is_number, value))
    return isinstance(value, str) if kind == "str" else _is_number(value)


def _is_shaped(found: tuple[int, ...], wanted: tuple[int, ...]) -> bool:
    return len(found) == len(wanted) and all(b in (-1, a) for a, b in zip(found, wanted, strict=True))


def _number(value: Any) -> Any:
    return math.nan if value is None else value


def _is_number(value: Any) -> bool:
    return (
        isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool) and not abs(value) > _GREATEST
    )


_GREATEST = 1e300
"""A number above this limit is an error."""


def _without_nan(value: Any) -> Any:
    if isinstance(value, list):
        return [_without_nan(v) for v in value]
    return None if isinstance(value, float) and math.isnan(value) else value


def _plainly(one: Any, other: Any) -> bool:
    if isinstance(one, np.ndarray):
        return np.array_equal(one, other)
    return bool(one == other)
