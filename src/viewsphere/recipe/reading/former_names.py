"""Former names of recipe fields: recipes may still use them, with a warning."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import reduce
from operator import getitem
from typing import Any, cast

from viewsphere.validation.errors import Path, dotted, mistakes_at

_PRESENT = {"azimuth_deg": "azimuth", "elevation_deg": "elevation", "tilt_deg": "tilt"}
"""Former names, with their replacements."""

_ENTRIES = frozenset({"sun", "night", "at", "jitter"})
"""Entries of a scene that had fields with these names. Options of third-party plug-ins may still have them."""

_SCENES = frozenset({"scene", "variations"})


def is_former(path: Path) -> bool:
    """Return whether a path ends with the former name of a field."""
    names = [step for step in path if isinstance(step, str) and step != "choice"]
    return len(names) > 2 and names[0] in _SCENES and names[-2] in _ENTRIES and names[-1] in _PRESENT and path[-1] == names[-1]


def present(path: Path) -> Path:
    """The path with the present name of its field."""
    return (*path[:-1], _PRESENT[cast(str, path[-1])]) if is_former(path) else path


def with_present_names(data: Any, path: Path = ()) -> Any:
    """The data of a recipe with present names for former ones. A former name next to its present one remains, and causes an
    error.
    """
    if isinstance(data, Mapping) and (len(path) != 1 or path[0] in _SCENES):
        fields = cast(Mapping[Any, Any], data)
        return {
            name if (new := present((*path, name))[-1]) in fields else new: with_present_names(value, (*path, name))
            for name, value in fields.items()
        }
    if isinstance(data, (list, tuple)) and path[:1] and path[0] in _SCENES:
        return [with_present_names(value, (*path, i)) for i, value in enumerate(cast(list[Any], data))]
    return data


def former_paths(data: Any, path: Path = ()) -> Iterator[Path]:
    """Yield the paths of the fields that have a former name."""
    if is_former(path):
        yield path
    if isinstance(data, Mapping):
        for name, value in cast(Mapping[Any, Any], data).items():
            yield from former_paths(value, (*path, name))
    elif isinstance(data, (list, tuple)):
        for i, value in enumerate(cast(list[Any], data)):
            yield from former_paths(value, (*path, i))


def refuse_both_names(data: Any) -> None:
    """Raise ValidationError for the fields that have a former name beside the present one."""
    both = [path for path in former_paths(data) if present(path)[-1] in reduce(getitem, path[:-1], data)]
    if both:
        raise mistakes_at({path: f"{_is_now(path)}, which is set as well: remove one of the two" for path in both})


def renamed(paths: Iterable[Path]) -> tuple[str, ...]:
    """The warnings about former names at these paths, one line each."""
    return tuple(f"{dotted(path)}: {_is_now(path)}: rename it" for path in paths)


def _is_now(path: Path) -> str:
    return f"this field is now called {_PRESENT[cast(str, path[-1])]!r}"
