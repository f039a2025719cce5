"""What a camera looks at, how the names of its poses are cut, how it shakes: what kinds of viewpoints have in common."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Discriminator, Field, Tag, field_validator

from viewsphere.geometry.pose_category import pose_category
from viewsphere.model.frozen import Frozen
from viewsphere.model.numbers import Number, Positive
from viewsphere.recipe.values import Point, shape_of

AZIMUTH = "0: the camera faces the model's front; 90: it stands on the model's left, +X"
ELEVATION = "above the horizon, -90 to 90"
FARTHEST = 1e6
"""Largest distance of a camera from its target, metres: ten times the largest model allowed."""

DISTANCE = "from the target to the camera, metres"
TILT = "roll of the camera about its axis, clockwise seen from behind"


def in_elevation(low: float, high: float) -> None:
    """Raise ValueError for elevations, degrees, beyond the poles."""
    if low < -90 or high > 90:
        raise ValueError(f"expected elevations of -90 to 90 degrees; found {low if low < -90 else high:g}")


def in_reach(low: float, high: float) -> None:
    """Raise ValueError for distances, metres, that are none or too large."""
    if low <= 0:
        raise ValueError(f"expected distances above 0 m; found {low:g}")
    if high > FARTHEST:
        raise ValueError(f"expected distances of at most {FARTHEST:,.0f} m; found {high:g}")


def _divides_turn(value: float) -> float:
    try:
        pose_category(0.0, 0.0, value)
    except ValueError:
        raise ValueError(f"expected a number of degrees that divides 360; found {value:g}") from None
    return value


Bins = Annotated[
    Positive,
    AfterValidator(_divides_turn),
    Field(description="width in degrees of the named pose categories (front, front-left, ...); has to divide 360"),
]


class Shake(Frozen):
    """How much a camera is shaken by the hand that holds it: smooth noise about and along each of its axes."""

    degrees: Annotated[Number, Field(ge=0, le=90)] = Field(default=0.0, description="most that it turns about each of its axes")
    mm: Annotated[Number, Field(ge=0, le=1e5)] = Field(
        default=0.0, description="most millimetres that it moves along each of its axes"
    )
    hertz: Annotated[Number, Field(gt=0, le=100)] = Field(default=4.0, description="no part of it is faster than this")


SHAKE = "under time: a hand that is not still: degrees and mm at most, nothing faster than hertz"


class Aimed(Frozen):
    """What all kinds of viewpoints have that may stand still."""

    target: Annotated[
        Annotated[Literal["center", "follow"], Tag("text")] | Annotated[Point, Tag("list")], Discriminator(shape_of)
    ] = Field(
        default="center",
        description="what the camera looks at: the centre of the model's box, or a point [x, y, z] in metres. An animated "
        "model's centre is that of the first frame; follow goes with it",
    )
    bins: Bins = 45.0
    shake: Shake | None = Field(default=None, description=SHAKE)

    @field_validator("target", mode="before")
    @classmethod
    def _target(cls, value: Any) -> Any:
        if value not in ("center", "follow") and not (isinstance(value, (list, tuple)) and len(value) == 3):
            raise ValueError(f"expected center, follow or [x, y, z]; found {value!r}")
        return value
