"""The largest distance between any two of many points, computed exactly without comparing all pairs."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Float = NDArray[np.float64]
Whole = NDArray[np.intp]

LEAF = 8
"""Number of points in a box that is not halved further."""

CHUNK = 1 << 15
"""Number of pairs of boxes that are compared at a time."""

SLACK = 1e-12
"""Relative rounding error by which a bound may be too low."""

ROUNDED = 1e-7
"""Error of an angle in radians, because an arc cosine is inexact for small angles."""


def diameter(points: ArrayLike) -> float:
    """The largest distance between any two of the points (N, 3), N > 0, in their unit; the order of the points does not affect
    it.

    The points are halved recursively into boxes, and pairs of boxes are compared, the farthest first. The search ends when no
    remaining pair can exceed the largest distance found.
    """
    # Without counts numpy imports numpy.ma, which takes 8 ms.
    p, _ = np.unique(np.asarray(points, np.float64), axis=0, return_counts=True)
    square = _crossed(p)
    center = (p.min(axis=0) + p.max(axis=0)) / 2
    radii = np.sqrt(_squares(p - center))
    p = p[(radii + radii.max()) * (1 + SLACK) >= math.sqrt(square)]
    return math.sqrt(_searched(_halved(p), center, square) if len(p) else square)


def _crossed(p: Float) -> float:
    """The square of a distance that is rarely much less than the largest, found by moving from each point to its farthest
    point.
    """
    at, best = p[0], 0.0
    for _ in range(8):
        squares = _squares(p - at)
        far = int(squares.argmax())
        if squares[far] <= best:
            break
        at, best = p[far], float(squares[far])
    return best


def _halved(p: Float) -> Float:
    """The points (2^k, LEAF, 3), halved recursively across the longest side of their box; the last point may be repeated."""
    leaves = 1 << max(math.ceil(math.log2(len(p) / LEAF)), 0)
    p = np.concatenate([p, np.repeat(p[-1:], leaves * LEAF - len(p), axis=0)])[None]
    while p.shape[1] > LEAF:
        longest = np.ptp(p, axis=1).argmax(axis=1)
        order = np.take_along_axis(p, longest[:, None, None], axis=2)[..., 0].argsort(axis=1, kind="stable")
        p = np.take_along_axis(p, order[..., None], axis=1).reshape(2 * len(p), -1, 3)
    return p


@dataclass(frozen=True, eq=False)
class _Boxes:
    """Boxes (M,) around points: corners (M, 3), the largest radius in each box, and a cone with its axis and half angle."""

    low: Float
    high: Float
    radius: Float
    axis: Float
    angle: Float

    @staticmethod
    def around(p: Float) -> _Boxes:
        """The boxes around the points of each row of (M, n, 3), given relative to the centre of all points."""
        radii = np.sqrt(_squares(p))
        low, high = p.min(axis=1), p.max(axis=1)
        axis = _unit(low + high)
        cosines = (_unit(p) * axis[:, None]).sum(axis=2).min(axis=1)
        return _Boxes(low, high, radii.max(axis=1), axis, np.arccos(cosines.clip(-1, 1)) + ROUNDED)

    def bounds(self, a: Whole, b: Whole) -> Float:
        """Upper bounds (N,) of the squared distances between points of boxes a and b.

        Boxes give tight bounds for long or flat shapes, cones for round ones.
        """
        boxes = _squares(np.maximum(self.high[a] - self.low[b], self.high[b] - self.low[a]))
        apart = np.arccos((self.axis[a] * self.axis[b]).sum(axis=1).clip(-1, 1)) + ROUNDED
        widest = np.minimum(apart + self.angle[a] + self.angle[b], math.pi)
        r, s = self.radius[a], self.radius[b]
        cones = np.where(widest > math.pi / 2, r * r + s * s - 2 * r * s * np.cos(widest), math.inf)
        return np.minimum(boxes, cones) * (1 + SLACK)


def _searched(leaves: Float, center: Float, best: float) -> float:
    """The square of the largest distance, if it is more than `best`."""
    levels = [_Boxes.around((leaves - center).reshape(1 << k, -1, 3)) for k in range(len(leaves).bit_length())]
    waiting = [(0, np.zeros(1, np.intp), np.zeros(1, np.intp))]
    while waiting:
        level, a, b = waiting.pop()
        bounds = levels[level].bounds(a, b)
        kept = np.flatnonzero(bounds > best)
        kept = kept[bounds[kept].argsort(kind="stable")]
        a, b = a[kept], b[kept]
        if level + 1 < len(levels):
            waiting += ((level + 1, *pair) for pair in _children(a, b))
        elif len(a):
            best = max(best, _farthest(leaves[a], leaves[b]))
    return best


def _children(a: Whole, b: Whole) -> Iterator[tuple[Whole, Whole]]:
    """The pairs of the halves of pairs of boxes, each once, in chunks; the last pairs of a chunk come from the last pairs
    given.
    """
    left = np.stack([2 * a, 2 * a, 2 * a + 1, 2 * a + 1], axis=1).reshape(-1)
    right = np.stack([2 * b, 2 * b + 1, 2 * b, 2 * b + 1], axis=1).reshape(-1)
    once = left <= right
    left, right = left[once], right[once]
    for start in range(0, len(left), CHUNK):
        yield left[start : start + CHUNK], right[start : start + CHUNK]


def _farthest(one: Float, other: Float) -> float:
    """The largest squared distance between a point of (M, n, 3) and a point in the same row of (M, m, 3)."""
    return float(_squares(one[:, :, None] - other[:, None]).max())


def _unit(vectors: Float) -> Float:
    """Vectors (..., 3) scaled to length 1; zero vectors stay zero."""
    return vectors / np.maximum(np.sqrt(_squares(vectors)), np.finfo(float).tiny)[..., None]


def _squares(vectors: Float) -> Float:
    """Squares (...) of the lengths of vectors (..., 3)."""
    x, y, z = (vectors[..., i] for i in range(3))
    return x * x + y * y + z * z
