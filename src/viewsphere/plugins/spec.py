"""The base of all specs: what a plug-in states about itself, checked when it is loaded."""

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self, get_args, get_origin

from pydantic import ConfigDict, Field, ModelWrapValidatorHandler, ValidationError, model_validator
from pydantic.fields import FieldInfo

from viewsphere.errors import PluginError, RecipeError
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.quantity import quantity
from viewsphere.model.fields.validation_errors import dotted, explained, report
from viewsphere.model.fields.validation_errors import read_options as read_as
from viewsphere.plugins.registry import Kind


@dataclass(frozen=True)
class Takes:
    """The number of values that the function of a field takes, besides options."""

    values: int


class Spec(Frozen):
    """A plug-in's functions and plain values. A field that is missing, unknown, or of another type is a PluginError that names
    the field; so is a function that cannot be called with as many values as its field declares.
    """

    model_config = ConfigDict(arbitrary_types_allowed=True, strict=True)

    KIND: ClassVar[Kind]

    @model_validator(mode="wrap")
    @classmethod
    def _explain(cls, data: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        try:
            made = handler(data)
        except ValidationError as error:
            raise PluginError(_lines(cls, error, data)) from None
        for name, field in cls.model_fields.items():
            count = _values(field, made.takes_options)
            if count is not None and getattr(made, name) is not None:
                _check_call(f"{cls.__name__}.{name}", getattr(made, name), count)
        return made

    def with_fields_of(self, field: str, names: Sequence[str]) -> Self:
        """Return the spec; raises PluginError where the class in a field lacks fields of these names."""
        lacking = [name for name in names if name not in getattr(self, field).model_fields]
        if lacking:
            expected = f"expected a class with the fields {', '.join(names)}"
            raise PluginError(f"{type(self).__name__}.{field}: {expected}; found no {lacking[0]}")
        return self

    @property
    def takes_options(self) -> bool:
        """Return whether functions may be given options after their other values."""
        return False


class SpecWithOptions(Spec):
    """A plug-in that a recipe may give options."""

    options: type[Frozen] | None = Field(default=None, description="the class of the options; without, there are none")

    def with_fields_of(self, field: str, names: Sequence[str]) -> Self:
        """Return the spec; raises PluginError where the class in a field lacks fields of these names."""
        lacking = [name for name in names if name not in getattr(self, field).model_fields]
        if lacking:
            expected = f"expected a class with the fields {', '.join(names)}"
            raise PluginError(f"{type(self).__name__}.{field}: {expected}; found no {lacking[0]}")
        return self

    @property
    def takes_options(self) -> bool:
        """Return whether the plug-in has options."""
        return self.options is not None

    def read_options(self, name: str, given: Mapping[str, Any], field: str) -> tuple[Frozen, ...]:
        """The options as the plug-in's class reads them, or nothing where it has none.

        Raises RecipeError for options that are not valid, as mistakes of the recipe's field.
        """
        if self.options is not None:
            return (read_as(self.options, given, field),)
        if given:
            raise RecipeError(f"{field}: expected no options, {name} has none; found {', '.join(given)}")
        return ()


def _lines(spec: type[Spec], error: ValidationError, data: Any) -> str:
    """A line for each mistake, unknown fields first: a missing field is often the one that was meant."""
    fields = tuple(spec.model_fields)
    unknown = {dotted((str(each["loc"][0]),)) for each in error.errors() if each["type"] == "extra_forbidden"}
    lines = report(explained(error, fields), data).splitlines()
    lines.sort(key=lambda line: line.partition(":")[0] not in unknown)
    return "\n".join(f"{spec.__name__}.{line}" for line in lines)


def _values(field: FieldInfo, takes_options: bool) -> int | None:
    """The number of values that a field's function takes; None for what is no function, or one of any values."""
    for mark in field.metadata:
        if isinstance(mark, Takes):
            return mark.values + takes_options
    declared = next((one for one in (field.annotation, *get_args(field.annotation)) if get_origin(one) is Callable), None)
    values = get_args(declared)[0] if declared is not None else ...
    return None if values is ... else len(values)


def _check_call(field: str, function: Callable[..., Any], count: int) -> None:
    """Raise PluginError for a function that cannot be called with so many values."""
    try:
        signature = inspect.signature(function)
    except ValueError:  # a builtin
        return
    try:
        signature.bind(*range(count))
    except TypeError:
        name = getattr(function, "__name__", "")
        raise PluginError(f"{field}: expected a function of {quantity(count, 'value')}; found {name}{signature}") from None
