"""Entries, the classes of a recipe's parts of the scene, derived from the scene's own classes.

A field is written once, in the scene's class: the entry takes its limits, default and description from there, and allows
distributions over its values. The body of an entry holds only the fields that differ.
"""

from collections.abc import Collection, Mapping
from types import NoneType, UnionType
from typing import Annotated, Any, ClassVar, TypeVar, Union, cast, get_args, get_origin

from pydantic import BeforeValidator, Field, Strict
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import whole
from viewsphere.model.scene import LINEAR, PICTURE, SRGB
from viewsphere.recipe.draws import KINDS, Distribution, Drawn
from viewsphere.recipe.values import COLOR_FORMS, OrShort, parse_color
from viewsphere.validation.errors import shown

Part = TypeVar("Part", bound=Frozen)
Names = Collection[str]


class Entry(Frozen):
    """Base of a recipe's entries for parts of the scene."""

    part: ClassVar[type[Frozen]]


def entry_of(part: type[Part], *, without: Names = (), fixed: Names = (), optional: Names = ()) -> type[Part]:
    """A base for the entry of `part`: a subclass gets every field of the part that its own body and bases lack.

    without: fields that recipes do not have.
    fixed: fields that are not drawn, because planning needs them.
    optional: fields that are None unless given, because the entry has other ways to express them; they precede its own fields.

    For a type checker, an entry has the class of the part that is drawn from it, as with `Drawn`.
    """

    class Derived(Entry):
        def __init_subclass__(cls, **config: Any) -> None:
            super().__init_subclass__(**config)
            if Derived in cls.__bases__:
                cls.part = part
                _derive(cls, without, fixed, optional)

    return cast("type[Part]", Derived)


def concrete(entry: Frozen, **others: Any) -> Any:
    """The part of a scene for a drawn entry; `others` are fields that do not follow from the entry alone.

    Fields that are None get the defaults of the scene's class.
    """
    part = cast("Entry", entry).part
    values = {name: getattr(entry, name, None) for name in part.model_fields} | others
    return part(**{name: value for name, value in values.items() if value is not None})


def pictures_of(part: type[Frozen]) -> tuple[str, ...]:
    """Names of the fields in a class of the scene that hold the path of a picture."""
    return tuple(name for name, field in part.model_fields.items() if _has(_kind(field), PICTURE))


def words_of(part: type[Frozen], name: str) -> list[str]:
    """The words allowed for a field in a class of the scene."""
    return list(get_args(part.model_fields[name].annotation))


def is_drawn_color(value: Any) -> bool:
    """True if a value is a colour with distributions: a distribution over colours, or a list with one for a component."""
    if isinstance(value, Mapping):
        return not value.keys().isdisjoint(KINDS)
    parts = cast(tuple[Any, ...], value) if isinstance(value, (list, tuple)) else ()
    return any(isinstance(part, (list, tuple, Mapping, Distribution)) for part in parts)


def _srgb(value: Any) -> Any:
    return value if is_drawn_color(value) else parse_color(value)


def _linear(value: Any) -> Any:
    """A colour's name or code as linear light; numbers are linear already."""
    if not isinstance(value, str):
        return value
    return tuple(round(c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4, 9) for c in parse_color(value))


_READERS: dict[Any, tuple[Any, ...]] = {
    float: (Strict(),),
    bool: (Strict(),),
    int: (Strict(), BeforeValidator(whole)),
    LINEAR: (BeforeValidator(_linear), OrShort(COLOR_FORMS[0])),
    SRGB: (BeforeValidator(_srgb), OrShort(COLOR_FORMS[0])),
}
"""For a type or mark, additional validators of a recipe's values: strictness and short forms."""


def _derive(entry: type[Entry], without: Names, fixed: Names, optional: Names) -> None:
    """Add the fields of its part that an entry's class lacks, before pydantic collects the class's fields."""
    known = {name for base in entry.__mro__ for name in vars(base).get("__annotations__", {})}
    forms: dict[str, Any] = {}
    for name, field in entry.part.model_fields.items():
        if name not in known and name not in without:
            kind = _kind(field)
            form = _read(kind) if name in fixed else _form(kind)
            forms[name] = form | None if name in optional else form
            setattr(entry, name, _field(field, name in optional))
    first = {name: form for name, form in forms.items() if name in optional}
    entry.__annotations__ = first | entry.__annotations__ | forms


def _kind(field: FieldInfo) -> Any:
    """The type of a field, with its limits and marks."""
    return cast(Any, Annotated)[field.annotation, *field.metadata] if field.metadata else field.annotation


def _form(kind: Any, *limits: Any) -> Any:
    """The type, changed so that its values, and the values within them, may be distributions."""
    origin, args = get_origin(kind), get_args(kind)
    if origin is Annotated:
        return _form(args[0], *args[1:], *limits)
    if origin in (Union, UnionType):
        (inner,) = (arg for arg in args if arg is not NoneType)
        return _form(inner, *limits) | None
    if origin is tuple:
        kind = tuple[tuple(arg if arg is Ellipsis else _form(arg) for arg in args)]
    return cast(Any, Drawn)[_read(kind, *limits)]


def _read(kind: Any, *limits: Any) -> Any:
    """The type with its limits and the validators of `_READERS`."""
    marks = [kind, *(limit for limit in limits if isinstance(limit, str))]
    readers = [reader for mark in marks for reader in _READERS.get(mark, ())]
    return cast(Any, Annotated)[kind, *limits, *readers] if limits or readers else kind


def _field(field: FieldInfo, optional: bool) -> Any:
    """An entry's field with the default and description of the scene's field."""
    short = ", a name or '#rrggbb'" if _has(_kind(field), LINEAR, SRGB) else ""
    text = f"{field.description}{short}"
    if not optional:
        return Field(default=field.default, description=text)
    if field.default not in (None, PydanticUndefined):
        text += f"; default {field.default:g}" if isinstance(field.default, float) else f"; default {shown(field.default)}"
    return Field(default=None, description=text)


def _has(kind: Any, *marks: str) -> bool:
    """True if a type, or a type within it, has one of the marks."""
    args = get_args(kind)
    return any(mark in args for mark in marks) or any(_has(arg, *marks) for arg in args)
