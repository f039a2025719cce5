"""The spec of a source of models and places: the names after its prefix in a recipe, as in `zoo:car`."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, ClassVar, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, InstanceOf

from viewsphere.errors import PluginError, UserError
from viewsphere.model.credit import Credit
from viewsphere.model.model_spec import Axis, ModelSpec
from viewsphere.plugins.family import ZooFamily
from viewsphere.plugins.place import PlaceSpec
from viewsphere.plugins.registry import Kind, checked, gap, is_third_party, load, loadable, names, prefix_of
from viewsphere.plugins.spec import Spec
from viewsphere.validation.errors import nearest

Role = Literal["example", "table", "box"]
"""Uses of a model by viewsphere itself: to show and measure something, as a table's top, as an open box."""


class Download(NamedTuple):
    """Data on the network: what `without` them models are, a function that fetches them and reports its steps, and one that
    returns the file that holds them, if there is one.
    """

    without: str
    fetch: Callable[[Callable[[str], None]], Any]
    file: Callable[[], str | None]


class SourceModel(NamedTuple):
    """A single model of a source, as known before it is read.

    Attributes:
        name: The name after the source's prefix; for a source of folders, the absolute path of the model.
        key: The preferred key of the model in a data set; empty: the name.
        category: The category; empty: the name.
        split: The split in which the set lists the model; empty if it lists none.
        up: The file's axis that points up; None: the format's.
        forward: The file's axis that the front faces; None: the format's.
        unit: Metres in one unit of the file; None: the file's.
        is_metric: Whether the file has the true size of the object.
        fault: The reason why the model cannot be used; empty if none is known. Recipes leave such models out.
    """

    name: str
    key: str = ""
    category: str = ""
    split: str = ""
    up: Axis | None = None
    forward: Axis | None = None
    unit: float | None = None
    is_metric: bool = True
    fault: str = ""


class AssetSet(NamedTuple):
    """A public set of models in a folder of the user's, for messages and documentation.

    Attributes:
        title: The name of the set.
        layout: The paths that are read, below the folder.
        category: The origin of the categories.
        axes: The axes of its files that are up and front, and their unit.
        licence: The licence or the terms of the set.
        tried: The files of the set on which the source was tried, besides trees that tests make.
    """

    title: str
    layout: str
    category: str
    axes: str
    licence: str
    tried: str = "none"


def _no_names() -> tuple[str, ...]:
    return ()


class SourceSpec(Spec):
    """Functions that find and load models by name. The plug-in's name is the prefix, and `name` is the text after the colon."""

    KIND: ClassVar[Kind] = "sources"

    names: Callable[[], tuple[str, ...]] = Field(
        default=_no_names, description="names to list and complete, sorted; a long list may leave names out"
    )
    expand: Callable[[str], tuple[SourceModel, ...]] = Field(
        description="`expand(name)`: the single models that a name stands for, without reading them. Raises UserError for an "
        "unknown name"
    )
    folder: InstanceOf[AssetSet] | None = Field(
        default=None,
        description="the set of models that the source reads from a folder; names are then paths, relative to the recipe",
    )
    load: Callable[[ModelSpec], Any] = Field(
        description="`load(model)`: the `viewsphere.assets.mesh.Mesh` in object axes, metres; or the path of a file to read"
    )
    credit: Callable[[ModelSpec], Credit | None] = Field(description="`credit(model)`: the licence and attribution, if known")
    drawn: bool = Field(
        default=False,
        description="whether a name stands for any number of models, each drawn from `model.seed`; else each name is one model",
    )
    versioned: Callable[[str], bool] = Field(
        default=lambda name: False,
        description="`versioned(name)`: whether the models of a name change only with the version of viewsphere, so that a run "
        "that goes on need not compare them",
    )
    family: Callable[[str], ZooFamily | None] = Field(
        default=lambda name: None, description="`family(name)`: facts about the models of a name, if there are any"
    )
    places: Callable[[], tuple[str, ...]] = Field(default=_no_names, description="names of places for `scene.place`, sorted")
    place: Callable[[str], PlaceSpec] | None = Field(
        default=None, description="`place(name)`: a place. Raises UserError for an unknown name"
    )
    roles: Mapping[Role, str] = Field(
        default={}, description="names of models that viewsphere itself uses: `example`, `table`, `box`"
    )
    downloads: Mapping[str, InstanceOf[Download]] = Field(
        default={}, description="data that better models need, by name; `viewsphere doctor --setup` fetches them"
    )


class Named(NamedTuple):
    """A source, its prefix, and the name after the colon."""

    spec: SourceSpec
    prefix: str
    name: str


def source_of(text: str) -> Named | None:
    """The source that a model's or place's text names, such as `zoo:car`; None for a file."""
    prefix = prefix_of(text)
    return Named(load(SourceSpec, prefix), prefix, text[len(prefix) + 1 :]) if prefix else None


def from_folder(text: str, folder: Path) -> str:
    """The text, in which the relative path of a source of folders, such as `gso:../scans`, starts from `folder`."""
    named = source_of(text)
    if named is None or named.spec.folder is None or named.name.startswith("~"):
        return text
    return f"{named.prefix}:{Path(folder, named.name).as_posix()}"


def from_set(text: str) -> AssetSet | None:
    """The set that a model's text names, such as `gso:scans/Mug`; None for files and for models of other sources."""
    named = source_of(text)
    return None if named is None else named.spec.folder


def is_there(text: str) -> bool:
    """Return whether a model of a source exists; False for files and for a missing path of a source of folders."""
    named = source_of(text)
    return named is not None and (named.spec.folder is None or Path(named.name).exists())


def is_versioned(text: str) -> bool:
    """Return whether the version of viewsphere decides what a model is."""
    named = source_of(text)
    return named is not None and named.spec.versioned(named.name)


def place_of(text: str) -> PlaceSpec | None:
    """The place that a text names, such as `zoo:town`; None for a file and for an unknown place."""
    named = source_of(text)
    if named is None or named.spec.place is None or named.name not in named.spec.places():
        return None
    return checked(SourceSpec, named.prefix, "place", named.spec.place(named.name), PlaceSpec)


def place_names() -> tuple[str, ...]:
    """All places of all sources, such as `zoo:town`: shipped sources first."""
    return tuple(f"{prefix}:{name}" for prefix, spec in sources().items() for name in _asked(prefix, (), spec.places))


def with_roads() -> str:
    """The places of all sources that have roads, in words, for messages; `a file` if there are none. A place that cannot be
    loaded is left out: the message is about another mistake.
    """
    places = ((name, _asked(prefix_of(name), None, place_of, name)) for name in place_names())
    return " or ".join(name for name, place in places if place is not None and place.roads) or "a file"


def _model_names() -> tuple[str, ...]:
    """All models of all sources, such as `zoo:car`: shipped sources first."""
    return tuple(f"{prefix}:{name}" for prefix, spec in sources().items() for name in _asked(prefix, (), spec.names))


def families_named(name: str) -> Iterator[ZooFamily]:
    """The families of this name in all sources, shipped sources first, without those that cannot be loaded."""
    found = (_asked(prefix, None, family_of, f"{prefix}:{name}") for prefix in sources())
    return (family for family in found if family is not None)


def _asked(prefix: str, otherwise: Any, ask: Callable[..., Any], *about: str) -> Any:
    """The answer of a source about everything it has, or `otherwise` if a third party's plug-in fails: its error concerns only
    recipes that name it.
    """
    try:
        return ask(*about)
    except PluginError:  # in the family or place that a shipped source loads
        return otherwise
    except Exception:
        if not is_third_party("sources", prefix):
            raise
        return otherwise


def family_of(text: str) -> ZooFamily | None:
    """The family of a model's source; None for a file, and for a source that has no families."""
    named = source_of(text)
    if named is None:
        return None
    return checked(SourceSpec, named.prefix, "family", named.spec.family(named.name), ZooFamily, type(None))


def sources() -> Mapping[str, SourceSpec]:
    """All sources by prefix, without third-party ones that cannot be loaded. Those that come with viewsphere are first, so that
    another's does not stand in for them.
    """
    return dict(sorted(loadable(SourceSpec).items(), key=lambda found: is_third_party("sources", found[0])))


def model_for(role: Role, otherwise: str | None = None) -> str:
    """The source of the model that viewsphere itself uses, such as `zoo:car`, shipped sources first; raises UserError if no
    source has one, unless another text is given.
    """
    for prefix, spec in sources().items():
        if role in spec.roles:
            return f"{prefix}:{spec.roles[role]}"
    if otherwise is None:
        raise UserError(f"expected a source with a model as {role}; {gap() or 'found none: install viewsphere again'}")
    return otherwise


def suggested(name: str, among: Callable[[], tuple[str, ...]] = _model_names) -> str:
    """A hint for a name of a model, or among others, whose prefix is misspelt or was forgotten; empty for other texts."""
    known, (prefix, colon, _) = names("sources"), name.partition(":")
    if lacks := gap():
        return f"; {lacks}"
    if colon and re.fullmatch(r"[a-z]\w+", prefix):
        return f"; there is no source {prefix!r}{nearest(prefix, known)}"
    return next((f"; did you mean {text!r}?" for text in among() if text.partition(":")[2] == name), "")


def file_in(spec: ModelSpec) -> Path | None:
    """The file of a model that a source supplies as a file; None for one that it supplies as a mesh."""
    named = source_of(spec.source)
    if named is None:
        return Path(spec.source)
    made = named.spec.load(spec)
    return made if isinstance(made, Path) else None


@lru_cache(maxsize=1024)
def rooms_of(source: str, seed: int | None) -> tuple[NDArray[np.float64], ...]:
    """The air of the rooms in a model of this source and seed, each a box (8, 3) in its own axes, metres; none for a model
    without rooms.
    """
    family = family_of(source)
    if family is None or family.rooms is None or family.draw is None:
        return ()
    rooms: tuple[NDArray[np.float64], ...] = family.rooms(family.draw(np.random.default_rng(seed)))
    for room in rooms:
        room.setflags(write=False)  # kept for the next call
    return rooms
