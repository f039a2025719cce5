"""Smooth random motion around the pose without this motion."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from viewsphere.composing.motion import Amplitude, Move, Pose, Start
from viewsphere.composing.noise import noise
from viewsphere.geometry.rotation import rotation_about
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Positive
from viewsphere.plugins.motion import MotionSpec
from viewsphere.recipe.draws import Drawn


class _Options(Frozen):
    """Smooth random motion around the pose without it, bounded by the highest frequency and the amplitudes."""

    position: Amplitude = Field(
        default=(0.0, 0.0, 0.0), description="[x, y, z]: largest amplitude in metres along the world's axes"
    )
    rotation_deg: Amplitude = Field(
        default=(0.0, 0.0, 0.0), description="[x, y, z]: largest amplitude of the rotation vector in its own axes, degrees"
    )
    highest_hz: Drawn[Positive] = Field(default=0.5, description="highest frequency, hertz")


def _moves(options: _Options, start: Start) -> Move:
    """Band-limited noise (`viewsphere.composing.noise`) of six components."""
    sides, turns = np.array(options.position), np.radians(options.rotation_deg)
    way = noise(start.rng("noise"), 6, options.highest_hz)

    def moved(time: float, pose: Pose) -> Pose:
        shares = way.values_at(time)
        return pose.turned(rotation_about(turns * shares[3:])).moved(sides * shares[:3])

    return moved


MOTION = MotionSpec(options=_Options, moves=_moves)
