"""The animations that models play in sequences: the beginning, the end and the shown frames of each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from viewsphere.assets.animation.clip import Timeline
from viewsphere.composing.motion import Start, mover
from viewsphere.composing.seeds import generator
from viewsphere.composing.time_steps import animated_file, animation, resting
from viewsphere.errors import each
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import IDENTITY
from viewsphere.model.thing import TimeStep
from viewsphere.recipe.cameras.sequence import TimeEntry
from viewsphere.recipe.models import ModelEntry
from viewsphere.recipe.recipe import Recipe
from viewsphere.recipe.world.motion import MotionEntry, Motions, has_clip, listed

if TYPE_CHECKING:
    from viewsphere.assets.animation.timeline import Blenders


def with_clips(
    recipe: Recipe, models: Sequence[tuple[ModelSpec, int]]
) -> tuple[tuple[ModelSpec, ...], tuple[Timeline | None, ...]]:
    """The models at the first frame of their animation, with the animation's timeline; None for models without one. `models`
    are specifications with the number of their entry.

    Raises one RecipeError for all files that are unreadable or contain no movement.
    """
    from viewsphere.assets.animation.timeline import Blenders  # which loads readers of models

    with Blenders.none_yet() as blenders:

        def line_of(one: tuple[ModelSpec, int]) -> Timeline | None:
            spec, number = one
            played = [field for field, motions in _playing(recipe, number) if has_clip(motions)]
            return _timeline(spec, recipe.models[number], played[0], blenders) if played else None

        lines = tuple(each(line_of, models))
    pairs = zip(models, lines, strict=True)
    return tuple(spec if line is None else resting(spec, recipe.models[number], line) for (spec, number), line in pairs), lines


def _playing(recipe: Recipe, number: int) -> tuple[tuple[str, Motions | None], ...]:
    """The possible motions of an entry's models, with their fields: the entry's own, and those of distractors."""
    company = recipe.scene.company
    motions = (f"models[{number}].motion", recipe.models[number].motion)
    return (motions,) if company is None else (motions, ("scene.company.motion", company.motion))


def shown_steps(recipe: Recipe, number: int, spec: ModelSpec, line: Timeline) -> tuple[TimeStep, ...]:
    """The time steps of a model that any sequence may show, ascending: all frames of its animation if the choice is random."""
    assert recipe.time is not None
    steps: dict[int, TimeStep] = {}
    for field, motions in _playing(recipe, number):
        clips = tuple(entry for _, entry in listed(motions, field) if entry.kind == "clip")
        if any(map(_is_drawn, clips)):
            return tuple(TimeStep(frame=frame, seconds=line.seconds(frame)) for frame in range(line.first, line.last + 1))
        if clips:
            steps |= {step.frame: step for step in _played(clips, spec, line, recipe.time, field)}
    return tuple(steps[frame] for frame in sorted(steps))


def _played(clips: tuple[MotionEntry, ...], spec: ModelSpec, line: Timeline, time: TimeEntry, field: str) -> list[TimeStep]:
    """The time steps at all instants, and just before and after them, which blurred pictures show."""
    around = range(-1, time.count + 1) if time.shutter else range(time.count)
    start = Start(IDENTITY, spec, time.seconds_at(time.count - 1), lambda *names: generator(0, *names))
    there = tuple(entry.model_copy(update={"enter": None, "leave": None}) for entry in clips)
    moved = mover(there, start.playing(line, field)).motion_at([time.seconds_at(i) for i in around])
    return [step for step in moved.steps if step is not None]


def _is_drawn(entry: MotionEntry) -> bool:
    return any(isinstance(value, (dict, list)) for value in entry.options.values())


def _timeline(spec: ModelSpec, entry: ModelEntry, field: str, blenders: Blenders) -> Timeline:
    return animation(animated_file(spec, field), spec.confined, entry.clip, field, blenders, entry.fps)
