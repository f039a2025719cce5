"""The kinds of value of a recipe's fields: numbers, ranges, colours, and their short forms."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from decimal import Decimal
from typing import Annotated, Any, cast

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Discriminator,
    Field,
    GetJsonSchemaHandler,
    Tag,
    model_validator,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Number, Positive
from viewsphere.validation.errors import nearest, shown


class OrShort:
    """Adds a short form, read by a BeforeValidator, to the JSON schema of a field."""

    def __init__(self, *forms: dict[str, Any]) -> None:
        self.forms = forms

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        return {"anyOf": [*self.forms, handler(core)]}


def pair(value: object) -> object:
    """A single number as two equal ones, for a field of two numbers; lists unchanged."""
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return value, value
    if not isinstance(value, (list, tuple)):
        raise ValueError(f"expected a number or a list of two; found {shown(value)}")
    return value


def _ordered(value: tuple[float, float]) -> tuple[float, float]:
    if value[0] > value[1]:
        raise ValueError(f"expected [low, high]; found {shown(value)}")
    return value


def shape_of(value: object) -> str:
    """The shape of a value, `mapping`, `list`, `text` or `number`, by which a union selects its only possible member."""
    if isinstance(value, (Mapping, Frozen)):
        return "mapping"
    if isinstance(value, (list, tuple)):
        return "list"
    return "text" if isinstance(value, str) else "number"


Point = tuple[Number, Number, Number]


class Range(Frozen):
    """Evenly spaced values from `start` up to `stop`, both included."""

    start: Number = Field(description="first value")
    stop: Number = Field(description="last value, included if a whole number of steps reaches it")
    step: Positive = Field(description="distance between values, above 0")

    @model_validator(mode="after")
    def _check(self) -> Range:
        if self.stop < self.start:
            raise ValueError(f"expected stop at or above start; found start {self.start:g} and stop {self.stop:g}")
        if (self.stop - self.start) / self.step > 1e12:
            raise ValueError(f"expected a step that gives at most 10^12 values; found {self.step:g}")
        return self

    @property
    def count(self) -> int:
        """Number of values; a last step that misses `stop` only by rounding still counts."""
        return math.floor((self.stop - self.start) / self.step + 1e-9) + 1

    def value(self, index: int) -> float:
        """start + index * step in decimal arithmetic: 0.3, not 0.30000000000000004; -0.3 + 3 * 0.1 is 0."""
        return float(Decimal(repr(self.start)) + index * Decimal(repr(self.step)))


Values = Annotated[
    Annotated[Number, Tag("number")]
    | Annotated[tuple[Number, ...], Field(min_length=1), Tag("list")]
    | Annotated[Range, Tag("mapping")],
    Discriminator(
        shape_of,
        custom_error_type="values",
        custom_error_message="expected a number, a list of numbers or {start, stop, step}",
    ),
]

Interval = Annotated[
    tuple[Number, Number],
    BeforeValidator(pair),
    AfterValidator(_ordered),
    OrShort({"type": "number"}),
]


def parse_color(value: object, also: str = "", words: Sequence[str] = ()) -> tuple[float, float, float]:
    """An sRGB colour, three numbers of 0..1, from its name, `#rgb`, `#rrggbb` or [r, g, b].

    Raises ValueError, which lists other allowed values (`also`), and suggests the nearest of the colours and `words`.
    """
    expected = f"expected {also}a colour name, '#rrggbb' or [r, g, b] of 0..1"
    if isinstance(value, str):
        code = value.strip().lower()
        if not code.startswith("#"):
            from PIL.ImageColor import colormap, getrgb

            if code not in colormap:
                raise ValueError(f"{expected}; found {shown(value)}{nearest(code, (*words, *colormap))}")
            r, g, b = (c / 255 for c in getrgb(code)[:3])
            return r, g, b
        if re.fullmatch(r"#[0-9a-f]{3}", code):
            code = "#" + "".join(2 * digit for digit in code[1:])
        if re.fullmatch(r"#[0-9a-f]{6}", code):
            r, g, b = (int(code[i : i + 2], 16) / 255 for i in (1, 3, 5))
            return r, g, b
    elif isinstance(value, (list, tuple)):
        numbers = [v for v in cast(Sequence[Any], value) if isinstance(v, (int, float)) and not isinstance(v, bool)]
        if len(value) == len(numbers) == 3 and all(0 <= v <= 1 for v in numbers):
            r, g, b = map(float, numbers)
            return r, g, b
    hint = "; put a '#' colour in quotes" if value is None else ""
    raise ValueError(f"{expected}; found {shown(value)}{hint}")


COLOR_FORMS = (
    {"type": "string", "description": "a CSS colour name or '#rrggbb'"},
    {
        "type": "array",
        "items": {"type": "number", "minimum": 0, "maximum": 1},
        "minItems": 3,
        "maxItems": 3,
        "description": "red, green, blue in sRGB, 0 to 1",
    },
)


def switch(value: object) -> bool | None:
    """True or False for on and off (as read by YAML 1.1 or 1.2), None for any other value."""
    if isinstance(value, bool):
        return value
    return {"on": True, "off": False}.get(value.lower()) if isinstance(value, str) else None
