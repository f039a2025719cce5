"""The animation of the model's file."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Literal

from pydantic import Field

from viewsphere.assets.animation.clip import no_animation
from viewsphere.composing.motion import Move, Pose, Start
from viewsphere.errors import RecipeError
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Strength
from viewsphere.model.thing import TimeStep
from viewsphere.plugins.motion import MotionSpec
from viewsphere.recipe.draws import Coordinate, Drawn

Loop = Literal["once", "loop", "back_and_forth"]


class _Options(Frozen):
    """The animation of the model's file: at every instant it shows the nearest frame."""

    speed: Coordinate = Field(default=1.0, description="seconds of the file a second: 2 is twice as fast, -1 backwards")
    loop: Loop = Field(
        default="loop",
        description="once: stops at its last frame; loop: repeats; back_and_forth: alternates forwards and backwards",
    )
    offset: Drawn[Strength] = Field(default=0.0, description="time of the file at 0 s, in seconds")


def _moves(options: _Options, start: Start) -> Move:
    """The file's frame nearest to each time; poses stay."""
    line = start.timeline
    if line is None or not line.moves:
        raise RecipeError(f"{start.field}: {no_animation(start.spec.source)}")
    length = line.seconds(line.last)
    if options.offset > length:
        raise RecipeError(
            f"{start.field}.offset: expected 0 to {length:g} s, the length of the animation in {start.spec.source}; found "
            f"{options.offset:g}"
        )
    within = LOOPS[options.loop]

    def moved(time: float, pose: Pose) -> Pose:
        seconds = within(options.offset + options.speed * time, length)
        frame = line.first + math.floor(round(seconds * line.fps, 6) + 0.5)
        return replace(pose, step=TimeStep(frame=frame, seconds=line.seconds(frame)))

    return moved


def _once(seconds: float, length: float) -> float:
    return min(max(seconds, 0.0), length)


def _loop(seconds: float, length: float) -> float:
    return seconds % length if length else 0.0


def _back_and_forth(seconds: float, length: float) -> float:
    return length - abs(_loop(seconds, 2 * length) - length)


LOOPS: dict[Loop, Callable[[float, float], float]] = {"once": _once, "loop": _loop, "back_and_forth": _back_and_forth}
"""The time within an animation of `length` seconds, from the seconds since its beginning."""


MOTION = MotionSpec(options=_Options, moves=_moves)
