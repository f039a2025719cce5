"""The floor area that things cover, and their upright poses on the floor."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.hull import convex_hull
from viewsphere.geometry.rotation import transform
from viewsphere.model.scene import Matrix4

Float = NDArray[np.float64]


FAR = 2.000001  # a little above 2, as radii are rounded
"""Factor for rectangles: if the distance of two centres is sqrt(2) times the sum of both radii and a gap, a side separates the
rectangles by the gap, because one side of a rectangle is within 45 degrees of every direction.
"""


class _Circle(NamedTuple):
    """The middle of a cover, metres; radii of a circle around it and of one within it.

    Two covers are apart by a gap if the distance of their middles is `spread` times the sum of the outer radii and the gap.
    """

    x: float
    y: float
    outer: float
    inner: float
    spread: float


@dataclass(frozen=True)
class _Sides:
    """A footprint as plain numbers, which compare six times as fast as arrays: centre, radius of the circle around it, axes,
    half sizes.
    """

    x: float
    y: float
    radius: float
    axes: tuple[tuple[float, float], tuple[float, float]]
    half: tuple[float, float]


@dataclass(frozen=True, eq=False)
class Footprint:
    """An oriented rectangle on the floor: centre (2,), unit axes as rows (2, 2), half sizes (2,); metres."""

    center: Float
    axes: Float
    half: Float

    def apart(self, other: Footprint, gap: float) -> bool:
        """Return whether a side of one footprint separates the two by at least `gap`."""
        one, two = self.sides, other.sides
        (dx, dy), reach = (two.x - one.x, two.y - one.y), one.radius + two.radius + gap
        if dx * dx + dy * dy >= FAR * reach * reach:
            return True
        for ux, uy in (*one.axes, *two.axes):
            extent = 0.0
            for print_ in (one, two):
                (ax, ay), (bx, by) = print_.axes
                extent += abs(ax * ux + ay * uy) * print_.half[0] + abs(bx * ux + by * uy) * print_.half[1]
            if abs(dx * ux + dy * uy) - extent >= gap - 1e-9:
                return True
        return False

    @cached_property
    def sides(self) -> _Sides:
        """Its sides, as numbers that are quick to compare."""
        (ax, ay), (bx, by) = self.axes.tolist()
        (x, y), (h, k) = self.center.tolist(), self.half.tolist()
        return _Sides(x, y, math.hypot(h, k), ((ax, ay), (bx, by)), (h, k))

    @cached_property
    def circle(self) -> _Circle:
        """The circles around and within it."""
        return _Circle(self.sides.x, self.sides.y, self.sides.radius, min(self.sides.half), math.sqrt(FAR))

    def contains(self, other: Footprint | Outline) -> bool:
        """Return whether the other footprint is entirely inside this one."""
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
        """Return whether a side of one outline separates the two by at least `gap`; then no parts of them are nearer."""
        for polygon in (self, other):
            a, b = self.corners @ polygon.axes.T, other.corners @ polygon.axes.T
            between = np.maximum(a.min(axis=0) - b.max(axis=0), b.min(axis=0) - a.max(axis=0))
            if between.max() >= gap - 1e-9:
                return True
        return False

    @cached_property
    def axes(self) -> Float:
        """The unit normals (N, 2) of its sides, outward; zero for a point."""
        sides = np.roll(self.corners, -1, axis=0) - self.corners
        return sides[:, ::-1] * (1, -1) / np.maximum(np.linalg.norm(sides, axis=1, keepdims=True), 1e-12)

    @cached_property
    def circle(self) -> _Circle:
        """The circles around and within it. The widest angle between two sides limits the angle from any direction to the
        nearest normal to half of it.
        """
        middle = self.corners.mean(axis=0)
        outer = float(np.linalg.norm(self.corners - middle, axis=1).max())
        inner = float(((self.corners - middle) * self.axes).sum(axis=1).min())
        angles = np.sort(np.arctan2(self.axes[:, 1], self.axes[:, 0]) % math.pi)
        widest = float(np.diff(angles, append=angles[0] + math.pi).max())
        x, y = middle.tolist()
        return _Circle(x, y, outer, max(inner, 0.0), (1 + 1e-6) / max(math.cos(widest / 2), 1e-9))


def first_crowded(prints: Sequence[Footprint], gap: float, start: int = 0) -> tuple[int, int] | None:
    """The first pair that is not `apart` by a gap: (i, j), j < i, start <= i, with the smallest i and then j; None if all are
    apart.

    A sweep along the longer axis of all: only those whose circles meet along it are compared.
    """
    if len(prints) < 2:
        return None
    x, y, radius = np.array([(p.sides.x, p.sides.y, p.sides.radius) for p in prints]).T
    along = x if np.ptp(x) >= np.ptp(y) else y
    reach = math.sqrt(FAR) * (radius + gap / 2)
    order = np.argsort(along - reach, kind="stable")
    ends = np.searchsorted((along - reach)[order], (along + reach)[order], side="right")
    pairs: list[tuple[int, int]] = []
    for place, (i, end) in enumerate(zip(order.tolist(), ends.tolist(), strict=True)):
        others = order[place + 1 : end]
        near = others[np.hypot(x[others] - x[i], y[others] - y[i]) <= reach[others] + reach[i]].tolist()
        pairs += [(max(i, j), min(i, j)) for j in near if max(i, j) >= start and not prints[i].apart(prints[j], gap)]
    return min(pairs, default=None)


def outline(points: Float, world_from_object: Matrix4) -> Outline:
    """Return the floor area that points (N, 3) of a model, in its own axes, cover together, as seen from above."""
    return Outline(convex_hull(transform(np.array(world_from_object), points)[:, :2]))


def footprint(box: Float, world_from_object: Matrix4) -> Footprint:
    """Return the floor area of an upright model with this box (8, 3), in the model's own axes."""
    m = np.array(world_from_object)
    low, high = box[2, :2], box[4, :2]
    return Footprint(m[:2, :2] @ ((low + high) / 2) + m[:2, 3], m[:2, :2].T, (high - low) / 2)


def standing(box: Float, x: float = 0.0, y: float = 0.0, azimuth_deg: float = 0.0) -> Matrix4:
    """World from object for a model with this box (8, 3) that stands on the floor, its origin above (x, y), metres.

    Its front faces a camera at this azimuth.
    """
    quarters, rest = divmod(azimuth_deg, 90.0)
    c, s = math.cos(math.radians(azimuth_deg)), math.sin(math.radians(azimuth_deg))
    if rest == 0:  # exact
        c, s = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[int(quarters) % 4]
    return ((c, 0.0 - s, 0.0, x), (s, c, 0.0, y), (0.0, 0.0, 1.0, 0.0 - float(box[2, 2])), (0.0, 0.0, 0.0, 1.0))
