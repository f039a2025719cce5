"""Along a lane of the place, as a camera on a car."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.composing.trajectories.shared.aim import aimed, focuses
from viewsphere.composing.trajectories.shared.along import level
from viewsphere.composing.trajectories.shared.world import RigPose, World
from viewsphere.errors import RecipeError
from viewsphere.geometry.curve import Curve, spline
from viewsphere.model.fields.numbers import Length, Metres, Positive
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.plugins.trajectory import TrajectorySpec
from viewsphere.recipe.cameras.trajectories import LOOK, Look, Moving
from viewsphere.validation.errors import one_of

Float = NDArray[np.float64]


class DrivePath(Moving):
    """Along a lane of the place, as a camera on a car."""

    kind: Literal["drive"] = Field(description="along a lane of the place")
    lane: Annotated[str, Field(min_length=1)] | None = Field(default=None, description="its name; default: the place's first")
    speed: Positive = Field(default=10.0, description="metres a second; it stops at the lane's end, or repeats a closed lane")
    height: Length = Field(default=1.5, description="metres above the lane")
    offset: Annotated[Metres, Field(ge=0)] = Field(default=0.0, description="metres along the lane at the first instant")
    side: Metres = Field(default=0.0, description="metres to the right of the lane's middle; below 0 to the left")
    look: Look = Field(default="ahead", description=LOOK)


@dataclass(frozen=True, eq=False)
class _Drive:
    """Motion at constant speed, above the lane's middle or to its side."""

    entry: DrivePath
    digest: str = ""
    intrinsics: Intrinsics | None = None

    def poses(self, times: Float, world: World) -> tuple[RigPose, ...]:
        """See `Trajectory.poses`; raises RecipeError for a place without lanes, an unknown lane, or a start beyond the lane's
        end.
        """
        entry, curve = self.entry, self._lane(world)
        if entry.offset >= curve.length:
            raise RecipeError(
                f"viewpoints.offset: expected less than {curve.length:.4g} m, the lane's length; found {entry.offset:g}"
            )
        lengths = entry.offset + entry.speed * times
        ahead = level(curve, lengths)
        right = np.stack([ahead[:, 1], -ahead[:, 0], np.zeros(len(ahead))], axis=1)
        centers = curve.points_at(lengths) + entry.side * right + np.array([0.0, 0.0, entry.height])
        return aimed(centers, ahead, focuses(entry, entry.look, times, world), world)

    def _lane(self, world: World) -> Curve:
        if not world.lanes:
            raise RecipeError(
                "viewpoints.kind: expected a place with lanes for drive; found none: set scene.place, or take spline"
            )
        lanes = {lane.name: lane for lane in world.lanes}
        name = self.entry.lane or world.lanes[0].name
        if name not in lanes:
            raise RecipeError(f"viewpoints.lane: {one_of(name, tuple(lanes))}")
        return spline(lanes[name].points, lanes[name].closed)


def _trajectory(entry: DrivePath, folder: Path) -> _Drive:
    """The motion that an entry of a recipe means."""
    return _Drive(entry)


TRAJECTORY = TrajectorySpec(options=DrivePath, trajectory=_trajectory)
