"""The motion of a model that its layout dropped."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from viewsphere.composing.motion import Move, Pose, Start
from viewsphere.errors import RecipeError
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Number, Positive
from viewsphere.plugins.motion import MotionSpec
from viewsphere.recipe.draws import Drawn


class _Options(Frozen):
    """The options of a fall from the layout `fall` or `container` to the place of rest."""

    begin: Drawn[Number] = Field(default=0.0, description="release time in seconds; before, the thing hangs in its place")
    speed: Drawn[Positive] = Field(default=1.0, description="speed factor: 0.25 is slow motion")


def _moves(options: _Options, start: Start) -> Move:
    """The simulated states, with linear interpolation between them. All things of a scene fell together, so that different
    options for them make them overlap.
    """
    way = start.way
    if way is None:
        raise RecipeError(
            f"{start.field}.kind: expected a layout that drops it, such as scenes: {{layout: fall}}; found another: set "
            "the layout, or take another kind of motion"
        )

    def moved(time: float, pose: Pose) -> Pose:
        return Pose(np.array(way((time - options.begin) * options.speed)), pose.step)

    return moved


MOTION = MotionSpec(options=_Options, moves=_moves)
