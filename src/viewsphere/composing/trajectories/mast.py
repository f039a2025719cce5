"""A rig on a mast, or straight overhead."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from viewsphere.composing.trajectories._aim import aimed, focuses, overhead, posed
from viewsphere.composing.trajectories._world import RigPose, World
from viewsphere.model.camera import Intrinsics
from viewsphere.recipe.trajectories import MastPost

Float = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Mast:
    """It stands, and turns with what it looks at; overhead it goes with that."""

    entry: MastPost
    digest: str = ""
    intrinsics: Intrinsics | None = None

    def poses(self, times: Float, world: World) -> tuple[RigPose, ...]:
        """As `Trajectory.poses`."""
        entry = self.entry
        focus = focuses(entry, entry.look, times, world)
        assert focus is not None
        if entry.position is not None:
            places = np.tile(np.array(entry.position, np.float64), (len(times), 1))
            return aimed(places, places, focus, world)
        axes, above = overhead(entry.heading), np.array([0.0, 0.0, entry.overhead])
        return tuple(posed(axes, point + above, point) for point in focus)


def trajectory(entry: MastPost, folder: Path) -> Mast:
    """The motion that an entry of a recipe means."""
    return Mast(entry)
