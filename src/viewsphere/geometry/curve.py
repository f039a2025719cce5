"""Smooth curves through points, measured by their arc length."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

Float = NDArray[np.float64]

PIECES = 16
"""Number of pieces into which each span is divided to measure its length."""

NODES = np.array([-0.9602898564975363, -0.7966664774136267, -0.5255324099163290, -0.1834346424956498])
WEIGHTS = np.array([0.1012285362903763, 0.2223810344533745, 0.3137066458778873, 0.3626837833783620])
"""The first half of the eight-point rule of Gauss and Legendre on [-1, 1]; the second mirrors the first. Abramowitz and
Stegun 1964, table 25.4. Written out, because computed nodes differ in their last digits from processor to processor.
"""

STEPS = 12
"""Maximum number of Newton steps from a length to its place on a piece; two are usually enough."""

CLOSE = 1e-14
"""Tolerance of a length, as a share of the curve's length."""


@dataclass(frozen=True, eq=False)
class Curve:
    """A curve of cubic spans. `knots` (N,) are the lengths at its points. For a closed curve, the last knot is the length at
    which the curve meets its first point again.

    Span i is `cubics[i]` (4, D), coefficients of 1, u, u^2, u^3 for u of 0 to 1; `pieces[i]` (PIECES + 1,) are the lengths at
    equal steps of u.
    """

    cubics: Float
    pieces: Float
    closed: bool

    @property
    def length(self) -> float:
        """Length of the whole curve."""
        return float(self.pieces[-1, -1])

    @property
    def knots(self) -> Float:
        """Lengths (N,) at which the curve passes its points."""
        return np.append(self.pieces[:, 0], self.length)

    def points_at(self, length: ArrayLike) -> Float:
        """Points (..., D) at these lengths (...). Lengths beyond the end of an open curve give the end; on a closed curve they
        wrap around.
        """
        return self.along(length)[0]

    def direction(self, length: ArrayLike) -> Float:
        """Unit vectors (..., D) along the curve at these lengths (...), which are interpreted as in `at`."""
        return self.along(length)[1]

    def along(self, length: ArrayLike) -> tuple[Float, Float]:
        """Points and unit vectors along the curve, (..., D) each, at these lengths (...), which are interpreted as in `at`."""
        span, u = self._found(length)
        c, slope = self.cubics[span], _slope(self.cubics[span], u)
        u = u[..., None]
        points = c[..., 0, :] + u * (c[..., 1, :] + u * (c[..., 2, :] + u * c[..., 3, :]))
        return points, slope / _norm(slope)[..., None]

    def _found(self, length: ArrayLike) -> tuple[NDArray[np.intp], Float]:
        """Span and u (...) of these lengths (...)."""
        s = np.asarray(length, np.float64)
        s = s % self.length if self.closed else np.clip(s, 0.0, self.length)
        starts = self.pieces[:, :-1].ravel()
        piece = np.clip(np.searchsorted(starts, s, side="right") - 1, 0, len(starts) - 1)
        span, step = np.divmod(piece, PIECES)
        return span, self._solved(span, step / PIECES, s - starts[piece], self.pieces[span, step + 1] - starts[piece])

    def _solved(self, span: NDArray[np.intp], begin: Float, rest: Float, whole: Float) -> Float:
        """The u at length `rest` after u = `begin` in a piece of length `whole`, by Newton's method restricted to the piece."""
        cubics = self.cubics[span]
        u = begin + rest / whole / PIECES
        for _ in range(STEPS):
            error = rest - _measured(cubics, begin, u)
            if (np.abs(error) <= CLOSE * self.length).all():
                break
            u = np.clip(u + error / _norm(_slope(cubics, u)), begin, begin + 1 / PIECES)
        return u


def spline(points: ArrayLike, closed: bool = False) -> Curve:
    """The centripetal Catmull-Rom curve through points (N, D), N >= 2 (3 where closed): no loops, no cusps between points.

    Barry and Goldman 1988; Yuksel, Schaefer and Keyser 2011 for the centripetal knots, |p[i+1] - p[i]| ** 0.5. The ends of an
    open curve use the mirrored neighbours of its first and last points. Raises ValueError for fewer points, or if two
    neighbours coincide.
    """
    p = np.asarray(points, np.float64)
    least = 3 if closed else 2
    if p.ndim != 2 or len(p) < least:
        raise ValueError(f"expected {least} points or more; found {len(p) if p.ndim == 2 else p.shape}")
    around = np.concatenate([p[-1:], p, p[:2]]) if closed else np.concatenate([[2 * p[0] - p[1]], p, [2 * p[-1] - p[-2]]])
    gaps = np.sqrt(_norm(np.diff(around, axis=0)))
    if not gaps.all():
        twice = int(np.flatnonzero(gaps[1:] == 0)[0])
        raise ValueError(f"expected neighbours apart; found point {twice + 1} and the next at {p[twice].tolist()}")
    cubics = np.stack([_cubic(around[i : i + 4], gaps[i : i + 3]) for i in range(len(around) - 3)])
    return Curve(cubics, _lengths(cubics), closed)


def _cubic(p: Float, gaps: Float) -> Float:
    """Coefficients (4, D) of the span between the middle two of four points (4, D) with these knot distances (3,)."""
    a, b, c = (p[i + 1] - p[i] for i in range(3))
    begin = gaps[1] * (a / gaps[0] - (a + b) / (gaps[0] + gaps[1])) + b
    end = gaps[1] * (c / gaps[2] - (b + c) / (gaps[1] + gaps[2])) + b
    return np.stack([p[1], begin, 3 * b - 2 * begin - end, begin + end - 2 * b])


def _lengths(cubics: Float) -> Float:
    """Lengths (spans, PIECES + 1) at equal steps of u, along all spans."""
    edges = np.arange(PIECES + 1) / PIECES
    each = np.stack([_measured(cubics, np.full(len(cubics), a), np.full(len(cubics), b)) for a, b in pairwise(edges)], axis=1)
    ends = np.cumsum(each).reshape(each.shape)
    return np.concatenate([np.append(0.0, ends[:-1, -1])[:, None], ends], axis=1)


def _measured(cubics: Float, begin: Float, end: Float) -> Float:
    """Lengths (...) of cubics (..., 4, D) from u = begin to u = end (...)."""
    half, middle, total = (end - begin) / 2, (end + begin) / 2, np.zeros(np.shape(end))
    for node, weight in zip(NODES, WEIGHTS, strict=True):
        for side in (node, -node):
            total = total + weight * _norm(_slope(cubics, middle + side * half))
    return total * half


def _slope(cubics: Float, u: Float) -> Float:
    """Derivatives (..., D) by u (...) of cubics (..., 4, D)."""
    u = u[..., None]
    return cubics[..., 1, :] + u * (2 * cubics[..., 2, :] + u * 3 * cubics[..., 3, :])


def _norm(vectors: Float) -> Float:
    """Lengths (...) of vectors (..., D); the sum is written out, as in `rotation.transform`."""
    total = vectors[..., 0] ** 2
    for i in range(1, vectors.shape[-1]):
        total = total + vectors[..., i] ** 2
    return np.sqrt(total)
