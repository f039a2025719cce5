"""A LiDAR among the sensors of a recipe's rig."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated

from pydantic import AfterValidator, Field, model_validator

from viewsphere.geometry.lenses import lens_parameters
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Count, Length, Metres, Number, Portion, Positive
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.model.sensors.lidar import Lidar
from viewsphere.validation.errors import shown

MOST_RAYS = 10_000_000
MOST_COLUMNS = 65_535
LONGEST = 1e12
"""Largest number of columns that a message writes out in digits."""
WHOLE = 1e-6
"""Largest deviation of the number of columns from a whole number."""

Angle = Annotated[Number, Field(ge=-90, le=90)]
Turn = Annotated[Number, Field(ge=-360, le=360)]


def _rising(value: tuple[float, float]) -> tuple[float, float]:
    if value[0] >= value[1]:
        raise ValueError(f"expected [low, high]; found {shown(value)}")
    return value


def _ascending(value: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
    if any(before[0] >= after[0] for before, after in pairwise(value)):
        raise ValueError(f"expected pairs whose first numbers ascend; found {shown(value)}")
    return value


CurveField = Annotated[
    tuple[tuple[Annotated[Number, Field(ge=0)], Portion], ...], Field(min_length=1), AfterValidator(_ascending)
]


class LidarEntry(Frozen):
    """The rays of a LiDAR, and its measurement along them; angles in its axes: x ahead, y left, z up."""

    rings: Count | None = Field(default=None, description="number of rings, spread evenly over `elevation`")
    elevation: Annotated[tuple[Angle, Angle], AfterValidator(_rising)] | None = Field(
        default=None, description="[low, high]: elevation of the lowest and the highest ring, degrees"
    )
    elevations: Annotated[tuple[Angle, ...], Field(min_length=1)] | None = Field(
        default=None, description="instead of both: the elevation of each ring, degrees"
    )
    azimuth: Annotated[tuple[Turn, Turn], AfterValidator(_rising)] = Field(
        default=(-180.0, 180.0), description="[low, high] in degrees, to the left; columns go from high to low, clockwise"
    )
    azimuth_step: Positive = Field(default=0.2, description="width of each column in degrees; rays are in its middle")
    range: Annotated[tuple[Annotated[Metres, Field(ge=0)], Length], AfterValidator(_rising)] = Field(
        default=(0.5, 120.0), description="[least, most] in metres: nearer and farther points do not return"
    )
    reference_range: Positive | None = Field(
        default=10.0,
        description="distance in metres at which a white surface seen straight on has intensity 1; null: intensity does "
        "not depend on the range",
    )
    sigma: Annotated[Metres, Field(ge=0)] = Field(default=0.0, description="standard deviation of measured ranges, metres")
    dropout: Portion = Field(default=0.0, description="probability that a point does not return")
    dropout_by_range: CurveField | None = Field(
        default=None, description="additional probability by range: [[metres, probability], ...], linear in between"
    )
    dropout_by_intensity: CurveField | None = Field(
        default=None, description="additional probability by intensity: [[intensity, probability], ...], linear in between"
    )

    sweep: Annotated[Number, Field(ge=0)] = Field(
        default=0.0,
        description="seconds to measure the columns one after another, with the instant in the middle; at most the time "
        "between two instants; 0: all at once",
    )

    @model_validator(mode="after")
    def _one_set_of_rings(self) -> LidarEntry:
        if self.elevations is not None:
            if self.rings is not None or self.elevation is not None:
                raise ValueError("expected rings and elevation, or elevations; found both")
            if len(set(self.elevations)) < len(self.elevations):
                raise ValueError("elevations: one of them is listed twice: remove it")
        elif self.rings is None or self.elevation is None:
            raise ValueError("expected rings and elevation ([low, high] in degrees), or elevations; found neither")
        return self

    @model_validator(mode="after")
    def _not_too_many(self) -> LidarEntry:
        low, high = self.azimuth
        if high - low > 360:
            raise ValueError(f"azimuth: expected at most a whole turn, 360 degrees; found {high - low:g}")
        columns = (high - low) / self.azimuth_step
        rings = len(self.elevations) if self.elevations is not None else self.rings or 0
        if rings * columns > MOST_RAYS or columns > MOST_COLUMNS + WHOLE:
            found = f"{columns:,.0f}" if columns < LONGEST else f"{columns:.3g}"
            raise ValueError(
                f"expected at most {MOST_RAYS:,} rays and {MOST_COLUMNS:,} columns; found {rings:,} rings of {found} "
                "columns: take fewer rings, or a larger azimuth_step"
            )
        if columns < 1 - WHOLE or abs(columns - round(columns)) > WHOLE:
            raise ValueError(
                f"expected azimuth_step to divide azimuth; found {self.azimuth_step:g} for {high - low:g} degrees, "
                f"{columns:.6g} columns"
            )
        return self

    @property
    def intrinsics(self) -> Intrinsics:
        """The rays, as a lens: a row for each ring from the highest, a column for each azimuth from the left."""
        rings, width = self._rings, round((self.azimuth[1] - self.azimuth[0]) / self.azimuth_step)
        scan = lens_parameters("scan", elevations_deg=rings, turn_deg=-sum(self.azimuth) / 2 + 0.0)
        across = math.radians(self.azimuth[1] - self.azimuth[0])
        return Intrinsics(width=width, height=len(rings), fx=width / across, fy=1, cx=width / 2, cy=0, distortion=scan)

    @property
    def _rings(self) -> tuple[float, ...]:
        """Elevations, highest first."""
        if self.elevations is not None:
            return tuple(sorted(self.elevations, reverse=True))
        assert self.rings is not None and self.elevation is not None
        low, high = self.elevation
        if self.rings == 1:
            return ((low + high) / 2,)
        return tuple(high + (low - high) * i / (self.rings - 1) for i in range(self.rings))

    def measuring(self, seed: int) -> Lidar:
        """The measurement settings, with draws seeded by `seed`."""
        return Lidar(
            range=self.range,
            reference_range=self.reference_range,
            sigma=self.sigma,
            dropout=self.dropout,
            dropout_by_range=self.dropout_by_range or (),
            dropout_by_intensity=self.dropout_by_intensity or (),
            sweep=self.sweep,
            seed=seed,
        )
