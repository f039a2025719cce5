"""The largest distance between any two of many points, exactly, without looking at all pairs."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Float = NDArray[np.float64]
Whole = NDArray[np.intp]

LEAF = 8
"""Points in one of the boxes that are not halved again."""

CHUNK = 1 << 15
"""Pairs of boxes that are looked at together."""

SLACK = 1e-12
"""Share by which a bound may be too low, because it is rounded."""

ROUNDED = 1e-7
"""Radians by which an angle may be, as an arc cosine is not exact for small ones."""


def diameter(points: ArrayLike) -> float:
    """The largest distance between any two of the points (N, 3), N > 0, in their unit; equal for any order of the points.

    Pairs of boxes around halves of halves of the points are looked at, the farthest first, unless no two points in them can be
    farther apart than two that are known.
    """
    # Without counts numpy imports numpy.ma, which takes 8 ms.
    p, _ = np.unique(np.asarray(points, np.float64), axis=0, return_counts=True)
    square = _crossed(p)
    center = (p.min(axis=0) + p.max(axis=0)) / 2
    radii = np.sqrt(_squares(p - center))
    p = p[(radii + radii.max()) * (1 + SLACK) >= math.sqrt(square)]
    return math.sqrt(_searched(_halved(p), center, square) if len(p) else square)


def _crossed(p: Float) -> float:
    """The square of a distance that is hardly ever much less than the largest: from a point to the farthest, and so on."""
    at, best = p[0], 0.0
    for _ in range(8):
        squares = _squares(p - at)
        far = int(squares.argmax())
        if squares[far] <= best:
            break
        at, best = p[far], float(squares[far])
    return best


def _halved(p: Float) -> Float:
    """The points (2^k, LEAF, 3), halved again and again across the longest side of their box; the last one may be repeated."""
    leaves = 1 << max(math.ceil(math.log2(len(p) / LEAF)), 0)
    p = np.concatenate([p, np.repeat(p[-1:], leaves * LEAF - len(p), axis=0)])[None]
    while p.shape[1] > LEAF:
        longest = np.ptp(p, axis=1).argmax(axis=1)
        order = np.take_along_axis(p, longest[:, None, None], axis=2)[..., 0].argsort(axis=1, kind="stable")
        p = np.take_along_axis(p, order[..., None], axis=1).reshape(2 * len(p), -1, 3)
    return p


@dataclass(frozen=True, eq=False)
class _Boxes:
    """Boxes (M,) around points: their corners (M, 3), the largest radius in each, and a cone: its axis and half its angle."""

    low: Float
    high: Float
    radius: Float
    axis: Float
    angle: Float

    @staticmethod
    def around(p: Float) -> _Boxes:
        """The boxes around the points of each row of (M, n, 3), which are given from the middle of all."""
        radii = np.sqrt(_squares(p))
        low, high = p.min(axis=1), p.max(axis=1)
        axis = _unit(low + high)
        cosines = (_unit(p) * axis[:, None]).sum(axis=2).min(axis=1)
        return _Boxes(low, high, radii.max(axis=1), axis, np.arccos(cosines.clip(-1, 1)) + ROUNDED)

    def bounds(self, a: Whole, b: Whole) -> Float:
        """Squares that those of distances between points of boxes a and b do not exceed, (N,).

        Boxes bound well what is long or flat, cones what is round.
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
    """The pairs of the halves of pairs of boxes, each once, in chunks whose last pairs come from the last ones."""
    left = np.stack([2 * a, 2 * a, 2 * a + 1, 2 * a + 1], axis=1).reshape(-1)
    right = np.stack([2 * b, 2 * b + 1, 2 * b, 2 * b + 1], axis=1).reshape(-1)
    once = left <= right
    left, right = left[once], right[once]
    for start in range(0, len(left), CHUNK):
        yield left[start : start + CHUNK], right[start : start + CHUNK]


def _farthest(one: Float, other: Float) -> float:
    """The square of the largest distance between a point of (M, n, 3) and one of the same row of (M, m, 3)."""
    return float(_squares(one[:, :, None] - other[:, None]).max())


def _unit(vectors: Float) -> Float:
    """Vectors (..., 3) of length 1; zero stays."""
    return vectors / np.maximum(np.sqrt(_squares(vectors)), np.finfo(float).tiny)[..., None]


def _squares(vectors: Float) -> Float:
    """Squares (...) of the lengths of vectors (..., 3)."""
    x, y, z = (vectors[..., i] for i in range(3))
    return x * x + y * y + z * z
