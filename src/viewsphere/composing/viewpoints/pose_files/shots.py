"""Files of shots (`.jsonl`): a line each, JSON as defined in `viewsphere.model.listed`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import islice
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from viewsphere.composing.viewpoints.pose_files.entries import Arranged, Extrinsics, PoseFile
from viewsphere.composing.viewpoints.pose_files.lines import read_text
from viewsphere.composing.viewpoints.pose_files.motions import motions
from viewsphere.errors import RecipeError
from viewsphere.model.listed import ListedShot, Pose
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.store.texts import parsed
from viewsphere.validation.errors import report


def read_shots(path: Path) -> PoseFile:
    """Read all shots of a file in its order, and name the unnamed ones; empty lines and `#` comments are ignored.

    Raises RecipeError with file and line for an invalid shot, an invalid pose and a repeated name.
    A line without a lens is also an error where others have one.
    """
    try:
        facts = path.stat()
    except OSError as error:
        raise RecipeError(f"{path}: expected a readable file of shots; found: {error.strerror or error}") from None
    return _read(path, (facts.st_mtime_ns, facts.st_size))


@lru_cache(maxsize=1)
def _read(path: Path, _stamp: tuple[int, int]) -> PoseFile:
    """The shots of a file, cached by its modification time, because samplers read it more than once."""
    found: list[tuple[int, ListedShot]] = []
    first = dict[str, int]()
    for line, said in _lines(path):
        name = said.name or f"shot-{len(found):06d}"
        before = first.setdefault(name.casefold(), line)
        if before != line:
            raise RecipeError(f"{path}:{line}: name: expected one that no other shot has; found {name!r}, as in {before}")
        found.append((line, said.model_copy(update={"name": name})))
    entries = _motions([(said.world_from_camera, f"{path}:{line}: world_from_camera") for line, said in found])
    places = iter(_motions([*_places(path, found)]))
    shots = [Arranged(said, line, tuple(islice(places, len(said.objects)))) for line, said in found]
    lenses = _lenses(path, shots)
    one = lenses[0] if len(set(lenses)) == 1 else None
    return PoseFile(entries, intrinsics=one, lenses=() if one else lenses, shots=tuple(shots))


def _lines(path: Path) -> Iterator[tuple[int, ListedShot]]:
    for number, text in enumerate(read_text(path, "shots").split("\n"), 1):
        if not text.strip() or text.lstrip().startswith("#"):
            continue
        try:
            data = parsed(text)
        except ValueError as error:
            raise RecipeError(f"{path}:{number}: expected a shot as JSON; found: {error}") from None
        try:
            yield number, ListedShot.model_validate(data)
        except ValidationError as error:
            mistakes = report(error, data).splitlines()
            raise RecipeError("\n".join(f"{path}:{number}: {mistake}" for mistake in mistakes)) from None


def _places(path: Path, found: Sequence[tuple[int, ListedShot]]) -> Iterator[tuple[Pose, str]]:
    for line, said in found:
        for i, one in enumerate(said.objects):
            yield one.world_from_object, f"{path}:{line}: objects[{i}].world_from_object"


def _motions(poses: Sequence[tuple[Pose, str]]) -> tuple[Extrinsics, ...]:
    """Poses, each with its place for messages, as motions."""
    return motions(np.array([pose for pose, _ in poses]).reshape(-1, 4, 4), lambda i: poses[i][1])


def _lenses(path: Path, shots: list[Arranged]) -> tuple[Intrinsics, ...]:
    """The lens of each shot; empty if no line has one."""
    lenses = [shot.said.camera for shot in shots if shot.said.camera is not None]
    if lenses and len(lenses) < len(shots):
        line = next(shot.line for shot in shots if shot.said.camera is None)
        raise RecipeError(f"{path}:{line}: camera: expected one in every line, as other lines have one; found none")
    return tuple(lenses)
