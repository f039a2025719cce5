"""Along a smooth curve through points, at a constant speed."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from viewsphere.composing.motion import Heading, Move, Origin, Pose, Start, curve_through, headed
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Positive
from viewsphere.plugins.motion import MotionSpec
from viewsphere.recipe.draws import Drawn, PointDrawn


class _Options(Frozen):
    """Along a smooth curve through points at a constant speed. At 0 s it is at the first; at the last it stays."""

    points: Annotated[tuple[PointDrawn, ...], Field(min_length=2)] = Field(description="[x, y, z] each: metres, world axes")
    speed: Drawn[Positive] = Field(description="metres a second")
    closed: bool = Field(default=False, description="closes the path from the last point to the first, and repeats it")
    heading: Heading = Field(
        default="keep",
        description="keep: keeps its rotation; level: front ahead, upright; along: front ahead, tilted on slopes",
    )
    origin: Origin = Field(
        default="placed",
        description="placed: points are relative to its placement; world: x and y are the world's, z is the height above "
        "its placement",
    )


def _moves(options: _Options, start: Start) -> Move:
    """The centripetal Catmull-Rom curve (`viewsphere.geometry.curve`) by its arc length."""
    curve = curve_through(options.points, options.closed, f"{start.field}.points")

    def moved(time: float, pose: Pose) -> Pose:
        spot, direction = curve.along(options.speed * time)
        pose = pose.put(spot) if options.origin == "world" else pose.moved(spot)
        return headed(pose, direction, options.heading)

    return moved


MOTION = MotionSpec(options=_Options, moves=_moves)
