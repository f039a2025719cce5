"""A smooth path through points."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from viewsphere.composing.trajectories._aim import aimed, focuses
from viewsphere.composing.trajectories._world import RigPose, World
from viewsphere.geometry.curve import Curve, spline
from viewsphere.model.camera import Intrinsics
from viewsphere.recipe.trajectories import SplinePath

Float = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Spline:
    """Along the curve at an even speed, or, between two points with times, at the speed that they ask for."""

    entry: SplinePath
    digest: str = ""
    intrinsics: Intrinsics | None = None

    @cached_property
    def curve(self) -> Curve:
        """The path."""
        return spline(self.entry.points, self.entry.closed)

    def poses(self, times: Float, world: World) -> tuple[RigPose, ...]:
        """As `Trajectory.poses`."""
        lengths = self._lengths(times)
        focus = focuses(self.entry, self.entry.look, times, world)
        return aimed(self.curve.at(lengths), self.curve.direction(lengths), focus, world)

    def _lengths(self, times: Float) -> Float:
        """Metres along the path at these times."""
        entry = self.entry
        if entry.times is not None:
            return np.interp(times, np.array(entry.times), self.curve.knots)
        if entry.speed is not None:
            return entry.speed * times
        whole = float(times[-1] - times[0])
        return self.curve.length * (times - times[0]) / whole if whole else np.zeros(len(times))


def trajectory(entry: SplinePath, folder: Path) -> Spline:
    """The motion that an entry of a recipe means."""
    return Spline(entry)
