"""Finds plug-ins by name, and loads them.

A plug-in is one module that holds a spec, such as `FORMAT = FormatSpec(...)`. A module's name is the plug-in's name, so
listing names imports no plug-in. Other packages name their modules in entry points of the groups `viewsphere.formats` and so
on, or a package with a module a plug-in in the group `viewsphere.packages`: `families = "my_package.families"`. A plug-in of
theirs that cannot be loaded is an error only if a recipe names it.

A module of labels or effects may hold several, as `LABELS = (ChannelLabel(name="flow", ...), ...)`. Listing reads their names
in the text of that statement, without importing the module. Loading compares them with the specs. Third parties write one
entry point for each; several may name the same module.
"""

from __future__ import annotations

import importlib
import importlib.util
import pkgutil
import re
import sys
from collections.abc import Mapping
from functools import lru_cache
from importlib import metadata
from operator import attrgetter
from pathlib import Path
from typing import Any, ClassVar, Literal, NamedTuple, Protocol, TypeVar

from viewsphere.errors import PluginError, UserError
from viewsphere.plugin_modules import PACKAGES, Changes, changes, entry_points, of_group

Kind = Literal[
    "effects",
    "engines",
    "families",
    "formats",
    "labels",
    "lenses",
    "lights",
    "materials",
    "motions",
    "placers",
    "places",
    "readers",
    "samplers",
    "sources",
    "trajectories",
]


class _Specified(Protocol):
    """A class of specs: the plug-ins of a kind. The classes need pydantic, which listing names does without."""

    KIND: ClassVar[Kind]


S = TypeVar("S", bound=_Specified)
V = TypeVar("V")


class Seam(NamedTuple):
    """The package of a kind's built-in plug-ins (empty: there are none), the constant of a module that holds its spec, and the
    constant that holds several specs; empty: a module holds one.
    """

    package: str
    constant: str
    several: str = ""


SEAMS: dict[Kind, Seam] = {
    "effects": Seam("viewsphere.rendering.effects", "EFFECT", "EFFECTS"),
    "engines": Seam("viewsphere.engines", "ENGINE"),
    "families": Seam("", "FAMILY"),
    "formats": Seam("viewsphere.formats", "FORMAT"),
    "labels": Seam("viewsphere.labels", "LABEL", "LABELS"),
    "lenses": Seam("viewsphere.geometry.lenses", "LENS"),
    "lights": Seam("viewsphere.recipe.lights", "LIGHT"),
    "materials": Seam("viewsphere.materials", "MATERIAL"),
    "motions": Seam("viewsphere.composing.motion", "MOTION"),
    "placers": Seam("viewsphere.composing.placing", "PLACER"),
    "readers": Seam("viewsphere.assets.readers", "READER"),
    "places": Seam("", "PLACE"),
    "samplers": Seam("viewsphere.planning.samplers", "SAMPLER"),
    "sources": Seam("viewsphere.assets.sources", "SOURCE"),
    "trajectories": Seam("viewsphere.composing.trajectories", "TRAJECTORY"),
}


OWN = "viewsphere"
"""The distribution of the built-in plug-ins."""


def names(kind: Kind) -> tuple[str, ...]:
    """Names of all plug-ins of this kind, sorted; no plug-in is imported."""
    return tuple(sorted(_found(kind)))


def prefix_of(source: str) -> str:
    """The prefix of a model's or place's source that a plug-in provides, such as `zoo` of `zoo:car`; empty for a file."""
    prefix, colon, _ = source.partition(":")
    return prefix if colon and prefix in _found("sources") else ""


def load(spec: type[S], name: str) -> S:
    """The spec of a plug-in.

    Raises UserError for an unknown name, with the nearest known one. Raises PluginError for a plug-in that cannot be loaded, or
    whose spec is not valid.
    """
    return _spec(spec, _module_of(spec.KIND, name), name)


def loadable(spec: type[S]) -> dict[str, S]:
    """The specs of all plug-ins of a kind, by name, without the third-party ones that cannot be loaded."""
    found: dict[str, S] = {}
    for name in names(spec.KIND):
        try:
            found[name] = load(spec, name)
        except PluginError:
            if not is_third_party(spec.KIND, name):
                raise
    return found


def checked(spec: type[_Specified], name: str, field: str, value: Any, *types: type[V]) -> V:
    """The value that a function of a plug-in returned; raises PluginError for one of other types than these."""
    if isinstance(value, types):
        return value
    expected = " or ".join("None" if type_ is type(None) else f"a {type_.__name__}" for type_ in types)
    where = f"{module_file(spec.KIND, name) or name}: {spec.__name__}.{field}"
    raise PluginError(f"{where}: expected a function that returns {expected}; found {type(value).__name__}, for {name}")


def is_third_party(kind: Kind, name: str) -> bool:
    """Return whether another distribution than viewsphere's brings the plug-in."""
    found = _found(kind).get(name)
    return found is not None and found.is_third_party


def origin(kind: Kind, name: str) -> str:
    """The distribution that a plug-in comes from, with its version."""
    found = _found(kind)[name].distribution or metadata.distribution(OWN)
    return f"{found.name} {found.version}"


def module_file(kind: Kind, name: str) -> Path | None:
    """The file of a plug-in's module; None if it has none."""
    found = importlib.util.find_spec(_found(kind)[name].module)
    return None if found is None or found.origin is None else Path(found.origin)


class _Found(NamedTuple):
    """A plug-in's module, the object in it that an entry point names (empty: the module), the distribution of the entry point
    (None: the plug-in is built in), and why its names cannot be read in its text (empty: they can).
    """

    module: str
    attribute: str = ""
    distribution: metadata.Distribution | None = None
    is_third_party: bool = False
    fault: str = ""


def shipped(kind: Kind) -> Mapping[str, str]:
    """The modules of the plug-ins of a kind that come with viewsphere, by the plug-ins' names; none is imported."""
    return {name: found.module for name, found in _found(kind).items() if not found.is_third_party}


def gap() -> str:
    """The missing part of the installation and the remedy, in words for messages; empty if nothing is missing.

    Plug-ins of some kinds are found by entry points, which are written when viewsphere is installed. A clone that was updated
    since may lack them.
    """
    lacking = ", ".join(kind for kind, seam in SEAMS.items() if not seam.package and not shipped(kind))
    return lacking and f"found no {lacking} of viewsphere's own: install viewsphere again (scripts/setup in a clone)"


def _found(kind: Kind) -> Mapping[str, _Found]:
    """The plug-ins of a kind by name; listed again after a package was installed or a folder of plug-ins was changed."""
    installed = changes(sys.path)
    packages = _packages(installed, kind)
    return _table(installed, kind, tuple((package, _folders(package.module)) for package in packages))


@lru_cache(maxsize=2 * len(SEAMS))
def _packages(installed: Changes, kind: Kind) -> tuple[_Found, ...]:
    """The packages with a plug-in of the kind in each module: our own, and those that entry points name."""
    own = (_Found(SEAMS[kind].package),) if SEAMS[kind].package else ()
    return *own, *(_entered(entry) for entry in of_group(installed, PACKAGES) if entry.name == kind)


def _folders(package: str) -> Changes:
    """The folders of a package; none for one that cannot be imported."""
    try:
        return changes(importlib.import_module(package).__path__)
    except Exception:
        return ()


@lru_cache(maxsize=4 * len(SEAMS))
def _table(installed: Changes, kind: Kind, packages: tuple[tuple[_Found, Changes], ...]) -> Mapping[str, _Found]:
    """The plug-ins by name. One that an entry point names comes before one of its name in a package. A package that cannot be
    imported is listed itself; loading it raises the reason.
    """
    found: dict[str, _Found] = {}
    for package, folders in packages:
        found |= _plugins_in(folders, package, SEAMS[kind]) if folders else {package.module: package}
    return found | {entry.name: _entered(entry) for entry in of_group(installed, f"viewsphere.{kind}")}


def _entered(entry: metadata.EntryPoint) -> _Found:
    is_third_party = entry.dist is None or entry.dist.name != OWN  # reading a distribution's name takes 1 ms
    return _Found(entry.module, entry.attr, entry.dist, is_third_party)


def _module_of(kind: Kind, name: str) -> Any:
    """The module of a plug-in, or the object that its entry point names."""
    found = _found(kind).get(name)
    if found is None:
        raise _unknown(SEAMS[kind].constant.lower(), name, names(kind))
    module = _imported(found, name)
    if found.fault:  # after the import, whose own error says more
        raise PluginError(found.fault)
    return module


def _imported(found: _Found, name: str) -> Any:
    """Return a plug-in's module, or the object that its entry point names. A spec that is not valid is an error of the plug-in;
    so is any failure of a third party's.
    """
    try:
        module = importlib.import_module(found.module)
        return attrgetter(found.attribute)(module) if found.attribute else module
    except PluginError as error:
        raise PluginError("\n".join(f"{_file(found.module)}: {line}" for line in str(error).splitlines())) from error
    except Exception as error:
        if not found.is_third_party:
            raise
        said = f"{type(error).__name__}: {error}".strip().replace("\n", " ")
        raise PluginError(f"{_file(found.module)}: plug-in {name} cannot be imported: {said}") from error


def _spec(spec: type[S], found: Any, name: str) -> S:
    """The spec in a plug-in's module; raises PluginError if there is none."""
    from viewsphere.validation.errors import nearest, shown

    if isinstance(found, spec):
        return found
    _, constant, several = SEAMS[spec.KIND]
    where, others = getattr(found, "__file__", None) or name, vars(found) if hasattr(found, "__dict__") else {}
    if several in others:
        return _one_of_several(spec, f"{where}: {several}", others[several], found.__name__, name)
    if constant not in others:
        meant = nearest(constant, [other for other in others if other.isupper()])
        raise PluginError(f"{where}: expected {constant} = {spec.__name__}(...); found no {constant}{meant}")
    held = others[constant]
    if not isinstance(held, spec):
        raise PluginError(f"{where}: {constant}: expected a {spec.__name__}; found {shown(held)}")
    if getattr(held, "name", name) != name:  # of kinds whose specs are found without their modules
        other = shown(vars(held)["name"])
        raise PluginError(f"{where}: {constant}.name: expected {name!r}, the name of its file; found {other}")
    return held


def _one_of_several(spec: type[S], where: str, held: Any, module: str, name: str) -> S:
    """The spec of this name among those of a module; raises PluginError if listing does not name all of them."""
    from viewsphere.validation.errors import shown

    for i, each in enumerate(held if isinstance(held, tuple) else (held,)):
        if not isinstance(held, tuple) or not isinstance(each, spec):
            raise PluginError(f"{where}[{i}]: expected a {spec.__name__} in a tuple; found {shown(each)}")
    specs = {vars(each)["name"]: each for each in held}
    entries = entry_points(group=f"viewsphere.{spec.KIND}")
    named = {entry.name for entry in entries if entry.module == module} or {
        each for each, home in _found(spec.KIND).items() if home.module == module
    }
    if len(specs) < len(held) or specs.keys() != named:
        raise PluginError(
            f"{where}: expected the names {', '.join(sorted(named))}, each once, as entry points or the text of the statement "
            f"list them; found {', '.join(vars(each)['name'] for each in held)}"
        )
    return specs[name]


def _file(module: str) -> str:
    """The file of a module that could not be imported, else its name."""
    try:
        found = importlib.util.find_spec(module)
    except Exception:  # its package may be what cannot be imported
        return module
    return module if found is None or found.origin is None else found.origin


def attribute(path: str) -> Any:
    """A public object by its dotted path inside viewsphere: `recipe.recipe.Recipe`."""
    module, _, name = path.rpartition(".")
    return getattr(importlib.import_module(f"viewsphere.{module}"), name)


def _plugins_in(paths: Changes, package: _Found, seam: Seam) -> dict[str, _Found]:
    """The modules in a package's folders by the names of the plug-ins that they hold. A third party's module with unreadable
    names is listed itself; loading it raises the reason.
    """
    homes: dict[str, _Found] = {}
    for module in pkgutil.iter_modules([path for path, _ in paths]):
        if module.name.startswith("_") or module.name == "shared":
            continue
        held, fault = None, ""
        try:
            held = _names_in_text(module, seam.several) if seam.several else None
        except PluginError as error:
            if not package.is_third_party:
                raise
            fault = str(error)
        home = package._replace(module=f"{package.module}.{module.name}", fault=fault)
        homes |= dict.fromkeys(held or (module.name,), home)
    return homes


def _names_in_text(module: pkgutil.ModuleInfo, constant: str) -> tuple[str, ...] | None:
    """The names of the plug-ins that a module's text lists in a statement; None without that statement.

    Only the text from the statement on is parsed, so that listing 50 files takes 3 ms.
    """
    found = module.module_finder.find_spec(module.name, None)
    loader: Any = found and found.loader
    if found is None or found.origin is None:
        return None
    text = loader.get_data(found.origin)
    start = re.search(rb"^%s\b[^=\n]*=" % constant.encode(), text, re.MULTILINE)
    if start is None:
        return None
    import ast

    try:
        statement: Any = ast.parse(text[start.start() :]).body[0]
    except (SyntaxError, ValueError) as error:
        raise PluginError(f"{found.origin}: {constant}: cannot be read: {error}") from error
    elements = getattr(statement.value, "elts", ())
    names = [name for each in elements if (name := _literal_name(each)) is not None]
    if not names or len(names) < len(elements):
        raise PluginError(
            f"{found.origin}: {constant}: expected a tuple of calls, each with its name as text, first or as `name`"
        )
    return tuple(names)


def _literal_name(call: object) -> str | None:
    """The text that a call has as its `name`, or else as its first value."""
    import ast  # which takes 4 ms, and few modules hold several plug-ins

    if not isinstance(call, ast.Call):
        return None
    given = [word.value for word in call.keywords if word.arg == "name"] or call.args[:1]
    return next((each.value for each in given if isinstance(each, ast.Constant) and isinstance(each.value, str)), None)


def _unknown(what: str, name: str, known: tuple[str, ...]) -> UserError:
    from viewsphere.validation.errors import one_of

    return UserError(f"{what}: {one_of(name, known)}")
