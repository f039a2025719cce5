"""The contents of a .blend scene, which Blender lists once, without meshes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from viewsphere.assets.readers.blender.reading import why_no_answer
from viewsphere.blender.interpreter import find_blender
from viewsphere.blender.process import BlenderProcess
from viewsphere.errors import BlenderDied, BlenderError, ModelError
from viewsphere.geometry.rotation import Float, matrix_from_quaternion, rigid
from viewsphere.limits import limits


@dataclass(frozen=True)
class SceneObject:
    """An object of a file: its kind in Blender's terms, its `parent`, the names of all collections around it, its custom
    properties, the names of its parts that a render would show at any requested frame, and its pose at the first frame:
    `place` (x, y, z) in metres and `turn`, a quaternion (w, x, y, z), in the file's world.
    """

    name: str
    kind: str
    parent: str | None
    collections: tuple[str, ...]
    properties: Mapping[str, str | int | float | bool]
    parts: tuple[str, ...]
    place: tuple[float, float, float]
    turn: tuple[float, float, float, float]

    @property
    def file_from_object(self) -> Float:
        """Pose of the object at the first frame: rigid, (4, 4), metres, in the file's world."""
        return rigid(matrix_from_quaternion(self.turn), np.array(self.place))


@dataclass(frozen=True)
class SceneFile:
    """The objects of a file; `unit`: metres in one of its units; whether it has light; warnings for the user; and, in
    `showing`, the names of the objects that are visible at the file's `first` frame and at each requested one.
    """

    path: Path
    objects: tuple[SceneObject, ...]
    unit: float
    is_lit: bool
    warnings: tuple[str, ...]
    first: int = 1
    showing: Mapping[int, frozenset[str]] = field(default_factory=dict[int, frozenset[str]])

    @cached_property
    def by_name(self) -> Mapping[str, SceneObject]:
        """Objects by their names."""
        return {one.name: one for one in self.objects}

    def ancestors(self, one: SceneObject) -> tuple[SceneObject, ...]:
        """An object's parent, its parent's parent, and so on."""
        found: list[SceneObject] = []
        while (parent := self.by_name.get(one.parent or "")) is not None and len(found) < len(self.objects):
            one = parent
            found.append(one)
        return tuple(found)


@lru_cache(maxsize=64)
def scene_file(path: Path, confined: bool = True, shown: tuple[str, ...] = (), frames: tuple[int, ...] = ()) -> SceneFile:
    """The file's contents at its first frame and at `frames`; `shown` are patterns of objects to include although renders do
    not show them.

    With `confined`, nothing outside of the file's folder is read. Raises ModelError in one line for a file that Blender cannot
    open, MissingExtraError without a Blender.
    """
    told = _asked(path, confined, "contents", frames=frames, shown=shown, most=limits.MAX_BLENDER_TRIANGLES)
    objects = tuple(_object(one, told["unit"]) for one in told["objects"])
    warnings = tuple(f"{path.name}: {line}" for line in told["warnings"])
    showing = {frame: frozenset(names) for frame, names in told["showing"]}
    return SceneFile(path, objects, told["unit"], told["is_lit"], warnings, told["first"], showing)


@lru_cache(maxsize=64)
def places(path: Path, confined: bool, names: tuple[str, ...], frames: tuple[int, ...]) -> Mapping[int, Mapping[str, Float]]:
    """Poses of the named objects at each of the ascending frames: rigid, (4, 4), metres. Raises as `scene_file` does."""
    told = _asked(path, confined, "places", names=names, frames=frames)
    unit = told["unit"]
    stands = [[_standing(place, turn, unit) for place, turn in at] for at in told["places"]]
    return {frame: dict(zip(names, at, strict=True)) for frame, at in zip(frames, stands, strict=True)}


def _asked(path: Path, confined: bool, do: str, **told: Any) -> Any:
    place = path.parent.resolve()
    readable = [place] if confined else [Path("/")]
    told |= {"file": str(path.resolve()), "root": str(place) if confined else None}
    seconds = limits.MAX_READ_SECONDS
    try:
        process = BlenderProcess(find_blender(), readable=readable)
    except BlenderDied as error:
        raise ModelError(f"{path}: {error}") from None
    try:
        with process:
            return process.ask(do, seconds, **told)
    except BlenderError as error:
        raise ModelError(f"{path}: Blender cannot read it: {str(error).removeprefix('ValueError: ')}") from None
    except BlenderDied as error:
        raise ModelError(f"{path}: {why_no_answer(error, seconds)}") from None


def _standing(place: Sequence[float], turn: Sequence[float], unit: float) -> Float:
    return rigid(matrix_from_quaternion(turn), unit * np.array(place))


def _object(told: Mapping[str, Any], unit: float) -> SceneObject:
    x, y, z = (unit * v for v in told["place"])
    collections, parts = (tuple(told[name]) for name in ("collections", "parts"))
    fields = {name: told[name] for name in ("name", "kind", "parent", "properties")}
    return SceneObject(**fields, collections=collections, parts=parts, place=(x, y, z), turn=tuple(told["turn"]))
