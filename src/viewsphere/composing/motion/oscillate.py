"""To and fro."""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field

from viewsphere.composing.motion import Amplitude, Move, Pose, Start
from viewsphere.geometry.rotation import rotation_about
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Positive
from viewsphere.plugins.motion import MotionSpec
from viewsphere.recipe.draws import Coordinate, Drawn


class _Options(Frozen):
    """Oscillation, as the sine of time: at 0 s in the middle, the pose without this motion, unless phase_deg shifts it."""

    position: Amplitude = Field(default=(0.0, 0.0, 0.0), description="[x, y, z]: amplitude in metres along the world's axes")
    rotation_deg: Amplitude = Field(
        default=(0.0, 0.0, 0.0), description="[x, y, z]: amplitude in degrees, about this vector in its own axes"
    )
    period: Drawn[Positive] = Field(default=1.0, description="period in seconds")
    phase_deg: Coordinate = Field(
        default=0.0, description="phase in degrees: 90 begins at one side, 180 in the middle, on the way back"
    )


def _moves(options: _Options, start: Start) -> Move:
    """A sine of position and angle."""
    side, turn = np.array(options.position), np.radians(options.rotation_deg)
    phase = math.radians(options.phase_deg)

    def moved(time: float, pose: Pose) -> Pose:
        share = math.sin(2 * math.pi * time / options.period + phase)
        return pose.turned(rotation_about(turn * share)).moved(side * share)

    return moved


MOTION = MotionSpec(options=_Options, moves=_moves)
