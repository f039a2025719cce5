"""What things cover of the floor, and how they stand on it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.hull import convex_hull
from viewsphere.geometry.rotation import transform
from viewsphere.model.scene import Matrix4

Float = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Footprint:
    """An oriented rectangle on the floor: centre (2,), unit axes as rows (2, 2), half sizes (2,); metres."""

    center: Float
    axes: Float
    half: Float

    def apart(self, other: Footprint, gap: float) -> bool:
        """Whether a side of one of the two separates them by at least `gap`: then nothing of them is nearer than that."""
        between = other.center - self.center
        for axis in (*self.axes, *other.axes):
            reach = sum(float(np.abs(f.axes @ axis) @ f.half) for f in (self, other))
            if abs(float(between @ axis)) - reach >= gap - 1e-9:
                return True
        return False

    def contains(self, other: Footprint | Outline) -> bool:
        """Whether all of the other lies in this one."""
        return bool((np.abs((other.corners - self.center) @ self.axes.T) <= self.half + 1e-9).all())

    @property
    def corners(self) -> Float:
        """The four corners, (4, 2)."""
        a, b = self.axes * self.half[:, None]
        return self.center + np.array([a + b, a - b, -a - b, b - a])


@dataclass(frozen=True, eq=False)
class Outline:
    """A convex polygon on the floor: its corners (N, 2), counter-clockwise; metres."""

    corners: Float

    def apart(self, other: Outline, gap: float) -> bool:
        """Whether a side of one of the two separates them by at least `gap`: then nothing of them is nearer than that."""
        for polygon in (self.corners, other.corners):
            sides = np.roll(polygon, -1, axis=0) - polygon
            axes = sides[:, ::-1] * (1, -1) / np.maximum(np.linalg.norm(sides, axis=1, keepdims=True), 1e-12)
            a, b = self.corners @ axes.T, other.corners @ axes.T
            between = np.maximum(a.min(axis=0) - b.max(axis=0), b.min(axis=0) - a.max(axis=0))
            if between.max() >= gap - 1e-9:
                return True
        return False


def outline(points: Float, world_from_object: Matrix4) -> Outline:
    """What points (N, 3) of a model, in its own axes, cover of the floor together, as seen from above."""
    return Outline(convex_hull(transform(np.array(world_from_object), points)[:, :2]))


def footprint(box: Float, world_from_object: Matrix4) -> Footprint:
    """What a model with this box (8, 3), in its own axes, covers of the floor where it stands upright."""
    m = np.array(world_from_object)
    low, high = box[2, :2], box[4, :2]
    return Footprint(m[:2, :2] @ ((low + high) / 2) + m[:2, 3], m[:2, :2].T, (high - low) / 2)


def standing(box: Float, x: float = 0.0, y: float = 0.0, azimuth_deg: float = 0.0) -> Matrix4:
    """World from object for a model with this box (8, 3) that stands on the floor, its origin above (x, y), metres.

    Its front faces the azimuth: where a camera of that azimuth stands.
    """
    quarters, rest = divmod(azimuth_deg, 90.0)
    c, s = math.cos(math.radians(azimuth_deg)), math.sin(math.radians(azimuth_deg))
    if rest == 0:  # exact
        c, s = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[int(quarters) % 4]
    return ((c, 0.0 - s, 0.0, x), (s, c, 0.0, y), (0.0, 0.0, 1.0, 0.0 - float(box[2, 2])), (0.0, 0.0, 0.0, 1.0))
