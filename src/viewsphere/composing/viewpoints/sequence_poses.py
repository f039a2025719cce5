"""The poses of sequences: every viewpoint of a recipe at every instant."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

from viewsphere.composing.trajectories import Trajectory, is_still, trajectory
from viewsphere.composing.viewpoints.poses import Orbit, Poses, RepeatedPoses, poses
from viewsphere.errors import RecipeError
from viewsphere.model.instant import Viewpoint
from viewsphere.model.scene import Vector
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.recipe.cameras.aim import Fill, FillBetween
from viewsphere.recipe.cameras.sequence import TimeEntry
from viewsphere.recipe.cameras.viewpoints import Viewpoints


@dataclass(frozen=True)
class SequencePoses(RepeatedPoses):
    """Poses that are still at all instants of a sequence; the pose is the outer loop, the instant the inner one."""

    instants: int

    @property
    def digest(self) -> str:
        """SHA-256 of the number of instants, and of the digest of the poses."""
        return hashlib.sha256(repr((self.base.digest, self.instants)).encode()).hexdigest()

    @property
    def counts(self) -> dict[str, int]:
        """The counts of the poses, then the number of instants."""
        return {**self.base.counts, "instants": self.instants}

    def base_number(self, index: int) -> int:
        """The number of the sequence's pose, which is the number of the sequence within its subject."""
        return index // self.instants

    def name(self, index: int) -> str:
        """The names of the pose and the instant."""
        return f"{self.place(index)} at instant {index % self.instants}"

    def _pose(self, index: int) -> Viewpoint:
        return self.base[self.base_number(index)].model_copy(update={"index": index})


@dataclass(frozen=True)
class TrajectoryPoses(Poses):
    """One motion of the camera; its poses are known only once its world is."""

    trajectory: Trajectory

    @property
    def digest(self) -> str:
        """The digest of the trajectory."""
        return self.trajectory.digest

    @property
    def intrinsics(self) -> Intrinsics | None:
        """The lens that a file of the motion names."""
        return self.trajectory.intrinsics

    @property
    def lowest_elevation(self) -> float:
        """The lowest elevation: unknown."""
        return 90.0

    @property
    def counts(self) -> dict[str, int]:
        """One."""
        return {"trajectories": 1}

    @property
    def are_known(self) -> bool:
        """False: the poses depend on the world."""
        return False

    def target(self, index: int) -> Vector | None:
        """None."""
        return None

    def name(self, index: int) -> str:
        """Return the fixed name of the pose, "trajectory"."""
        return "trajectory"

    def view(self, index: int) -> Orbit:
        """A placeholder orbit, because the poses depend on the world."""
        return Orbit(0.0, 0.0, 1.0, 0.0)

    def drawn_for(self, name: str) -> TrajectoryPoses:
        """The same poses: random values are drawn for each sequence."""
        return self


def poses_of(viewpoints: Viewpoints, time: TimeEntry | None, seed: int, folder: Path = Path()) -> Poses:
    """The poses of a recipe's viewpoints; with a time, those of its sequences. `seed` and `folder` are the recipe's.

    Raises RecipeError for files that cannot be read, and for viewpoints that move without a time.
    """
    if time is not None and isinstance(getattr(viewpoints, "distance", None), Fill | FillBetween):
        raise RecipeError(
            "viewpoints.distance: expected metres beside time, as what moves fills another share of every picture; found fill"
        )
    if time is None:
        if viewpoints.shake is not None:
            raise RecipeError("viewpoints.shake: expected time beside it: still pictures are not shaken; found none: set it")
        return poses(viewpoints, seed, folder)
    if is_still(viewpoints):
        base = poses(viewpoints, seed, folder)
    else:
        base = TrajectoryPoses(viewpoints, seed, trajectory(viewpoints, folder))
    return SequencePoses(viewpoints, seed, base, time.count)
