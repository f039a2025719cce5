"""Triangulation of polygons."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from viewsphere.assets.primitive import Float, Int
from viewsphere.assets.readers.shared.transform import unit


def triangulate(positions: Float, corners: Int, counts: Int) -> tuple[Int, Int]:
    """Cut polygons into triangles, in order.

    `corners` are the vertices of all polygons one after another, and `counts` (at least 3) their number per polygon. Returns
    the triangles (T, 3) as indices into `corners`, n - 2 for each polygon, and the polygon of each (T,). A polygon is cut as a
    fan; a quadrilateral whose fan would fold is cut along its other diagonal, and a larger one by its ears.
    """
    starts = np.cumsum(counts) - counts
    owner = np.repeat(np.arange(len(counts)), counts - 2)
    first = np.cumsum(counts - 2) - (counts - 2)
    step = np.arange(len(owner)) - first[owner]
    base = starts[owner]
    triangles = np.column_stack([base, base + step + 1, base + step + 2])
    many = np.flatnonzero(counts > 3)
    if not many.size:
        return triangles, owner
    points = positions[corners]
    lean, normals = _lean(points, triangles, owner, first)
    folded = many[lean[many] <= 0]
    quads = folded[counts[folded] == 4]
    if quads.size:
        other = starts[quads, None] + np.array([1, 2, 3, 1, 3, 0])
        other = other.reshape(-1, 3)
        other_lean, _ = _lean(points, other, np.repeat(np.arange(len(quads)), 2), 2 * np.arange(len(quads)))
        better = np.flatnonzero(other_lean > lean[quads])
        at = first[quads[better]]
        triangles[at], triangles[at + 1] = other[2 * better], other[2 * better + 1]
    for polygon in folded[counts[folded] > 4]:
        start, count = int(starts[polygon]), int(counts[polygon])
        flat = flattened(points[start : start + count], normals[polygon])
        if flat is not None:
            triangles[first[polygon] : first[polygon] + count - 2] = start + _ears(flat)
    return triangles, owner


def _lean(points: Float, triangles: Int, owner: Int, first: Int) -> tuple[Float, Float]:
    """For each polygon, its normal and the least component of its triangles' normals along that normal."""
    a, b, c = (points[triangles[:, i]] for i in range(3))
    faces = np.cross(b - a, c - a)
    normals = np.add.reduceat(faces, first)
    along = np.einsum("ij,ij->i", faces, normals[owner])
    return np.minimum.reduceat(np.nan_to_num(along), first), normals


def flattened(points: Float, normal: Float) -> Float | None:
    """The polygon's points (n, 2) in its own plane, counter-clockwise; None if the polygon has no area."""
    # Neither @ nor the norm of one vector is used: both call BLAS, which rounds differently on each processor.
    (z,) = unit(normal[None])
    if not z.any() or not np.isfinite(z).all() or not np.isfinite(points).all():
        return None
    (x,) = unit(np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)[None])
    from_first = points - points[0]
    return np.column_stack([(from_first * axis).sum(axis=1) for axis in (x, np.cross(z, x))])


def _ears(points: Float) -> Int:
    """Triangles (n - 2, 3) of a simple polygon (n, 2), counter-clockwise, cut ear by ear; for a polygon that is not simple, the
    triangles are arbitrary.

    Every corner is kept, even on straight edges, so that the triangles meet those of neighbours without cracks. For this, and
    for equal rounding on every processor, no library is used.
    """
    ring = _Ring(points.tolist())
    triangles: list[tuple[int, int, int]] = []
    at, left, passed = 0, len(points), 0
    while left > 3:
        before, after = ring.before[at], ring.after[at]
        if passed < left and not ring.is_ear(at):
            at, passed = after, passed + 1
            continue
        triangles.append((before, at, after))
        ring.cut(at)
        at, left, passed = ring.after[after], left - 1, 0
    triangles.append((ring.before[at], at, ring.after[at]))
    return np.array(triangles)


Point = tuple[float, float]


class _Ring:
    """The remaining corners of a polygon, and the positions of the non-convex ones, since only these can be inside an ear."""

    def __init__(self, points: Sequence[Point]) -> None:
        count = len(points)
        self.points = points
        self.before, self.after = [count - 1, *range(count - 1)], [*range(1, count), 0]
        self._low = min(x for x, _ in points), min(y for _, y in points)
        width, height = max(x for x, _ in points) - self._low[0], max(y for _, y in points) - self._low[1]
        self._cell = max(width, height) / max(math.isqrt(count), 1) or 1.0
        self._reflex: dict[tuple[int, int], set[int]] = {}
        for i in range(count):
            if not self._is_convex(i):
                self._reflex.setdefault(self._place(points[i]), set()).add(i)

    def is_ear(self, i: int) -> bool:
        """Return whether a corner is convex and no other corner is in the triangle of it and its neighbours. A corner that
        coincides with a neighbour is an ear, too.
        """
        a, b, c = (self.points[k] for k in (self.before[i], i, self.after[i]))
        if b in (a, c):
            return True
        if _turn(a, b, c) <= 0:
            return False
        x0, y0 = self._place((min(a[0], b[0], c[0]), min(a[1], b[1], c[1])))
        x1, y1 = self._place((max(a[0], b[0], c[0]), max(a[1], b[1], c[1])))
        cells = self._reflex
        if (x1 - x0 + 1) * (y1 - y0 + 1) < len(cells):
            near = ((x, y) for x in range(x0, x1 + 1) for y in range(y0, y1 + 1) if (x, y) in cells)
        else:
            near = (place for place in cells if x0 <= place[0] <= x1 and y0 <= place[1] <= y1)
        return not any(_holds(a, b, c, self.points[k]) for place in near for k in cells[place])

    def cut(self, i: int) -> None:
        """Remove a corner; its neighbours may become convex."""
        before, after = self.before[i], self.after[i]
        was_reflex = [k for k in (before, after) if not self._is_convex(k)]
        self.after[before], self.before[after] = after, before
        self._forget(i)
        for k in was_reflex:
            if self._is_convex(k):
                self._forget(k)

    def _forget(self, i: int) -> None:
        place = self._place(self.points[i])
        known = self._reflex.get(place, set())
        known.discard(i)
        if not known:
            self._reflex.pop(place, None)

    def _is_convex(self, i: int) -> bool:
        return _turn(*(self.points[k] for k in (self.before[i], i, self.after[i]))) > 0

    def _place(self, point: Point) -> tuple[int, int]:
        """The cell of a grid that contains a point."""
        return int((point[0] - self._low[0]) / self._cell), int((point[1] - self._low[1]) / self._cell)


def _turn(a: Point, b: Point, c: Point) -> float:
    """Twice the signed area of the triangle a b c."""
    return (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])


def _holds(a: Point, b: Point, c: Point, p: Point) -> bool:
    """Return whether a triangle, including its edges, contains a point that is not one of its corners."""
    return p not in (a, b, c) and _turn(a, b, p) >= 0 and _turn(b, c, p) >= 0 and _turn(c, a, p) >= 0
