"""What a recipe names with options of its own: `coco`, or `{coco: {category_ids: coco}}`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from pydantic import Field, JsonValue, model_serializer

from viewsphere.model.frozen import Frozen
from viewsphere.model.mistakes import shown

FORM = {
    "anyOf": [
        {"type": "string"},
        {"type": "object", "additionalProperties": {"type": "object"}, "minProperties": 1, "maxProperties": 1},
    ]
}
"""JSON schema of a named thing."""


class Named(Frozen):
    """A name, and options that whatever has the name checks itself."""

    name: str = Field(min_length=1)
    options: dict[str, JsonValue] = Field(default={})

    @model_serializer
    def _as_written(self) -> Any:
        return {self.name: self.options} if self.options else self.name


def named(what: str) -> Callable[[Any], Any]:
    """Reads both forms; `what` says in messages whose name is expected."""

    def read(value: Any) -> Any:
        if isinstance(value, str):
            return {"name": value}
        if isinstance(value, Mapping) and len(value) == 1:
            ((name, options),) = value.items()
            if isinstance(name, str) and isinstance(options, Mapping | None):
                return {"name": name, "options": options or {}}
        if isinstance(value, Named):
            return value
        raise ValueError(f"expected {what}'s name, or {{name: {{option: value}}}}; found {shown(value)}")

    return read
