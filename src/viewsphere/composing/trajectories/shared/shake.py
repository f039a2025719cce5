"""The shake of a hand-held camera."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from viewsphere.composing.noise import noise
from viewsphere.composing.trajectories.shared.aim import DIGITS
from viewsphere.composing.trajectories.shared.world import RigPose, Trajectory, World
from viewsphere.geometry.rotation import compose, rigid, rotation_about
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.recipe.cameras.aim import Shake

Float = NDArray[np.float64]


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
class Handheld:
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
