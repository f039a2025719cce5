"""At a constant velocity, turning at a constant rate."""

from __future__ import annotations

import numpy as np
from pydantic import Field

from viewsphere.composing.motion import Move, Start
from viewsphere.geometry.rotation import rotation_about
from viewsphere.model.fields.frozen import Frozen
from viewsphere.plugins.motion import MotionSpec
from viewsphere.recipe.draws import Coordinate, Drawn


class _Options(Frozen):
    """At a constant velocity, turning at a constant rate; at 0 s it is where it was placed."""

    velocity: Drawn[tuple[Coordinate, Coordinate, Coordinate]] = Field(
        default=(0.0, 0.0, 0.0), description="[x, y, z]: metres a second, world axes"
    )
    spin_deg: Drawn[tuple[Coordinate, Coordinate, Coordinate]] = Field(
        default=(0.0, 0.0, 0.0),
        description="[x, y, z]: degrees a second about the thing's own axes; the thing turns about one axis, this vector",
    )


def _moves(options: _Options, start: Start) -> Move:
    """A straight line, and a turn about one axis through the thing's origin."""
    velocity, spin = np.array(options.velocity), np.radians(options.spin_deg)
    return lambda time, pose: pose.turned(rotation_about(spin * time)).moved(velocity * time)


MOTION = MotionSpec(options=_Options, moves=_moves)
