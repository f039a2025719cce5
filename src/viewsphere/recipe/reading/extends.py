"""Recipes built on other recipes by `extends: base.yaml`, and fields set from outside (`--set`)."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import reduce
from pathlib import Path
from typing import Any, cast

from viewsphere.errors import RecipeError
from viewsphere.files import written_path
from viewsphere.model.scene import Background, Ground
from viewsphere.plugins import prefix_of
from viewsphere.plugins.source import from_folder
from viewsphere.recipe.draws import KINDS
from viewsphere.recipe.entries import pictures_of
from viewsphere.recipe.reading.file import parse, read
from viewsphere.recipe.reading.former_names import present, with_present_names
from viewsphere.validation.errors import Marks, Place, dotted, shown
from viewsphere.validation.errors import Path as Steps

PATHS: tuple[tuple[str, ...], ...] = (
    ("models", "*", "source"),
    ("models", "*", "source", "*"),
    ("models", "*", "real_size"),
    ("models", "*", "sidecar"),
    ("models", "*", "real_size", "csv"),
    ("viewpoints", "path"),
    *(("scene", "background", name) for name in pictures_of(Background)),
    ("scene", "background", "images"),
    ("scene", "sky"),
    ("scene", "sky", "hdri"),
    *(("scene", "ground", name) for name in pictures_of(Ground)),
    ("scene", "place"),
    ("scene", "place", "source"),
    ("scene", "planes", "*", "image"),
    ("scene", "planes", "*", "images"),
)
"""Fields that hold a path; a path is relative to the file in which it is written."""

WORDS = {"file", "daylight"}
"""Values of these fields that are neither paths nor source names."""

UNIONS: dict[str, tuple[frozenset[str], ...]] = {
    "sky": tuple(map(frozenset, (["hdri"], ["daylight"], ["night"], ["zenith", "horizon"]))),
    "background": tuple(map(frozenset, (["image"], ["images"], ["color"], ["environment"], ["transparent"]))),
    "ground": (frozenset({"material"}), frozenset(pictures_of(Ground))),
    "rig": tuple(map(frozenset, (["sensors"], ["file", "path"], ["baseline"], ["count", "radius"]))),
}
"""Fields with several kinds, and the fields that only one kind has."""

_STEP = re.compile(r"(?:^|\.)([A-Za-z_][\w-]*)|\[(\d+)\]")


@dataclass(frozen=True)
class _Layer:
    """Plain data, and the place of every value in it."""

    data: dict[str, Any]
    places: dict[Steps, Place]


def assemble(path: Path, changes: Mapping[str, Any] | None = None) -> tuple[dict[str, Any], Marks]:
    """The data of a recipe file, merged over the files that it extends, with `changes` (`viewpoints.elevation` -> value), and
    the places of all values.

    A mapping is merged field by field into the one that it extends, unless it is of another kind, by its `kind` or by fields
    that only one kind has; it then replaces the other mapping, as all other values do. null removes a field. Raises
    RecipeError as `read` does, and for files that extend one another in a circle.
    """
    layer = _extended(path, (), {})
    for name, value in (changes or {}).items():
        layer = _set(layer, name, value)
    return layer.data, Marks(str(path), layer.places)


def parse_change(text: str, option: str = "--set", example: str = "viewpoints.elevation=[10,20]") -> tuple[str, Any]:
    """The field and the value in a text such as `viewpoints.elevation=[10, 20]`; the value is YAML. Raises RecipeError for
    anything else.
    """
    name, equals, value = text.partition("=")
    if not equals:
        raise RecipeError(f"{option} {text}: expected field=value, such as {example}; found no '='")
    return name.strip(), parse(value, f"{option} {name.strip()}")[0]


def _extended(path: Path, above: tuple[Path, ...], known: dict[str, _Layer]) -> _Layer:
    """A file merged over those that it extends; each is read once, even if several others extend it."""
    place = os.path.abspath(path)  # noqa: PTH100, links are kept: paths in a file are relative to where it was found
    if place not in known:
        known[place] = _joined(path, above, known)
    return known[place]


def _joined(path: Path, above: tuple[Path, ...], known: dict[str, _Layer]) -> _Layer:
    data, marks = read(path)
    places = {new: place for steps, place in marks.places.items() for new in {steps, present(steps)}}
    layer = _Layer(with_present_names(data), places)
    names = layer.data.pop("extends", ())
    where = marks.place(("extends",))
    chain = (*above, path.resolve())
    whole = _Layer({}, {})
    for name in cast(list[Any], names) if isinstance(names, list) else (names,) if names else ():
        if not isinstance(name, str):
            raise RecipeError(f"{where} extends: expected the path of a recipe, or a list of them; found {shown(name)}")
        base = path.parent / written_path(name)
        if base.resolve() in chain:
            raise RecipeError(
                f"{where} extends: {name} extends itself, directly or through others: remove one of these extends"
            )
        if not base.is_file():
            raise RecipeError(f"{where} extends: expected a recipe file; found none at {base}")
        base_layer = _extended(base, chain, known)
        folder = _from(path.parent, base.parent)
        data = base_layer.data if folder == "." else reduce(lambda data, to: _rebased(data, to, folder), PATHS, base_layer.data)
        whole = _merged(whole, _Layer(data, base_layer.places))
    return _merged(whole, layer)


def _from(folder: Path, other: Path) -> str:
    """The relative path from a folder to another one; an absolute path if there is none, as between two drives of Windows."""
    try:
        return os.path.relpath(other, folder)
    except ValueError:
        return str(other.resolve())


def _merged(under: _Layer, over: _Layer) -> _Layer:
    places = dict(under.places)
    data = _merge(under.data, over.data, (), lambda steps: _forget(places, steps))
    return _Layer(data, places | over.places)


def _merge(under: dict[str, Any], over: dict[str, Any], steps: Steps, forget: Callable[[Steps], None]) -> dict[str, Any]:
    result = dict(under)
    for name, value in over.items():
        inside = (*steps, name)
        old = result.get(name)
        if isinstance(old, dict) and isinstance(value, dict) and not _of_other_kind(name, old, value):
            result[name] = _merge(cast(dict[str, Any], old), cast(dict[str, Any], value), inside, forget)
            continue
        forget(inside)
        result.pop(name, None)
        if value is not None:
            result[name] = value
    return result


def _of_other_kind(field: str, old: Any, new: Any) -> bool:
    """Return whether a field's new mapping is of another kind than the old one, and so replaces all of it."""
    if not {*KINDS}.isdisjoint({*old, *new}):
        return True  # distributions are replaced whole, not merged
    if "kind" in new:
        return new["kind"] != old.get("kind", _kind_of(field, old) or "grid")
    kinds = UNIONS.get(field, ())
    own, other = ([i for i, names in enumerate(kinds) if not names.isdisjoint(entry)] for entry in (new, old))
    return bool(own and other) and own != other


def _kind_of(field: str, entry: Any) -> str | None:
    """The kind of a rig, judging by its fields."""
    if field != "rig":
        return None
    kinds = {"sensors": "sensors", "file": "file", "path": "file"}
    return next((kind for name, kind in kinds.items() if name in entry), None)


def _forget(places: dict[Steps, Place], steps: Steps) -> None:
    for known in [p for p in places if p[: len(steps)] == steps]:
        del places[known]


def _set(layer: _Layer, name: str, value: Any) -> _Layer:
    """The layer with one field set to another value."""
    where = f"--set {name}"
    written = _steps(name, where)
    steps = present(written)
    places = dict(layer.places)
    _forget(places, steps)
    places |= {written: Place("--set", 0), steps: Place("--set", 0)}
    return _Layer(cast(dict[str, Any], _replaced(layer.data, steps, value, where)), places)


def _steps(name: str, where: str) -> Steps:
    steps: list[str | int] = []
    end = 0
    while end < len(name):
        step = _STEP.match(name, end)
        if step is None or (not steps and step[1] is None):
            break
        steps.append(step[1] or int(step[2]))
        end = step.end()
    if not steps or end < len(name):
        raise RecipeError(f"{where}: expected a field, such as viewpoints.elevation or models[0].count; found {name!r}")
    return tuple(steps)


def _replaced(data: Any, steps: Steps, value: Any, where: str) -> Any:
    if not steps:
        return value
    step, rest = steps[0], steps[1:]
    if isinstance(step, int):
        items = list(cast(list[Any], data)) if isinstance(data, list) else []
        if step >= len(items):
            raise RecipeError(f"{where}: expected an index below {len(items)}; found {step}")
        items[step] = _replaced(items[step], rest, value, where)
        return items
    if data is not None and not isinstance(data, dict):
        raise RecipeError(f"{where}: expected a mapping to set {dotted(steps)} in; found {shown(data)}")
    fields = dict(cast(dict[str, Any], data or {}))
    if not rest and value is None:
        fields.pop(step, None)
    else:
        fields[step] = _replaced(fields.get(step), rest, value, where)
    return fields


def _rebased(data: Any, pattern: tuple[str, ...], folder: str) -> Any:
    """The data in which relative paths, in fields that match the pattern, are prefixed by a folder."""
    if isinstance(data, dict) and isinstance(data.get("choice"), list):
        return {**data, "choice": [_rebased(option, pattern, folder) for option in data["choice"]]}
    if not pattern:
        if not isinstance(data, str) or data in WORDS or data.startswith("~"):
            return data
        return from_folder(data, Path(folder)) if prefix_of(data) else Path(folder, data).as_posix()
    step, rest = pattern[0], pattern[1:]
    if step == "*" and isinstance(data, list):
        return [_rebased(item, rest, folder) for item in cast(list[Any], data)]
    if isinstance(data, dict) and step in data:
        return {**data, step: _rebased(data[step], rest, folder)}
    return data
