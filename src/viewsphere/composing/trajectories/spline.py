"""A smooth path through points."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from viewsphere.composing.trajectories.shared.aim import aimed, focuses
from viewsphere.composing.trajectories.shared.world import RigPose, World
from viewsphere.geometry.curve import Curve, spline
from viewsphere.model.fields.numbers import Number, Positive
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.plugins.trajectory import TrajectorySpec
from viewsphere.recipe.cameras.trajectories import LOOK, MOST_POINTS, Look, Moving, Place
from viewsphere.validation.errors import shown

Float = NDArray[np.float64]


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


@dataclass(frozen=True, eq=False)
class _Spline:
    """Motion along the curve at constant speed or, between two points with times, at the speed that these determine."""

    entry: SplinePath
    digest: str = ""
    intrinsics: Intrinsics | None = None

    @cached_property
    def curve(self) -> Curve:
        """The path."""
        return spline(self.entry.points, self.entry.closed)

    def poses(self, times: Float, world: World) -> tuple[RigPose, ...]:
        """See `Trajectory.poses`."""
        lengths = self._lengths(times)
        focus = focuses(self.entry, self.entry.look, times, world)
        return aimed(self.curve.points_at(lengths), self.curve.direction(lengths), focus, world)

    def _lengths(self, times: Float) -> Float:
        """Metres along the path at these times."""
        entry = self.entry
        if entry.times is not None:
            return np.interp(times, np.array(entry.times), self.curve.knots)
        if entry.speed is not None:
            return entry.speed * times
        whole = float(times[-1] - times[0])
        return self.curve.length * (times - times[0]) / whole if whole else np.zeros(len(times))


def _trajectory(entry: SplinePath, folder: Path) -> _Spline:
    """The motion that an entry of a recipe means."""
    return _Spline(entry)


TRAJECTORY = TrajectorySpec(options=SplinePath, trajectory=_trajectory)
