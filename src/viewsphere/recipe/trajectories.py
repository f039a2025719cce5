"""Kinds of viewpoints that are motions of the camera over time; without `time` in the recipe they are refused.

World axes: metres, z up. Headings are counter-clockwise from above: at 0 the camera looks along +Y, as at azimuth 0.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Discriminator, Field, Tag, field_validator, model_validator

from viewsphere.model.frozen import Frozen
from viewsphere.model.numbers import Count, Length, Metres, Number, Positive
from viewsphere.model.validation_errors import shown
from viewsphere.recipe.aim import AZIMUTH, DISTANCE, ELEVATION, SHAKE, TILT, Bins, Shake, in_elevation, in_reach
from viewsphere.recipe.values import shape_of

MOST_POINTS = 10_000
MOST_TURNS = 1_000

Place = tuple[Metres, Metres, Metres]
Spot = tuple[Metres, Metres]


Look = Annotated[
    Annotated[Count, Tag("number")] | Annotated[str, Field(min_length=1), Tag("text")] | Annotated[Place, Tag("list")],
    Discriminator(
        shape_of,
        custom_error_type="look",
        custom_error_message="expected a thing's number or key, [x, y, z], ahead or center",
    ),
]
LOOK = "a thing's number or key, a point [x, y, z] in metres, ahead, or center: the middle of the models at first"

Drift = Annotated[
    Annotated[Number, Tag("number")] | Annotated[tuple[Number, Number], Tag("list")],
    Discriminator(
        shape_of,
        custom_error_type="drift",
        custom_error_message="expected a number or [from, to]",
    ),
]
"""A number that stays, or the numbers at the sequence's first and last instant; even in between."""


def ends(drift: float | tuple[float, float]) -> tuple[float, float]:
    """The numbers at the first and at the last instant."""
    return drift if isinstance(drift, tuple) else (drift, drift)


class Moving(Frozen):
    """Base of all motions of the camera."""

    target: ClassVar[Literal["center"]] = "center"
    """The target of static viewpoints; trajectories use `look` instead."""

    bins: Bins = 45.0
    shake: Shake | None = Field(default=None, description=SHAKE)
    follow: bool = Field(
        default=True, strict=True, description="true: keeps looking at a moving thing; false: at its first position"
    )


class OrbitPath(Moving):
    """A circle, or a part of one, around what the camera looks at."""

    kind: Literal["orbit"] = Field(description="a circle around its target")
    look: Look = Field(default="center", description=f"the centre of its circle: {LOOK}; not ahead")
    azimuth: Drift = Field(default=0.0, description=f"degrees, a number or [from, to]; {AZIMUTH}")
    elevation: Drift = Field(default=20.0, description=f"degrees {ELEVATION}; a number or [from, to]")
    distance: Drift = Field(description=f"{DISTANCE}; a number or [from, to]")
    tilt: Drift = Field(default=0.0, description=f"degrees, a number or [from, to]; {TILT}")
    turns: Number | None = Field(
        default=None,
        description="turns over the sequence, counter-clockwise from above; after a whole turn, the next instant would "
        "repeat the first; 1 by default if azimuth is a number",
    )
    speed_deg: Number | None = Field(default=None, description="instead of turns: degrees per second")

    @field_validator("look")
    @classmethod
    def _around(cls, value: int | str | Place) -> int | str | Place:
        if value == "ahead":
            raise ValueError("expected what to go around; found ahead")
        return value

    @field_validator("elevation")
    @classmethod
    def _elevation(cls, value: float | tuple[float, float]) -> float | tuple[float, float]:
        in_elevation(min(ends(value)), max(ends(value)))
        return value

    @field_validator("distance", mode="before")
    @classmethod
    def _in_metres(cls, value: Any) -> Any:
        if isinstance(value, dict) and "fill" in value:
            raise ValueError("expected metres, as what moves fills another share of every picture; found fill: give a distance")
        return value

    @field_validator("distance")
    @classmethod
    def _distance(cls, value: float | tuple[float, float]) -> float | tuple[float, float]:
        in_reach(min(ends(value)), max(ends(value)))
        return value

    @model_validator(mode="after")
    def _one_pace(self) -> OrbitPath:
        given = [n for n in ("turns", "speed_deg") if getattr(self, n) is not None]
        given += ["azimuth: [from, to]"] if isinstance(self.azimuth, tuple) else []
        if len(given) > 1:
            raise ValueError(f"expected one of azimuth: [from, to], turns and speed_deg; found {' and '.join(given)}")
        return self


class SplinePath(Moving):
    """A smooth path through points."""

    kind: Literal["spline"] = Field(description="a smooth path through points")
    points: Annotated[tuple[Place, ...], Field(min_length=2, max_length=MOST_POINTS)] = Field(
        description="[x, y, z] in metres, two or more, that the camera passes through"
    )
    closed: bool = Field(default=False, strict=True, description="closes the path from the last point to the first")
    speed: Positive | None = Field(
        default=None, description="metres a second, up to the end; default: the whole path over the sequence"
    )
    times: Annotated[tuple[Number, ...], Field(min_length=2)] | None = Field(
        default=None, description="instead of speed: time of each point in seconds, ascending"
    )
    look: Look = Field(default="ahead", description=LOOK)

    @model_validator(mode="after")
    def _apart(self) -> SplinePath:
        around = (*self.points, self.points[0]) if self.closed else self.points
        for i, (a, b) in enumerate(pairwise(around)):
            if a == b:
                raise ValueError(
                    f"expected points that differ from the one before; found points[{i}] and the next at {shown(a)}"
                )
        if self.closed and len(self.points) < 3:
            raise ValueError(f"expected three points or more of a closed path; found {len(self.points)}")
        return self

    @model_validator(mode="after")
    def _in_time(self) -> SplinePath:
        if self.times is None:
            return self
        if self.speed is not None:
            raise ValueError("expected speed or times; found both")
        wanted = len(self.points) + self.closed
        if len(self.times) != wanted:
            more = ", and one for the first point again" if self.closed else ""
            raise ValueError(f"expected a time for each of {len(self.points)} points{more}; found {len(self.times)}")
        for a, b in pairwise(self.times):
            if b <= a:
                raise ValueError(f"expected times that ascend; found {b:g} after {a:g}")
        return self


class DrivePath(Moving):
    """Along a lane of the place, as a camera on a car."""

    kind: Literal["drive"] = Field(description="along a lane of the place")
    lane: Annotated[str, Field(min_length=1)] | None = Field(default=None, description="its name; default: the place's first")
    speed: Positive = Field(default=10.0, description="metres a second; it stops at the lane's end, or repeats a closed lane")
    height: Length = Field(default=1.5, description="metres above the lane")
    offset: Annotated[Metres, Field(ge=0)] = Field(default=0.0, description="metres along the lane at the first instant")
    side: Metres = Field(default=0.0, description="metres to the right of the lane's middle; below 0 to the left")
    look: Look = Field(default="ahead", description=LOOK)


class Turn(Frozen):
    """A turn of a walk."""

    at: Annotated[Number, Field(ge=0)] = Field(description="start in seconds from the sequence's first instant")
    degrees: Number = Field(description="to the left; negative: to the right")


class WalkPath(Moving):
    """At eye height over the floor, straight on with turns, or through points, with a gentle bob."""

    kind: Literal["walk"] = Field(description="at eye height over the floor")
    start: Spot | None = Field(default=None, description="start [x, y] in metres")
    heading: Number = Field(default=0.0, description="initial direction in degrees: 0 walks along +Y, 90 along -X")
    turns: Annotated[tuple[Turn, ...], Field(max_length=MOST_TURNS)] = Field(
        default=(), description="a list of turns {at, degrees}"
    )
    turn_rate: Positive = Field(default=45.0, description="degrees a second during a turn")
    points: Annotated[tuple[Spot, ...], Field(min_length=2, max_length=MOST_POINTS)] | None = Field(
        default=None, description="instead of start: [x, y] in metres, two or more, to walk through"
    )
    speed: Positive = Field(default=1.4, description="metres a second; through points it stops at the last")
    eye_height: Length = Field(default=1.6, description="metres above the floor, z = 0")
    bob: Annotated[Metres, Field(ge=0, le=1)] = Field(
        default=0.02, description="vertical movement of the eyes from the middle in metres, twice a stride"
    )
    stride: Length = Field(default=1.5, description="length of two steps in metres")
    look: Look = Field(default="ahead", description=LOOK)

    @model_validator(mode="after")
    def _one_way(self) -> WalkPath:
        if (self.start is None) == (self.points is None):
            raise ValueError(f"expected start or points; found {'neither' if self.start is None else 'both'}")
        if self.points is not None and self.turns:
            raise ValueError("expected turns beside start; found them beside points")
        for i, (a, b) in enumerate(pairwise(self.points or ())):
            if a == b:
                raise ValueError(
                    f"expected points that differ from the one before; found points[{i}] and the next at {shown(a)}"
                )
        for a, b in pairwise(self.turns):
            end = a.at + abs(a.degrees) / self.turn_rate
            if b.at < end:
                raise ValueError(f"expected turns one after another, this after {end:g} s; found it at {b.at:g} s")
        return self


class MastPost(Moving):
    """A camera on a mast, or straight overhead: it stays, and may turn or go with a thing."""

    kind: Literal["mast"] = Field(description="a fixed place, or straight overhead")
    position: Place | None = Field(default=None, description="[x, y, z] in metres")
    overhead: Length | None = Field(
        default=None, description="instead of position: metres straight above its target; follows a moving thing"
    )
    heading: Number = Field(
        default=0.0, description="for a view straight down: the direction that is up in the picture, degrees; 0 is +Y, 90 is -X"
    )
    look: Look = Field(default="center", description=f"{LOOK}; not ahead")

    @model_validator(mode="after")
    def _one_place(self) -> MastPost:
        if (self.position is None) == (self.overhead is None):
            raise ValueError(f"expected position or overhead; found {'neither' if self.position is None else 'both'}")
        if self.look == "ahead":
            raise ValueError("expected what to look at; found look: ahead")
        if self.position is not None and self.look == self.position:
            raise ValueError(f"expected look away from position; found both at {shown(self.look)}")
        return self


AnyTrajectory = OrbitPath | SplinePath | DrivePath | WalkPath | MastPost
