"""The seams: what an engine and a format must offer, and how a name finds its module.

A plug-in is one module; its name is its file's name, listed without importing it. Third parties use the entry-point
groups `viewsphere.engines` and `viewsphere.formats`. What is found by name is imported here and nowhere else.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import entry_points
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Protocol

from viewsphere.errors import UserError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
    from pydantic import JsonValue

    from viewsphere.assets.mesh import Mesh
    from viewsphere.model.camera import Camera
    from viewsphere.model.shot import Frame, ModelSpec, Shot
    from viewsphere.store import Dataset
    from viewsphere.truth.geometry import Geometry
    from viewsphere.truth.visibility import Visibility

Kind = Literal["engines", "formats"]


class Stage(Protocol):
    """What an engine built for a shot and keeps warm while the camera moves."""

    geometry: Geometry

    def color(self, camera: Camera, frame: Frame, visibility: Visibility) -> NDArray[np.uint8]:
        """The picture, (H, W, 3) uint8 sRGB; `visibility` is truth's buffer for this camera.

        Where the frame's finish (or else the scene's) has a transparent background, (H, W, 4) with straight alpha: black where
        nothing is seen. Over any plain background it gives the picture with that background.
        """
        ...


class Engine(Protocol):
    """A module that paints pictures: `check` its options, `stage` a shot. Only with `OPENS_SCENES = True` it is given shots
    whose scene is a .blend file (`scene.blend`); with `CATCHES_SHADOWS = False` none whose ground is a shadow catcher.
    """

    def check(self, options: Mapping[str, JsonValue]) -> None:
        """Raise UserError for an option that is not known, or out of range; asked before anything is rendered."""
        ...

    def stage(self, shot: Shot, load: Callable[[ModelSpec], Mesh]) -> Stage:
        """Build what all frames of the shot share; `load` gives a model's normalised mesh."""
        ...


class Format(Protocol):
    """A module that writes a data set in one format: `export`; with `CHANNELS`, the names of the channels it needs, a run
    that does not keep them is refused before it begins; with `check()`, one that cannot be written here, by a UserError. One
    that has `read(path, *, keep_going) -> ForeignDataset` (`viewsphere.store.foreign`) can be imported, too.
    """

    def export(self, dataset: Dataset, folder: Path) -> Sequence[str] | None:
        """Write the finished frames of the data set into this empty folder; images by `dataset.link`.

        May give notes for the user, a line each.
        """
        ...


def names(kind: Kind) -> tuple[str, ...]:
    """Names of all plug-ins of this kind, sorted; none is imported."""
    package = importlib.import_module(f"viewsphere.{kind}")
    own = {m.name for m in pkgutil.iter_modules(package.__path__) if not m.name.startswith("_")}
    return tuple(sorted(own | {e.name for e in entry_points(group=f"viewsphere.{kind}")}))


def load(kind: Kind, name: str) -> Any:
    """The plug-in's module (or the object its entry point names).

    Raises UserError for an unknown name, with the nearest known one.
    """
    for entry in entry_points(group=f"viewsphere.{kind}"):
        if entry.name == name:
            return entry.load()
    known = names(kind)
    if name not in known:
        raise _unknown(kind[:-1], name, known)
    return importlib.import_module(f"viewsphere.{kind}.{name}")


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
    path = importlib.import_module(package).__path__
    return tuple(sorted(m.name for m in pkgutil.iter_modules(path) if not m.ispkg))


def _module(package: str, what: str, name: str) -> Any:
    known = _modules(package)
    if name not in known:
        raise _unknown(what, name, known)
    return importlib.import_module(f"{package}.{name}")


def _unknown(what: str, name: str, known: tuple[str, ...]) -> UserError:
    from viewsphere.model.mistakes import one_of

    return UserError(f"{what}: {one_of(name, known)}")
