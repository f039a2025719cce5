"""Mistakes in the spec of a plug-in: fields, and functions that take other values than their fields declare."""

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from viewsphere.errors import PluginError
from viewsphere.validation.errors import dotted, explained, report
from viewsphere.validation.quantity import quantity


@dataclass(frozen=True)
class Takes:
    """The number of values that the function of a field takes, besides options."""

    values: int


def mistakes(spec: type[BaseModel], error: ValidationError, data: Any) -> PluginError:
    """A line for each mistake in a spec, unknown fields first: a missing field is often the one that was meant."""
    fields = tuple(spec.model_fields)
    unknown = {dotted((str(each["loc"][0]),)) for each in error.errors() if each["type"] == "extra_forbidden"}
    lines = report(explained(error, fields), data).splitlines()
    lines.sort(key=lambda line: line.partition(":")[0] not in unknown)
    return PluginError("\n".join(f"{spec.__name__}.{line}" for line in lines))


def check_calls(spec: BaseModel, takes_options: bool = False) -> None:
    """Raise PluginError for a function in a spec that cannot be called with as many values as its field declares."""
    kind = type(spec)
    for name, field in kind.model_fields.items():
        count, function = _values(field, takes_options), getattr(spec, name)
        if count is not None and function is not None:
            _check_call(f"{kind.__name__}.{name}", function, count)


def _values(field: FieldInfo, takes_options: bool) -> int | None:
    """The number of values that a field's function takes; None for values that are no functions, and for functions of any
    number of values.
    """
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
