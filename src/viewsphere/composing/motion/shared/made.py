"""From a recipe's motions to the pose of a thing at each instant."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, TypeVar

import numpy as np

from viewsphere import plugins
from viewsphere.composing.motion.shared.start import Move, Pose, Start
from viewsphere.errors import RecipeError
from viewsphere.model.scene import Matrix4
from viewsphere.model.thing import Motion, TimeStep
from viewsphere.plugins.motion import MotionSpec
from viewsphere.recipe.draws import RngOf, drawn
from viewsphere.recipe.recipe import Recipe
from viewsphere.recipe.world.motion import MotionEntry, Motions, has_clip, listed
from viewsphere.validation.errors import one_of, read_options

T = TypeVar("T")

DIGITS = 10
"""Decimals that poses are recorded with, 1e-10 m: beyond these, sines differ between processors."""


def check_motions(recipe: Recipe) -> None:
    """Raise RecipeError for the first invalid motion of a recipe: one without `time`, one that `check_motion` refuses, or a
    clip that nothing plays.
    """
    for field, motions in _all_motions(recipe):
        if recipe.time is None:
            raise RecipeError(f"{field}: expected time beside motions; found none: set time, such as time: {{frames: 50}}")
        check_motion(motions, field)
    _check_clips(recipe)


def _check_clips(recipe: Recipe) -> None:
    """Check that every named clip is played, by the model or by its company."""
    company = recipe.scene.company
    for i, entry in enumerate(recipe.models):
        playing = (entry.motion, None if company is None else company.motion)
        if entry.clip is not None and entry.frames is None and not any(map(has_clip, playing)):
            raise RecipeError(
                f"models[{i}].clip: expected frames, or a motion of kind clip of the model or of scene.company, that plays "
                f"{entry.clip}; found neither"
            )
        if entry.fps is not None and entry.frames is None and not any(map(has_clip, playing)):
            raise RecipeError(
                f"models[{i}].fps: expected frames, or a motion of kind clip of the model or of scene.company, of which "
                f"{entry.fps:g} make a second; found neither"
            )


def _all_motions(recipe: Recipe) -> Iterator[tuple[str, Motions]]:
    """Yield all motions of a recipe, with their fields."""
    place, company = recipe.scene.place, recipe.scene.company
    for i, entry in enumerate(recipe.models):
        if entry.motion is not None:
            yield f"models[{i}].motion", entry.motion
    if company is not None and company.motion is not None:
        yield "scene.company.motion", company.motion
    for pattern, motions in (place.motion or {} if place else {}).items():
        yield f"scene.place.motion.{pattern}", motions


def check_motion(motions: Motions | None, field: str) -> None:
    """Raise RecipeError, which begins with the field, for an unknown kind or option."""
    for where, entry in listed(motions, field):
        _options(entry, where)


@dataclass(frozen=True, eq=False)
class Mover:
    """The movement of a thing with all values drawn. The state at a time does not depend on the other requested times."""

    start: Start
    moves: tuple[Move, ...]

    def state(self, time: float) -> tuple[Matrix4 | None, TimeStep | None]:
        """World from object at a time, seconds, to 1e-10 m, None if the thing is absent; and the time step of its file."""
        pose = self._at(time)
        return (None, None) if pose is None else (_recorded(pose, self.start.placed), pose.step)

    def motion_at(self, times: Sequence[float]) -> Motion:
        """Return the poses and time steps of the thing at successive times, seconds; a single value for all times if they
        are equal.
        """
        poses, steps = zip(*map(self.state, times), strict=True)
        return Motion(poses=_one(poses), steps=_one(_lasting(steps)))

    def _at(self, time: float) -> Pose | None:
        pose: Pose | None = Pose(np.array(self.start.placed, np.float64))
        for move in self.moves:
            if pose is not None:
                pose = move(time, pose)
        return pose


def mover(motions: Motions | None, start: Start) -> Mover:
    """Return the mover of one thing for these motions; without motions the thing stays still. Each motion changes the pose
    from the previous motions. A thing is absent while any motion reports it absent. Raises RecipeError if a motion is
    impossible.
    """
    return Mover(start, tuple(_moves(motions, start)))


def _moves(motions: Motions | None, start: Start) -> Iterator[Move]:
    """The motions one by one, with all values drawn; draws are seeded by the kind, and by the number of earlier motions of this
    kind.
    """
    seen: Counter[str] = Counter()
    for field, entry in listed(motions, start.field):
        seen[entry.kind] += 1
        rng = partial(start.rng, entry.kind, str(seen[entry.kind]))
        yield _move(entry, replace(start, rng=rng, field=field))


def _move(entry: MotionEntry, start: Start) -> Move:
    spec, options = _options(entry, start.field)

    def generator_of(path: tuple[str, ...]) -> np.random.Generator:
        return start.rng("option", ".".join(path))

    move = spec.moves(drawn(options, generator_of), start)
    return _between(entry, move, generator_of)


def _between(entry: MotionEntry, move: Move, generator_of: RngOf) -> Move:
    """The motion of a thing that is present from its entry until it leaves."""
    if entry.enter is None and entry.leave is None:
        return move
    enter, leave = drawn(entry.enter, generator_of, ("enter",)), drawn(entry.leave, generator_of, ("leave",))

    def moved(time: float, pose: Pose) -> Pose | None:
        is_there = (enter is None or time >= enter) and (leave is None or time < leave)
        return move(time, pose) if is_there else None

    return moved


def _options(entry: MotionEntry, field: str) -> tuple[MotionSpec, Any]:
    """The motion of an entry's kind, and the entry's options in its class."""
    motions = plugins.names("motions")
    if entry.kind not in motions:
        raise RecipeError(f"{field}.kind: {one_of(entry.kind, motions)}")
    spec = plugins.load(MotionSpec, entry.kind)
    return spec, read_options(spec.options, entry.options, field)


def _recorded(pose: Pose, placed: Matrix4) -> Matrix4:
    """The pose as plain data; the placed pose if the thing was not moved."""
    if (pose.matrix == np.array(placed)).all():
        return placed
    rows: Any = tuple(map(tuple, (np.round(pose.matrix, DIGITS) + 0.0).tolist()))
    return rows


def _lasting(steps: Sequence[TimeStep | None]) -> list[TimeStep | None]:
    """The steps, each lasting until the next one; a thing absent at first has its first step from the start."""
    shown = next((step for step in steps if step is not None), None)
    lasting: list[TimeStep | None] = []
    for step in steps:
        shown = step or shown
        lasting.append(shown)
    return lasting


def _one(values: Sequence[T]) -> tuple[T, ...]:
    """The values, or a single one if all are equal."""
    return tuple(values[:1]) if all(value == values[0] for value in values) else tuple(values)
