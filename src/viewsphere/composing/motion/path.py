"""Along a lane of the place, or along points of the world, with the front ahead."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from viewsphere.composing.motion import Heading, Lane, Move, Pose, Start, curve_through, headed, to_the_right
from viewsphere.errors import RecipeError
from viewsphere.geometry.curve import Curve
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Positive
from viewsphere.plugins.motion import MotionSpec
from viewsphere.plugins.source import with_roads
from viewsphere.recipe.draws import Coordinate, Drawn, PointDrawn
from viewsphere.validation.errors import one_of

ANY = "any"


class _Options(Frozen):
    """Along a lane of the place, or along points of the world, at a constant speed. The thing keeps its height above z = 0 as
    its height above the path.
    """

    lane: Drawn[Annotated[str, Field(min_length=1)]] | None = Field(
        default=None, description="name of a lane of scene.place, or any: a random one"
    )
    points: Annotated[tuple[PointDrawn, ...], Field(min_length=2)] | None = Field(
        default=None, description="or [x, y, z] each, metres: points of the world, with a smooth curve through them"
    )
    speed: Drawn[Positive] = Field(description="metres a second")
    closed: bool = Field(default=False, description="for points: closes the path from the last to the first")
    offset: Coordinate = Field(
        default=0.0, description="position along the path at 0 s, metres; below 0: reaches the beginning of an open path later"
    )
    side: Coordinate = Field(default=0.0, description="offset in metres to the right of the path; below 0 to the left")
    heading: Heading = Field(
        default="along",
        description="along: front ahead, tilted on slopes; level: front ahead, upright; keep: keeps its rotation",
    )
    end: Literal["stay", "leave"] = Field(
        default="stay",
        description="at both ends of an open path: stay: waits there; leave: is absent",
    )

    @model_validator(mode="after")
    def _check(self) -> _Options:
        if (self.lane is None) == (self.points is None):
            raise ValueError(f"expected one of lane, points; found {'none' if self.lane is None else 'both'}")
        if self.lane is not None and self.closed:
            raise ValueError("expected points beside closed: true; found lane, which is closed or not by itself")
        return self


def _moves(options: _Options, start: Start) -> Move:
    """The path by its arc length."""
    curve = _curve(options, start)
    if not curve.closed and options.offset > curve.length:
        raise RecipeError(
            f"{start.field}.offset: expected at most {curve.length:g} m, the length of the way; found {options.offset:g}"
        )

    def moved(time: float, pose: Pose) -> Pose | None:
        length = options.offset + options.speed * time
        if options.end == "leave" and not curve.closed and not 0 <= length <= curve.length:
            return None
        spot, direction = curve.along(length)
        return headed(pose.put(spot + options.side * to_the_right(direction)), direction, options.heading)

    return moved


def _curve(options: _Options, start: Start) -> Curve:
    if options.lane is None:
        return curve_through(options.points or (), options.closed, f"{start.field}.points")
    lane = _lane(options.lane, start)
    return curve_through(lane.points, lane.closed, f"{start.field}.lane")


def _lane(name: str, start: Start) -> Lane:
    """The lane of this name, or a random one."""
    lanes = {lane.name: lane for lane in start.lanes}
    if not lanes:
        raise RecipeError(
            f"{start.field}.lane: expected a place with lanes, such as scene.place: {with_roads()}; found none: set one, or "
            "list points"
        )
    if name == ANY:
        return start.lanes[int(start.rng("lane").integers(len(lanes)))]
    if name not in lanes:
        raise RecipeError(f"{start.field}.lane: {one_of(name, (ANY, *lanes))}")
    return lanes[name]


MOTION = MotionSpec(options=_Options, moves=_moves)
