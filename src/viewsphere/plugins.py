"""How a name finds its module; what a plug-in must offer stands in its package (`Engine` in `viewsphere.engines`, ...).

A plug-in is one module; its name is its file's name, listed without importing it. Third parties use the entry-point
groups `viewsphere.engines`, `viewsphere.formats`, `viewsphere.labels`, `viewsphere.materials`, `viewsphere.motions`,
`viewsphere.placers` and `viewsphere.samplers`. What is found by name is imported here and nowhere else.
"""

from __future__ import annotations

import importlib
import os
import pkgutil
import sys
from collections.abc import Iterable
from functools import lru_cache
from importlib import metadata
from typing import Any, Literal

from viewsphere.errors import UserError

Kind = Literal["engines", "formats", "labels", "materials", "motions", "placers", "samplers"]

PACKAGES: dict[Kind, str] = {
    "engines": "viewsphere.engines",
    "formats": "viewsphere.formats",
    "labels": "viewsphere.labels",
    "materials": "viewsphere.materials",
    "motions": "viewsphere.sampling.motion",
    "placers": "viewsphere.sampling.placing",
    "samplers": "viewsphere.sampling.samplers",
}
"""Where the plug-ins of a kind are that ship with the tool."""


def names(kind: Kind) -> tuple[str, ...]:
    """Names of all plug-ins of this kind, sorted; none is imported."""
    own = {name for name, _ in _listed(PACKAGES[kind]) if not name.startswith("_")}
    return tuple(sorted(own | {e.name for e in entry_points(group=f"viewsphere.{kind}")}))


def load(kind: Kind, name: str) -> Any:
    """The plug-in's module (or the object its entry point names).

    Raises UserError for an unknown name, with the nearest known one.
    """
    for entry in entry_points(group=f"viewsphere.{kind}"):
        if entry.name == name:
            return entry.load()
    if name.startswith("_") or name not in (own for own, _ in _listed(PACKAGES[kind])):
        raise _unknown(kind[:-1], name, names(kind))
    return importlib.import_module(f"{PACKAGES[kind]}.{name}")


def entry_points(group: str) -> metadata.EntryPoints:
    """The installed entry points of this group.

    Those of all packages are read once, and again after one was installed or removed: reading them takes 10 ms.
    """
    return _of_group(_changes(sys.path), group)


Changes = tuple[tuple[str, int], ...]
"""Folders, and when each was last changed."""


@lru_cache(maxsize=2 * len(PACKAGES))
def _of_group(paths: Changes, group: str) -> metadata.EntryPoints:
    return _installed(paths).select(group=group)


@lru_cache(maxsize=1)
def _installed(_paths: Changes) -> Any:
    """Entry points of the packages in these folders, as they were last changed at these times."""
    return metadata.entry_points()


def _changes(paths: Iterable[str]) -> Changes:
    return tuple((path, _changed(path)) for path in paths)


def _changed(path: str) -> int:
    """When a folder was last changed, ns; 0 where there is none."""
    try:
        # Asked a thousand times a run: making a Path takes longer than the system's answer.
        return os.stat(path or ".").st_mtime_ns  # noqa: PTH116
    except OSError:
        return 0


def attribute(path: str) -> Any:
    """A public object by its dotted path inside viewsphere: `model.recipe.Recipe`."""
    module, _, name = path.rpartition(".")
    return getattr(importlib.import_module(f"viewsphere.{module}"), name)


def families() -> tuple[str, ...]:
    """Names of the zoo's families (its modules, not its packages), sorted; none is imported."""
    return _modules("viewsphere.zoo")


def family(name: str) -> Any:
    """The module of a zoo family; raises UserError for an unknown name, with the nearest known one."""
    return _module("viewsphere.zoo", "zoo family", name)


def places() -> tuple[str, ...]:
    """Names of the zoo's places, sorted; none is imported."""
    return _modules("viewsphere.zoo.places")


def place(name: str) -> Any:
    """The module of a place; raises UserError for an unknown name, with the nearest known one."""
    return _module("viewsphere.zoo.places", "zoo place", name)


def _modules(package: str) -> tuple[str, ...]:
    return tuple(sorted(name for name, is_package in _listed(package) if not is_package))


def _listed(package: str) -> tuple[tuple[str, bool], ...]:
    """Names of a package's modules, and whether each is a package itself; listed again after its folder was changed."""
    return _modules_in(_changes(importlib.import_module(package).__path__))


@lru_cache(maxsize=2 * len(PACKAGES))
def _modules_in(paths: Changes) -> tuple[tuple[str, bool], ...]:
    return tuple((m.name, m.ispkg) for m in pkgutil.iter_modules([path for path, _ in paths]))


def _module(package: str, what: str, name: str) -> Any:
    known = _modules(package)
    if name not in known:
        raise _unknown(what, name, known)
    return importlib.import_module(f"{package}.{name}")


def _unknown(what: str, name: str, known: tuple[str, ...]) -> UserError:
    from viewsphere.model.mistakes import one_of

    return UserError(f"{what}: {one_of(name, known)}")
