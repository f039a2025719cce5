"""Field: a value in a JSON file with its path, so that errors report the position of a wrong value."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

from viewsphere.errors import ModelError


@dataclass(frozen=True)
class Field:
    """A JSON value and its path in the file, such as `car.glb: meshes[0].primitives[1].indices`."""

    value: Any
    where: str

    def fail(self, expected: str) -> ModelError:
        """The error for this value; `expected` describes a valid one."""
        found = repr(self.value)
        return ModelError(f"{self.where}: expected {expected}, found {found if len(found) < 60 else found[:57] + '...'}")

    def __contains__(self, key: str) -> bool:
        """Return whether this object has the key."""
        return key in self.mapping()

    def mapping(self) -> dict[str, Any]:
        """This value as an object."""
        if not isinstance(self.value, dict):
            raise self.fail("an object")
        return cast("dict[str, Any]", self.value)

    def get(self, key: str) -> Field:
        """A member of this object, or an empty object if it is missing."""
        return Field(self.mapping().get(key, {}), f"{self.where}.{key}")

    def extension(self, name: str) -> Field | None:
        """The extension of this name, if the object has it."""
        extensions = self.get("extensions")
        return extensions.get(name) if name in extensions else None

    def items(self, key: str) -> list[Field]:
        """Items of a member that is an array; empty if the member is missing."""
        value = self.mapping().get(key, [])
        if not isinstance(value, list):
            raise Field(value, f"{self.where}.{key}").fail("an array")
        return [Field(v, f"{self.where}.{key}[{i}]") for i, v in enumerate(cast("list[Any]", value))]

    def item(self, key: str, index: int) -> Field:
        """One item of an array in the file's root; ModelError when the index is out of range."""
        value = self.mapping().get(key, [])
        if not isinstance(value, list):
            raise Field(value, f"{self.where}.{key}").fail("an array")
        members = cast("list[Any]", value)
        if not 0 <= index < len(members):
            raise ModelError(f"{self.where}.{key}: expected an index below {len(members)}, found {index}")
        return Field(members[index], f"{self.where}.{key}[{index}]")

    def integer(self, key: str, default: int | None = None) -> int:
        """A member that is a non-negative integer; required when there is no default."""
        value = self.mapping().get(key, default)
        if isinstance(value, float) and value.is_integer():
            value = int(value)
        if not isinstance(value, int) or isinstance(value, bool) or value < 0:
            raise Field(value, f"{self.where}.{key}").fail("a whole number that is not negative")
        return value

    def number(self, key: str, default: float) -> float:
        """A member that is a finite number."""
        return self.numbers(key, 1, (default,), scalar=True)[0]

    def numbers(self, key: str, count: int, default: tuple[float, ...], scalar: bool = False) -> tuple[float, ...]:
        """A member that is an array of `count` finite numbers."""
        value = self.mapping().get(key)
        if value is None:
            return default
        values: list[Any] = [value] if scalar else cast("list[Any]", value) if isinstance(value, list) else []
        real = [float(v) for v in values if isinstance(v, int | float) and not isinstance(v, bool) and abs(v) < 1e30]
        if len(real) != count or len(values) != count:
            raise Field(value, f"{self.where}.{key}").fail("a number" if scalar else f"{count} numbers")
        return tuple(real)

    def text(self, key: str, default: str = "") -> str:
        """A member that is a string."""
        value = self.mapping().get(key, default)
        if not isinstance(value, str):
            raise Field(value, f"{self.where}.{key}").fail("a string")
        return value

    def boolean(self, key: str, default: bool = False) -> bool:
        """A member that is true or false."""
        value = self.mapping().get(key, default)
        if not isinstance(value, bool):
            raise Field(value, f"{self.where}.{key}").fail("true or false")
        return value
