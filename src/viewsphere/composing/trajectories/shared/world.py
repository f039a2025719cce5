"""The input of a trajectory, and its result."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from viewsphere.model.place import Lane
from viewsphere.model.scene import Vector
from viewsphere.model.sensors.camera import Intrinsics

Float = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RigPose:
    """The rig at an instant.
    `world_from_rig` (4, 4): OpenCV axes of its first sensor, metres.
    `focus`: its target point, world metres.
    `intrinsics`: its lens, where the rig zooms.
    """

    world_from_rig: Float
    focus: Vector
    intrinsics: Intrinsics | None = None


@dataclass(frozen=True, eq=False)
class World:
    """The known facts of a sequence when its cameras are placed.

    `center` gives the middle (3,) of a thing, by its number or its model's key, at an instant, counted from 0.
    It raises RecipeError for an absent thing. `target` is the default target point of cameras.
    `rng` gives the generator of a purpose, seeded by the sequence's names. `lanes` are the place's, in world axes.
    """

    fps: float
    target: Vector
    center: Callable[[int | str, int], Float]
    rng: Callable[[str], np.random.Generator]
    lanes: tuple[Lane, ...] = ()


class Trajectory(Protocol):
    """A motion of the rig. Equal times and worlds give equal poses, to the last bit."""

    def poses(self, times: Float, world: World) -> tuple[RigPose, ...]:
        """The rig at all instants of a sequence, whose times (T,) in seconds ascend from 0. Raises RecipeError if the world
        lacks the trajectory's inputs, or if the rig would look at its own position.
        """
        ...

    @property
    def digest(self) -> str:
        """SHA-256 of the trajectory's file; empty without one."""
        ...

    @property
    def intrinsics(self) -> Intrinsics | None:
        """The lens of the first pose, if a file names one."""
        ...
