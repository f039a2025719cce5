"""The fields that all kinds of viewpoints share: target, bins of pose names, shake."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Discriminator, Field, Tag, field_validator

from viewsphere.geometry.pose_category import pose_category
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Number, Positive
from viewsphere.recipe.values import Interval, Point, Range, Values, shape_of

AZIMUTH = "0: the camera faces the model's front; 90: it stands on the model's left, +X"
ELEVATION = "above the horizon, -90 to 90"
FARTHEST = 1e6
"""Largest distance of a camera from its target, metres: ten times the largest model allowed."""

FULLEST = 4.0
"""Largest share of the picture that a model may fill: nearer cameras are inside the boxes of most models."""

EMPTIEST = 1e-6
"""Smallest share of the picture that a model may fill. A model that fills less is far smaller than a pixel, and the squares of
an orthographic pixel's size underflow far below it.
"""

DISTANCE = "from the target to the camera, metres"
FILL = (
    "or {fill: 0.6}: the distance at which the box around the frame's model (in random scenes, around all models) fills 0.6 of "
    "the picture's width or height, whichever is more, including parts beyond the edges"
)
TILT = "roll of the camera about its axis, clockwise seen from behind"


def in_elevation(low: float, high: float) -> None:
    """Raise ValueError for elevations, degrees, beyond the poles."""
    if low < -90 or high > 90:
        raise ValueError(f"expected elevations of -90 to 90 degrees; found {low if low < -90 else high:g}")


def in_reach(low: float, high: float) -> None:
    """Raise ValueError for distances, metres, that are not positive or too large."""
    if low <= 0:
        raise ValueError(f"expected distances above 0 m; found {low:g}")
    if high > FARTHEST:
        raise ValueError(f"expected distances of at most {FARTHEST:,.0f} m; found {high:g}")


def _in_picture(low: float, high: float) -> None:
    """Raise ValueError for filled shares of a picture that are too small or too large."""
    if low < EMPTIEST or high > FULLEST:
        raise ValueError(f"expected a share of {EMPTIEST:g} to {FULLEST:g}; found {low if low < EMPTIEST else high:g}")


class Fill(Frozen):
    """A distance given by the filled share of the picture: one share, or several for a grid."""

    fill: Values = Field(description="larger of box width / picture width and box height / picture height")

    @field_validator("fill")
    @classmethod
    def _fill(cls, value: float | tuple[float, ...] | Range) -> float | tuple[float, ...] | Range:
        _in_picture(*ends_of(value))
        return value


class FillBetween(Frozen):
    """A random distance, given by a range of the filled share of the picture."""

    fill: Interval = Field(description="a number or [low, high] (uniform), as for a grid")

    @field_validator("fill")
    @classmethod
    def _fill(cls, value: tuple[float, float]) -> tuple[float, float]:
        _in_picture(*value)
        return value


def ends_of(values: float | tuple[float, ...] | Range) -> tuple[float, float]:
    """Least and greatest value of an axis."""
    if isinstance(values, Range):
        return values.start, values.value(values.count - 1)
    return (min(values), max(values)) if isinstance(values, tuple) else (values, values)


def _form_of_distance(value: Any) -> str:
    given = isinstance(value, Fill | FillBetween) or (isinstance(value, dict) and "fill" in value)
    return "fill" if given else "metres"


Distances = Annotated[Annotated[Fill, Tag("fill")] | Annotated[Values, Tag("metres")], Discriminator(_form_of_distance)]
DistanceBetween = Annotated[
    Annotated[FillBetween, Tag("fill")] | Annotated[Interval, Tag("metres")], Discriminator(_form_of_distance)
]
DistanceAround = Annotated[
    Annotated[FillBetween, Tag("fill")] | Annotated[Positive, Field(le=FARTHEST), Tag("metres")],
    Discriminator(_form_of_distance),
]
"""Types of the distance of a grid, of random and of normal viewpoints: metres, or a share of the picture."""


def _divides_turn(value: float) -> float:
    try:
        pose_category(0.0, 0.0, value)
    except ValueError:
        raise ValueError(f"expected a number of degrees that divides 360; found {value:g}") from None
    return value


Bins = Annotated[
    Positive,
    AfterValidator(_divides_turn),
    Field(description="width in degrees of the named pose categories (front, front-left, ...); must divide 360"),
]


class Shake(Frozen):
    """The shake of a hand-held camera: smooth noise about and along each of its axes."""

    degrees: Annotated[Number, Field(ge=0, le=90)] = Field(
        default=0.0, description="largest rotation about each of its axes, degrees"
    )
    mm: Annotated[Number, Field(ge=0, le=1e5)] = Field(
        default=0.0, description="largest movement along each of its axes, millimetres"
    )
    hertz: Annotated[Number, Field(gt=0, le=100)] = Field(default=4.0, description="highest frequency, hertz")


SHAKE = "under time: a hand that is not still: degrees and mm at most, nothing faster than hertz"


class Aimed(Frozen):
    """Base of the kinds of still viewpoints."""

    target: Annotated[
        Annotated[Literal["center", "follow"], Tag("text")] | Annotated[Point, Tag("list")], Discriminator(shape_of)
    ] = Field(
        default="center",
        description="target of the camera: the centre of the model's box, or a point [x, y, z] in metres. For an animated"
        " model, center is the first frame's; follow moves with the model",
    )
    bins: Bins = 45.0
    shake: Shake | None = Field(default=None, description=SHAKE)

    @field_validator("target", mode="before")
    @classmethod
    def _target(cls, value: Any) -> Any:
        if value not in ("center", "follow") and not (isinstance(value, (list, tuple)) and len(value) == 3):
            raise ValueError(f"expected center, follow or [x, y, z]; found {value!r}")
        return value
