"""The start of a motion, and the poses that a motion gives."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from viewsphere.assets.animation.clip import Timeline
from viewsphere.composing.placing import Draws
from viewsphere.errors import RecipeError
from viewsphere.geometry.curve import Curve, spline
from viewsphere.geometry.rotation import compose, rigid
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.place import Lane
from viewsphere.model.scene import Matrix4, Vector
from viewsphere.model.thing import TimeStep

Heading = Literal["keep", "level", "along"]
"""keep: unchanged; level: turned about the vertical only, upright; along: also tilted uphill and downhill."""

_LEVEL = 1e-9
"""Length of a unit vector's horizontal part below which the vector counts as vertical, without an azimuth."""

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


def curve_through(points: Sequence[Vector], closed: bool, field: str) -> Curve:
    """The smooth curve through points, metres; raises RecipeError, beginning with `field`, for too few or coinciding points."""
    try:
        return spline(points, closed)
    except ValueError as error:
        raise RecipeError(f"{field}: {error}") from None


def headed(pose: Pose, direction: ArrayLike, heading: Heading) -> Pose:
    """Return the pose with its front (-Y) turned to a unit vector (3,) of the world. A vertical vector leaves it unchanged."""
    x, y, z = np.asarray(direction, np.float64).tolist()
    level = math.hypot(x, y)
    if heading == "keep" or level < _LEVEL:
        return pose
    run, rise = (level, z) if heading == "along" else (1.0, 0.0)
    c, s = x / level, y / level
    left, back, up = (-s, c, 0.0), (-c * run, -s * run, -rise), (-c * rise, -s * rise, run)
    return pose.facing(np.array([left, back, up]).T)


def to_the_right(direction: ArrayLike) -> Float:
    """The level unit vector (3,) to the right of a direction (3,), seen from above; zero if it is vertical."""
    x, y, _ = np.asarray(direction, np.float64).tolist()
    level = math.hypot(x, y)
    return np.zeros(3) if level < _LEVEL else np.array([y / level, -x / level, 0.0])
