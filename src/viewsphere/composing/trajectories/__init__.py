"""Motions of the rig over time: one file a kind, named as in recipes; none imports another.

A trajectory computes all instants of a sequence at once, so that the division into shots does not change it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from viewsphere import plugins
from viewsphere.composing.noise import noise
from viewsphere.composing.trajectories.shared.aim import DIGITS, aimed, around, focuses
from viewsphere.composing.trajectories.shared.world import RigPose, Trajectory, World
from viewsphere.composing.viewpoints.camera import looking
from viewsphere.geometry.rotation import compose, rigid, rotation_about
from viewsphere.model.instant import Instant, Viewpoint, viewpoint_of
from viewsphere.model.scene import IDENTITY, Vector
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.plugins.trajectory import TrajectorySpec
from viewsphere.recipe.cameras.aim import Shake
from viewsphere.recipe.cameras.viewpoints import Grid, Jitter, Normal, Sphere, Viewpoints

Float = NDArray[np.float64]

__all__ = [
    "RigPose",
    "Trajectory",
    "World",
    "aimed",
    "around",
    "focuses",
    "instant",
    "is_still",
    "shaken",
    "standing",
    "trajectory",
]


def is_still(viewpoints: Viewpoints) -> bool:
    """Return whether each viewpoint is a still camera for a sequence; otherwise all are one motion."""
    return isinstance(viewpoints, (Grid, Jitter, Sphere, Normal))


def trajectory(viewpoints: Viewpoints, folder: Path) -> Trajectory:
    """The motion of a recipe's viewpoints, with shake if requested; paths are relative to `folder`, the recipe's.

    Raises RecipeError for a file that cannot be read, ValueError for viewpoints that stay still.
    """
    if is_still(viewpoints):
        raise ValueError(f"trajectory: expected viewpoints that move, got {cast(Any, viewpoints).kind}")
    spec = plugins.load(TrajectorySpec, cast(Any, viewpoints).kind)
    steady: Trajectory = spec.trajectory(viewpoints, folder)
    return _Handheld(steady, viewpoints.shake) if viewpoints.shake else steady


def standing(viewpoint: Viewpoint, focus: Vector) -> RigPose:
    """The rig at a still viewpoint, before shaking; it looks at `focus` unless the viewpoint has its own target."""
    now = looking(viewpoint, focus, index=0)
    return RigPose(np.array(now.world_from_rig), now.focus)


def instant(pose: RigPose, index: int, seconds: float, view: int, bins: float, **more: Any) -> Instant:
    """The instant of a sequence with this rig pose; `view` is the number of its viewpoint, whose categories are `bins` degrees
    wide. `more` are further fields of the instant.
    """
    a, b, c = ((x, y, z, w) for x, y, z, w in pose.world_from_rig[:3].tolist())
    viewpoint = viewpoint_of(pose.world_from_rig, pose.focus, view, bins).rounded()
    seen = {"focus": pose.focus, "viewpoint": viewpoint, "intrinsics": pose.intrinsics}
    return Instant(index=index, world_from_rig=(a, b, c, IDENTITY[3]), seconds=seconds, **seen, **more)


def shaken(poses: Sequence[RigPose], shake: Shake, times: Float, world: World) -> tuple[RigPose, ...]:
    """The poses, turned about and moved along their own axes by smooth noise seeded by the sequence's names."""
    return tuple(_shaken(poses, shake, times, world))


def _shaken(poses: Sequence[RigPose], shake: Shake, times: Float, world: World) -> Iterator[RigPose]:
    hand = noise(world.rng("shake"), 6, shake.hertz)
    for pose, seconds in zip(poses, times.tolist(), strict=True):
        off = hand.values_at(seconds)
        by = rigid(rotation_about(math.radians(shake.degrees) * off[:3]), shake.mm / 1000 * off[3:])
        yield RigPose(np.round(compose(pose.world_from_rig, by), DIGITS) + 0.0, pose.focus, pose.intrinsics)


@dataclass(frozen=True, eq=False)
class _Handheld:
    """A trajectory with shake."""

    steady: Trajectory
    shake: Shake

    @property
    def digest(self) -> str:
        """The value of the unshaken trajectory."""
        return self.steady.digest

    @property
    def intrinsics(self) -> Intrinsics | None:
        """The value of the unshaken trajectory."""
        return self.steady.intrinsics

    def poses(self, times: Float, world: World) -> tuple[RigPose, ...]:
        """See `Trajectory.poses`."""
        return shaken(self.steady.poses(times, world), self.shake, times, world)
