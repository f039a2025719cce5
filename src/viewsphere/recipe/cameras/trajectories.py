"""Fields of viewpoints that are motions of the camera over time; recipes without `time` refuse them.

World axes: metres, z up. Headings are counter-clockwise from above: at 0 the camera looks along +Y, as at azimuth 0.
"""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Discriminator, Field, Tag

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Count, Metres, Number
from viewsphere.recipe.cameras.aim import SHAKE, Bins, Shake
from viewsphere.recipe.values import shape_of

MOST_POINTS = 10_000
"""Limit of points in a path, which protects from files made by mistake."""

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
"""A constant number, or the numbers at the sequence's first and last instant, with linear interpolation."""


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
