"""Point tracks of a recipe."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag, model_validator

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Count, Natural
from viewsphere.recipe.values import shape_of

MOST_POINTS = 2_000_000
"""Largest number of points that one sensor follows through one sequence."""

At = Annotated[
    Annotated[tuple[Natural, ...], Field(min_length=1), Tag("list")] | Annotated[Literal["each"], Tag("text")],
    Discriminator(
        shape_of, custom_error_type="at", custom_error_message="expected each, or a list of instants, counted from 0"
    ),
]


class TracksEntry(Frozen):
    """Points that are followed through every sequence, by each sensor."""

    grid: Count | None = Field(default=None, description="pixels between points, across the whole picture")
    count: Count | None = Field(default=None, description="number of points drawn at each instant of `at`")
    points: str | None = Field(
        default=None, min_length=1, description="a CSV file of instant, x, y: pixels, the picture's corner is (0, 0)"
    )
    on: Literal["objects", "all"] = Field(
        default="objects", description="for count: draw points on objects, or on all of the picture"
    )
    at: At = Field(default=(0,), description="for grid and count: instants at which points are picked: a list, or each")

    @model_validator(mode="before")
    @classmethod
    def _one(cls, data: Any) -> Any:
        if isinstance(data, dict):
            given = [name for name in ("grid", "count", "points") if data.get(name) is not None]
            if len(given) != 1:
                raise ValueError(f"expected one of grid, count, points; found {' and '.join(given) or 'none'}")
            if given == ["points"] and data.get("at") is not None:
                raise ValueError("expected no at beside points, whose file says when; found one: leave it out")
        return data
