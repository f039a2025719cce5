"""The base of all specs: the facts about a plug-in, checked when it is loaded."""

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Self

from pydantic import ConfigDict, Field, ModelWrapValidatorHandler, ValidationError, model_validator

from viewsphere.errors import PluginError, RecipeError
from viewsphere.model.fields.frozen import Frozen
from viewsphere.plugins.registry import Kind
from viewsphere.validation.errors import read_options as read_as
from viewsphere.validation.specs import check_calls, mistakes


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
            raise mistakes(cls, error, data) from None
        check_calls(made, made.takes_options)
        return made

    def with_fields_of(self, field: str, names: Sequence[str]) -> Self:
        """Return the spec; raises PluginError if the class in a field lacks fields of these names."""
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

    @property
    def takes_options(self) -> bool:
        """Return whether the plug-in has options."""
        return self.options is not None

    def read_options(self, name: str, given: Mapping[str, Any], field: str) -> tuple[Frozen, ...]:
        """The options as the plug-in's class reads them, or nothing if it has none.

        Raises RecipeError for options that are not valid, as mistakes of the recipe's field.
        """
        if self.options is not None:
            return (read_as(self.options, given, field),)
        if given:
            raise RecipeError(f"{field}: expected no options, {name} has none; found {', '.join(given)}")
        return ()
