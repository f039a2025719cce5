"""The start of a motion, and the poses that a motion gives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from viewsphere.assets.animation.clip import Timeline
from viewsphere.composing.placing import Draws
from viewsphere.geometry.rotation import compose, rigid
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.place import Lane
from viewsphere.model.scene import Matrix4
from viewsphere.model.thing import TimeStep

Float = NDArray[np.float64]

Origin = Literal["placed", "world"]
"""Origin of positions: the thing's place, or the world's origin."""


@dataclass(frozen=True, eq=False)
class Pose:
    """The pose of a thing, world from object (4, 4), rigid, metres, with the time step of its file; None is the rest pose."""

    matrix: Float
    step: TimeStep | None = None

    def moved(self, by: ArrayLike) -> Pose:
        """Moved by a vector (3,), world axes."""
        return replace(self, matrix=rigid(self.matrix[:3, :3], self.matrix[:3, 3] + np.asarray(by, np.float64)))

    def turned(self, rotation: ArrayLike) -> Pose:
        """Turned by a rotation (3, 3) about its own axes and its own origin."""
        return replace(self, matrix=compose(self.matrix, rigid(rotation, (0.0, 0.0, 0.0))))

    def put(self, at: ArrayLike) -> Pose:
        """Put at a point (3,) of the world: as high above the point as the thing was above z = 0."""
        x, y, z = np.asarray(at, np.float64)
        return replace(self, matrix=rigid(self.matrix[:3, :3], (x, y, z + self.matrix[2, 3])))

    def facing(self, rotation: ArrayLike) -> Pose:
        """Turned to a rotation (3, 3), world from object, about its origin, which does not move."""
        return replace(self, matrix=rigid(rotation, self.matrix[:3, 3]))


@dataclass(frozen=True, eq=False)
class Start:
    """The start of a motion.

    placed: world from object as the thing's placer put it.
    seconds: length of the sequence.
    rng: a generator for the values drawn for these names.
    lanes: lanes of the place, world axes.
    timeline: frames of the model's file while its clip plays, None if the file has none.
    field: the recipe's field, with which messages begin.
    way: the thing's pose on the path to its place, at a time in seconds from the path's start; None if it has no path.
    """

    placed: Matrix4
    spec: ModelSpec
    seconds: float
    rng: Draws
    lanes: tuple[Lane, ...] = ()
    timeline: Timeline | None = None
    field: str = "models[0].motion"
    way: Callable[[float], Matrix4] | None = None

    def playing(self, timeline: Timeline | None, field: str) -> Start:
        """The start for a thing whose file has this timeline, and whose motion is in this field of the recipe."""
        return replace(self, timeline=timeline, field=field)


Move = Callable[[float, Pose], Pose | None]
"""Returns the pose at a time, seconds from the sequence's first instant, given the thing's pose without this motion; None while
the thing is absent. Called for any times in any order.
"""
