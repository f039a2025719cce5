"""Names and options of formats, from a recipe, a call or a command line."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, JsonValue, TypeAdapter, ValidationError, WithJsonSchema, model_serializer

from viewsphere import plugins
from viewsphere.errors import RecipeError
from viewsphere.model.fields.frozen import Frozen
from viewsphere.plugins.format import FormatSpec
from viewsphere.validation.errors import report, shown

FORM = {
    "anyOf": [
        {"type": "string"},
        {"type": "object", "additionalProperties": {"type": "object"}, "minProperties": 1, "maxProperties": 1},
    ]
}


class FormatEntry(Frozen):
    """A format by its name, and options that the format itself checks; written `coco`, or `{coco: {category_ids: coco}}`."""

    name: str = Field(min_length=1)
    options: dict[str, JsonValue] = Field(default={})

    @model_serializer
    def _as_written(self) -> Any:
        return {self.name: self.options} if self.options else self.name

    def over(self, options: Mapping[str, JsonValue]) -> FormatEntry:
        """This entry with these options as defaults for its own."""
        return FormatEntry(name=self.name, options={**options, **self.options})

    def whole(self, field: str | None = None) -> FormatEntry:
        """This entry with a value for every option that the format has; raises as `arguments` does."""
        read = self.arguments(field)
        return FormatEntry(name=self.name, options=read[0].model_dump(mode="json") if read else {})

    def arguments(self, field: str | None = None) -> tuple[Frozen, ...]:
        """Return the last arguments of the format's functions: its `Options`, or nothing if it has none.

        Raises RecipeError for unknown options, as errors of `field` (default: the format's name), and UserError for an unknown
        format.
        """
        return plugins.load(FormatSpec, self.name).read_options(self.name, self.options, field or self.name)

    def notes(self, categories: Sequence[Any]) -> Iterator[str]:
        """Yield the format's notes on these options and a data set's categories; raises as `arguments` does."""
        spec = plugins.load(FormatSpec, self.name)
        if self.options and spec.notes is not None:
            yield from spec.notes(categories, *self.arguments())


def _entry(value: Any) -> Any:
    if isinstance(value, str):
        return {"name": value}
    if isinstance(value, Mapping) and len(value) == 1:
        ((name, options),) = value.items()
        if isinstance(name, str) and isinstance(options, Mapping | None):
            return {"name": name, "options": options or {}}
    if isinstance(value, FormatEntry):
        return value
    raise ValueError(f"expected a format's name, or {{name: {{option: value}}}}; found {shown(value)}")


FormatField = Annotated[FormatEntry, BeforeValidator(_entry), WithJsonSchema(FORM)]
_FIELDS = TypeAdapter(tuple[FormatField, ...])

Formats = str | Sequence[str | Mapping[str, Mapping[str, Any]] | FormatEntry]
"""Requested formats: names in a text with commas, or a list of names and of mappings from a name to its options."""


def read_formats(formats: Formats) -> tuple[FormatEntry, ...]:
    """The formats as entries, each name once; raises RecipeError for invalid formats."""
    names = formats.split(",") if isinstance(formats, str) else formats
    listed = [name.strip() if isinstance(name, str) else name for name in names if name]
    try:
        entries = _FIELDS.validate_python(listed)
    except ValidationError as error:
        raise RecipeError(report(error, listed)) from None
    return tuple({entry.name: entry for entry in entries}.values())


def options_of(entries: Iterable[FormatEntry]) -> dict[str, dict[str, JsonValue]]:
    """The options of each format, by its name."""
    return {entry.name: entry.options for entry in entries}
