"""The base of all specs: what a plug-in states about itself, checked when it is loaded."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Self, cast, get_args, get_origin

from pydantic import ConfigDict, Field, ModelWrapValidatorHandler, ValidationError, model_validator

from viewsphere.errors import PluginError, RecipeError
from viewsphere.model.frozen import Frozen
from viewsphere.model.mistakes import explained, read_options, report
from viewsphere.plugins.registry import Kind


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
            lines = report(explained(error, tuple(cls.model_fields)), data).splitlines()
            raise PluginError("\n".join(f"{cls.__name__}.{line}" for line in lines)) from None
        for name, field in cls.model_fields.items():
            _check_call(f"{cls.__name__}.{name}", getattr(made, name), field.annotation, made.takes_options)
        return made

    @property
    def takes_options(self) -> bool:
        """Whether functions may be given options after their other values."""
        return False


class SpecWithOptions(Spec):
    """A plug-in that a recipe may give options."""

    options: type[Frozen] | None = Field(default=None, description="the class of the options; without, there are none")

    @property
    def takes_options(self) -> bool:
        """Whether the plug-in has options."""
        return self.options is not None

    def read(self, name: str, given: Mapping[str, Any], field: str) -> tuple[Frozen, ...]:
        """The options as the plug-in's class reads them, or nothing where it has none.

        Raises RecipeError for options that are not valid, as mistakes of the recipe's field.
        """
        if self.options is not None:
            return (read_options(self.options, given, field),)
        if given:
            raise RecipeError(f"{field}: expected no options, {name} has none; found {', '.join(given)}")
        return ()


def _check_call(field: str, value: Any, annotation: Any, takes_options: bool) -> None:
    """Raise PluginError for a function that takes another number of values than its field's type declares."""
    declared = next((one for one in (annotation, *get_args(annotation)) if get_origin(one) is Callable), None)
    if declared is None or not callable(value) or get_args(declared)[0] is ...:
        return
    count = len(cast(list[Any], get_args(declared)[0]))
    try:
        signature = inspect.signature(value)
    except ValueError:  # a builtin
        return
    if not any(_binds(signature, number) for number in ((count, count + 1) if takes_options else (count,))):
        raise PluginError(f"{field}: expected a function of {count} values; found {getattr(value, '__name__', '')}{signature}")


def _binds(signature: inspect.Signature, count: int) -> bool:
    try:
        signature.bind(*range(count))
    except TypeError:
        return False
    return True
