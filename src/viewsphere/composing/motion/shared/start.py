"""What a motion starts from, and the poses that it gives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from viewsphere.assets.clip import Timeline
from viewsphere.composing.placing import Draws
from viewsphere.geometry.rotation import compose, rigid
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Matrix4
from viewsphere.model.thing import TimeStep
from viewsphere.zoo.places import Lane

Float = NDArray[np.float64]

Origin = Literal["placed", "world"]
"""What positions count from: where the thing is placed, or the world's origin."""


@dataclass(frozen=True, eq=False)
class Pose:
    """Where a thing is, world from object (4, 4), rigid, metres; and the time step of its file that it shows, None: as it
    rests.
    """

    matrix: Float
    step: TimeStep | None = None

    def moved(self, by: ArrayLike) -> Pose:
        """Moved by a vector (3,), world axes."""
        return replace(self, matrix=rigid(self.matrix[:3, :3], self.matrix[:3, 3] + np.asarray(by, np.float64)))

    def turned(self, rotation: ArrayLike) -> Pose:
        """Turned by a rotation (3, 3) about its own axes, its own origin staying where it is."""
        return replace(self, matrix=compose(self.matrix, rigid(rotation, (0.0, 0.0, 0.0))))

    def put(self, at: ArrayLike) -> Pose:
        """Put at a point (3,) of the world: as high above the point as the thing was above z = 0."""
        x, y, z = np.asarray(at, np.float64)
        return replace(self, matrix=rigid(self.matrix[:3, :3], (x, y, z + self.matrix[2, 3])))

    def facing(self, rotation: ArrayLike) -> Pose:
        """Turned as a rotation (3, 3), world from object, says, its origin staying where it is."""
        return replace(self, matrix=rigid(rotation, self.matrix[:3, 3]))


@dataclass(frozen=True, eq=False)
class Start:
    """What a motion starts from.

    placed: world from object as the thing's placer put it; seconds: length of the sequence; rng: a generator for what is drawn
    for these names; lanes: of the place, world axes; timeline: frames of the model's file while its clip plays, None where it
    has none; field: the recipe's, which messages begin with; way: where it was at a time, seconds from its first, on the way to
    where it is placed, None where it was put there at once.
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
        """The same of a thing whose file has this timeline, and whose motion stands in this field of the recipe."""
        return replace(self, timeline=timeline, field=field)
