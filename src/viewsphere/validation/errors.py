"""Validation errors in the user's words: where, what was expected, what was found, the nearest valid name."""

from __future__ import annotations

import re
from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TypeVar, cast

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails, InitErrorDetails, PydanticCustomError

from viewsphere.errors import MOST_TOLD, RecipeError
from viewsphere.validation.suggestions import suggestion

Options = TypeVar("Options", bound=BaseModel)

Path = tuple[str | int, ...]
EXPLAINED = "explained"

MOST_LISTED = 80
"""Number of valid names that a message lists: enough for all families of the zoo, fewer than a folder of models may have."""


class Place(NamedTuple):
    """The place of a value: a file and a line, counted from 1; or the option that sets the value, and 0."""

    file: str
    line: int

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:" if self.line else self.file


@dataclass(frozen=True)
class Marks:
    """The places of a recipe's values in its file and in the files that it extends. All marks compare equal, because places do
    not change a recipe's meaning.
    """

    file: str = field(default="", compare=False)
    places: Mapping[Path, Place] = field(default_factory=dict[Path, Place], compare=False)
    warnings: tuple[str, ...] = field(default=(), compare=False)

    def place(self, path: Path) -> Place:
        """Place of the value at `path`, or, if the value was not written, of the innermost written value around it."""
        while path and path not in self.places:
            path = path[:-1]
        return self.places.get(path, Place(self.file, 1))

    def located(self, message: str) -> str:
        """The message, preceded by file and line if it begins with a field, `models[0].source: ...`."""
        message = self._as_written(message)
        field_ = re.match(r"[A-Za-z_]+(?:\[\d+\]|\.\w+)*(?=: )", message)
        written = [path for path in self.places if path and _begins(message, dotted(path))]
        if not self.file or not (field_ or written):
            return message
        return f"{self.place(max(written, key=len, default=()))} {message}"

    def _as_written(self, message: str) -> str:
        """The message with the field as the file has it: `camera.also.NAME` for a sensor that `rig.sensors` does not list."""
        for path in self.places:
            if path[:2] == ("camera", "also") and len(path) == 3 and ("rig",) not in self.places:
                message = re.sub(rf"^rig\.sensors\.{re.escape(str(path[2]))}(?=[.:\[])", f"camera.also.{path[2]}", message)
        return message


def _begins(message: str, written: str) -> bool:
    """Return whether a message begins with this field, or with a field inside it."""
    return message.startswith(written) and re.match(r"(?:[.[][^:]*)?: ", message[len(written) :]) is not None


def nearest(name: object, known: Iterable[str]) -> str:
    """`; did you mean 'x'?` with the valid name that was most likely meant; empty if none is close."""
    meant = suggestion(name, known)
    return f"; did you mean {meant!r}?" if meant else ""


class Nearest:
    """`nearest` for errors that are reported together. Compares only as many names as the report shows, so that a wrong table
    of thousands of names costs no time.
    """

    def __init__(self) -> None:
        self._hints: dict[object, str] = {}

    def __call__(self, name: object, known: Iterable[str]) -> str:
        """Return the result of `nearest`, or an empty string for names beyond those that are shown."""
        if name not in self._hints:
            self._hints[name] = nearest(name, known) if len(self._hints) < MOST_TOLD else ""
        return self._hints[name]


def one_of(name: object, known: Sequence[str]) -> str:
    """`'d' is unknown; did you mean 'c'? Valid: a, b, c`, with the first `MOST_LISTED` names."""
    more = ", ..." if len(known) > MOST_LISTED else ""
    return f"{shown(name)} is unknown{nearest(name, known) or '.'} Valid: {', '.join(known[:MOST_LISTED]) or 'none'}{more}"


def different(one: Mapping[str, Any], other: Mapping[str, Any], most: int = 5) -> list[str]:
    """The fields in which two plain recipes differ, as `viewpoints.azimuth`: at most `most`, then the number of others."""
    paths = [dotted(steps) for steps in _different(one, other, ())]
    return paths if len(paths) <= most else [*paths[:most], f"{len(paths) - most} more"]


def _different(one: Any, other: Any, steps: Path) -> Iterator[Path]:
    if one == other:
        return
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        for name in dict.fromkeys((*one, *other)):
            yield from _different(one.get(name), other.get(name), (*steps, name))
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other) and isinstance((*one, None)[0], Mapping):
        for i, pair in enumerate(zip(one, other, strict=True)):
            yield from _different(*pair, (*steps, i))
    else:
        yield steps


def shown(value: object) -> str:
    """A value as the user would write it, in at most about 60 characters."""
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    if isinstance(value, Mapping):
        return "a mapping"
    text = ""
    for part in _parts(value):
        text += part
        if len(text) > 60:
            return f"{text[:57]}..."
    return text


def _parts(value: object) -> Iterator[str]:
    """Yield a value's text from its beginning on, so that a reader of the first parts alone never builds the whole: by aliases,
    a few lines of YAML can stand for billions of values.
    """
    if isinstance(value, (str, bytes)):
        yield repr(value[:61])
    elif isinstance(value, int) and value.bit_length() > 1000:  # Python refuses to write out thousands of digits
        yield f"a whole number of {value.bit_length()} bits"
    elif isinstance(value, (list, tuple)):
        yield "["
        for i, item in enumerate(cast("Sequence[object]", value)):
            yield ", " if i else ""
            yield from _parts(item)
        yield "]"
    elif isinstance(value, dict):
        yield "{"
        for i, (key, item) in enumerate(cast("dict[object, object]", value).items()):
            yield ", " if i else ""
            yield from _parts(key)
            yield ": "
            yield from _parts(item)
        yield "}"
    else:
        yield repr(value)


def explained(error: ValidationError, fields: Sequence[str], steps: Path = ()) -> ValidationError:
    """The same errors with their final messages; `fields`: the model's field names; `steps`: the path to the model."""
    errors = error.errors(include_url=False)
    details = [
        InitErrorDetails(
            type=PydanticCustomError(EXPLAINED, "{text}", {"text": _words(e, fields), "below": _below(e)}),
            loc=(*steps, *e["loc"]),
            input=e["input"],
        )
        for e in errors
        if not _follows(e, errors, fields)
    ]
    return ValidationError.from_exception_data(error.title, details)


@contextmanager
def error_at(*steps: str | int) -> Generator[None]:
    """Turn a ValueError about part of a value into a ValidationError with the location of that part."""
    try:
        yield
    except ValidationError as error:
        raise explained(error, (), steps) from None
    except ValueError as error:
        raise mistakes_at({steps: str(error)}) from None


def mistakes_at(told: Mapping[Path, str]) -> ValidationError:
    """These mistakes, in their final words by their places, together."""
    final = {steps: PydanticCustomError(EXPLAINED, "{text}", {"text": text, "below": ()}) for steps, text in told.items()}
    details = [InitErrorDetails(type=error, loc=steps, input=None) for steps, error in final.items()]
    return ValidationError.from_exception_data("", details)


def first_of(error: ValidationError) -> str:
    """The first error, without its location: `expected ...; found ...`."""
    return _words(error.errors(include_url=False)[0], ())


@contextmanager
def told_of(where: str) -> Generator[None]:
    """Turn an error about a value out of bounds into a RecipeError that begins with `where`."""
    try:
        yield
    except ValidationError as error:
        raise RecipeError(f"{where}: {first_of(error)}") from None


def _follows(error: ErrorDetails, errors: Sequence[ErrorDetails], fields: Sequence[str]) -> bool:
    """Return whether an error only follows from others: invalid items of a list are not counted, and a misspelt field is
    missing.
    """
    place, depth = error["loc"], len(error["loc"])
    match error["type"]:
        case "too_short":
            return any(len(e["loc"]) > depth and e["loc"][:depth] == place for e in errors)
        case "missing":
            strange = [e["loc"] for e in errors if e["type"] == "extra_forbidden"]
            return any(loc[:-1] == place[:-1] and suggestion(loc[-1], fields) == place[-1] for loc in strange)
        case _:
            return False


def report(error: ValidationError, data: object, marks: Marks | None = None) -> str:
    """Return the errors in the file's order, a line each: `recipe.yaml:12: models[0].categry: expected ...`."""
    lines: list[tuple[Place, str]] = []
    for e in error.errors(include_url=False):
        path = _path_in(data, e["loc"]) + _below(e)
        place = marks.place(path) if marks else Place("", 0)
        where = f"{place} " if marks else ""
        lines.append((place, f"{where}{dotted(path)}: {_words(e, ())}"))
    return "\n".join(dict.fromkeys(text for _, text in sorted(lines, key=lambda f: f[0])))


def read_options(kind: type[Options], given: Mapping[str, Any], field: str) -> Options:
    """A plug-in's options, read by its class of options; raises RecipeError, whose errors refer to `field`."""
    try:
        return kind.model_validate(given)
    except ValidationError as error:
        lines = report(error, given).splitlines()
        raise RecipeError("\n".join(_under(field, line) for line in lines)) from None


def _under(field: str, line: str) -> str:
    """An error about an option, rewritten as an error about the field; `recipe` means all options."""
    return f"{field}{line.removeprefix('recipe')}" if line.startswith("recipe: ") else f"{field}.{line}"


def dotted(path: Path) -> str:
    """A path as text, `models[0].category`, always in one line; `recipe` for the empty path."""
    text = "".join(f"[{p}]" if isinstance(p, int) else f".{p if p.isprintable() else shown(p)}" for p in path)
    return text.removeprefix(".") or "recipe"


def _below(error: ErrorDetails) -> Path:
    """The end of the path to the wrong field, where pydantic's location stops above it: a missing field, a union's `kind`."""
    match error["type"]:
        case "explained":
            return error.get("ctx", {})["below"]
        case "missing":
            return (error["loc"][-1],)
        case "union_tag_invalid":
            return ("kind",)
        case _:
            return ()


def _path_in(data: Any, location: Path) -> Path:
    """The part of a location that exists in the data: without the names of union members and of absent fields."""
    path: list[str | int] = []
    for part in location:
        if isinstance(part, int):
            inside = isinstance(data, (list, tuple)) and part < len(cast(Sequence[Any], data))
        else:
            inside = isinstance(data, dict) and part in data
        if inside:
            path.append(part)
            data = cast(Any, data)[part]
    return tuple(path)


_ABSENT = ("no", "off", "none", "false")
"""Values that users write to leave out a mapping."""


def _words(error: ErrorDetails, fields: Sequence[str]) -> str:
    kind, found, context = error["type"], error["input"], error.get("ctx", {})
    match kind:
        case "explained":
            return str(context["text"])
        case "value_error":
            return str(context["error"])
        case "extra_forbidden":
            return _no_field(error["loc"][-1], fields)
        case "missing":
            return "expected a value; found nothing"
        case "literal_error":
            return one_of(found, _quoted(context["expected"]))
        case "union_tag_invalid":
            return one_of(context["tag"], _quoted(context["expected_tags"]))
        case "too_short" | "too_long":
            limit = f"at least {context['min_length']}" if kind == "too_short" else f"at most {context['max_length']}"
            return f"expected {limit} of them; found {context['actual_length']}"
        case "model_type" | "dict_type" | "model_attributes_type" | "union_tag_not_found":
            absent = ": leave the field out for none" if found is False or found in _ABSENT else ""
            return f"expected a mapping; found {shown(found)}{absent}"
        case "tuple_type" | "list_type":
            return f"expected a list; found {shown(found)}{_listed(found)}"
        case "int_type" | "int_parsing" | "int_from_float":
            return f"expected a whole number; found {shown(found)}"
        case "greater_than" | "greater_than_equal" | "less_than" | "less_than_equal":
            return f"expected a number {error['msg'].removeprefix('Input should be ')}; found {shown(found)}"
        case _:
            return f"expected {_plain(error['msg'])}; found {shown(found)}"


def _plain(message: str) -> str:
    """Pydantic's message about the expected value, in this project's words."""
    message = message.removeprefix("Input should be ").removeprefix("expected ")
    for theirs, ours in (("a valid ", "a "), ("String should", "text that should"), ("callable", "a function")):
        message = message.replace(theirs, ours)
    return message


def _no_field(name: str | int, fields: Sequence[str]) -> str:
    if len(fields) != 1:
        return one_of(name, fields)
    return f"expected no field but {fields[0]}; found {shown(name)}{nearest(name, fields)}"


def _listed(found: Any) -> str:
    """Return the hint to write a mapping as a list with one entry, an empty string for other values.

    Long and nested values of the mapping are left out of the hint.
    """
    if not isinstance(found, Mapping):
        return ""
    value = cast(Mapping[str, Any], found)
    fields = ((name, inner if isinstance(inner, str) else shown(inner)) for name, inner in value.items())
    told = (f"{name}: {'...' if isinstance(value[name], (Mapping, list)) or len(text) > 30 else text}" for name, text in fields)
    return f": for a list of this alone write [{{{', '.join(told)}}}]"


def _quoted(text: str) -> list[str]:
    return re.findall(r"'([^']*)'", text)
