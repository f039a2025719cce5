"""A rig on a mast, or straight overhead."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from viewsphere.composing.trajectories.shared.aim import aimed, focuses, overhead, posed
from viewsphere.composing.trajectories.shared.world import RigPose, World
from viewsphere.model.fields.numbers import Length, Number
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.plugins.trajectory import TrajectorySpec
from viewsphere.recipe.cameras.trajectories import LOOK, Look, Moving, Place
from viewsphere.validation.errors import shown

Float = NDArray[np.float64]


class MastPost(Moving):
    """A camera on a mast, or straight overhead: it stays in place, and may turn or move with a thing."""

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


@dataclass(frozen=True, eq=False)
class _Mast:
    """A rig that stays in place and turns with its target; overhead, it moves with the target."""

    entry: MastPost
    digest: str = ""
    intrinsics: Intrinsics | None = None

    def poses(self, times: Float, world: World) -> tuple[RigPose, ...]:
        """See `Trajectory.poses`."""
        entry = self.entry
        focus = focuses(entry, entry.look, times, world)
        assert focus is not None
        if entry.position is not None:
            places = np.tile(np.array(entry.position, np.float64), (len(times), 1))
            return aimed(places, places, focus, world)
        axes, above = overhead(entry.heading), np.array([0.0, 0.0, entry.overhead])
        return tuple(posed(axes, point + above, point) for point in focus)


def _trajectory(entry: MastPost, folder: Path) -> _Mast:
    """The motion that an entry of a recipe means."""
    return _Mast(entry)


TRAJECTORY = TrajectorySpec(options=MastPost, trajectory=_trajectory)
