"""Falling bodies, and the boards they fall on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import MissingExtraError

Float = NDArray[np.float64]

FLAT = 0.01
"""Thickness given to flat models, as a share of their length: a body without a volume cannot collide."""


@dataclass(frozen=True)
class Touch:
    """The contact behaviour of a body: its coefficient of sliding friction, and the share of its speed left after a bounce."""

    friction: float = 0.8
    restitution: float = 0.0

    @property
    def damping_ratio(self) -> float:
        """The damping ratio of a spring that returns this share of the speed after half a swing."""
        if self.restitution == 0:
            return 1.0
        log = math.log(self.restitution)
        return -log / math.hypot(math.pi, log)


@dataclass(frozen=True, eq=False)
class Body:
    """Convex parts that move as one: of each, corners (N, 3) and triangles (M, 3) in the body's axes, metres; its mass, kg."""

    parts: tuple[tuple[Float, NDArray[np.int32]], ...]
    mass: float
    touch: Touch = Touch()

    @property
    def corners(self) -> Float:
        """Corners of all parts, (N, 3)."""
        return np.concatenate([corners for corners, _ in self.parts])

    @property
    def volumes(self) -> Float:
        """Volume of each part, cubic metres."""
        return np.array([_volume(corners, triangles) for corners, triangles in self.parts])


@dataclass(frozen=True)
class Board:
    """A fixed box: its middle and half sizes, metres, and its turn about the vertical, radians. A board with `is_fence` keeps
    bodies inside while they fall, and is removed when they have come to rest.
    """

    center: tuple[float, float, float]
    half: tuple[float, float, float]
    turn: float = 0.0
    is_fence: bool = False


def body_of(parts: Sequence[Float], density: float, mass: float | None = None, touch: Touch | None = None) -> Body:
    """A body whose parts are the convex hulls of these points (N, 3), metres: of this mass, kg, or of this density, kg a cubic
    metre. Raises MissingExtraError without scipy.
    """
    hulls = tuple(map(_hull, parts))
    volume = float(sum(_volume(*hull) for hull in hulls))
    return Body(hulls, density * volume if mass is None else mass, touch or Touch())


def _hull(points: Float) -> tuple[Float, NDArray[np.int32]]:
    """Corners of the convex hull, and triangles that are counter-clockwise seen from outside."""
    scipy: Any = needed("scipy.spatial")
    points = np.unique(points, axis=0)
    try:
        hull = scipy.ConvexHull(points)
    except scipy.QhullError:
        hull = scipy.ConvexHull(points := _thickened(points))
    place = np.full(len(points), -1, np.int32)
    place[hull.vertices] = np.arange(len(hull.vertices))
    a, b, c = (points[hull.simplices[:, i]] for i in range(3))
    inwards = (np.cross(b - a, c - a) * hull.equations[:, :3]).sum(axis=1) < 0
    simplices = np.where(inwards[:, None], hull.simplices[:, ::-1], hull.simplices)
    return points[hull.vertices], place[simplices]


def _thickened(points: Float) -> Float:
    """The points, each repeated with small offsets to all sides."""
    by = FLAT / 2 * float(np.ptp(points, axis=0).max() or 1.0)
    return np.concatenate([points + by * side for axis in np.eye(3) for side in (axis, -axis)])


def _volume(corners: Float, triangles: NDArray[np.int32]) -> float:
    a, b, c = (corners[triangles[:, i]] - corners.mean(axis=0) for i in range(3))
    return float((np.cross(a, b) * c).sum() / 6)


def needed(package: str) -> Any:
    """A package of the extra physics; raises MissingExtraError if it is not installed."""
    import importlib

    try:
        return importlib.import_module(package)
    except ImportError:
        raise MissingExtraError(
            f"physics: expected the package {package.partition('.')[0]}, found none: pip install 'viewsphere[physics]'"
        ) from None
