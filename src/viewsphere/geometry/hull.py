"""Convex hulls in a plane, and the smallest rectangles around them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]

MANY = 64
"""Number of points above which interior points are removed first."""

DIRECTIONS = (
    *((1, 0), (3, 1), (2, 2), (1, 3), (0, 1), (-1, 3), (-2, 2), (-3, 1)),
    *((-1, 0), (-3, -1), (-2, -2), (-1, -3), (0, -1), (1, -3), (2, -2), (3, -1)),
)
"""Directions, ordered from x to y."""


def convex_hull(points: Float) -> Float:
    """The corners (K, 2) of the convex hull of points (N, 2), ordered from x to y, which is clockwise as seen if y points down.
    The first corner has the lowest x, then the lowest y; no corner is inside a side. If all points coincide, the result is that
    point; if they are on a line, its two ends.

    By A. M. Andrew, Another efficient algorithm for convex hulls in two dimensions, Information Processing Letters 9 (1979).
    """
    found = np.unique(_outer(points), axis=0)
    if len(found) < 3:
        return found
    lower, upper = _chain(found), _chain(found[::-1])
    return np.array(lower[:-1] + upper[:-1])


def _outer(points: Float) -> Float:
    """The points without most of those that cannot be corners: points inside the polygon of the farthest points in a few
    directions are removed (S. Akl and G. Toussaint, A fast convex hull algorithm, Information Processing Letters 7 (1978)).
    """
    if len(points) <= MANY:
        return points
    x, y = points.T
    ends = points[[int(np.argmax(a * x + b * y)) for a, b in DIRECTIONS]]
    if (ends == ends[0]).all():
        return ends[:1]
    inside = np.ones(len(points), np.bool_)
    for (x0, y0), (x1, y1) in zip(ends.tolist(), np.roll(ends, -1, axis=0).tolist(), strict=True):
        if (x0, y0) != (x1, y1):
            inside &= (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0) > 0
    return points[~inside]


def _chain(points: Float) -> list[tuple[float, float]]:
    chain: list[tuple[float, float]] = []
    for x, y in points.tolist():
        while len(chain) > 1 and _turn(chain[-2], chain[-1], (x, y)) <= 0:
            chain.pop()
        chain.append((x, y))
    return chain


def _turn(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def smallest_rectangle(hull: Float) -> Float:
    """The corners (4, 2) of the rectangle of least area around a convex hull (K, 2), in the hull's order. The first corner has
    the lowest y, then the lowest x.

    One side lies along a side of the hull (H. Freeman and R. Shapira, Determining the minimum-area encasing rectangle for an
    arbitrary closed curve, CACM 18 (1975)); among rectangles of equal area, the one along the first such side is chosen.
    """
    sides = np.roll(hull, -1, axis=0) - hull
    lengths = np.hypot(*sides.T)
    along = sides[lengths > 0] / lengths[lengths > 0, None] if (lengths > 0).any() else np.array([[1.0, 0.0]])
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    u, v = (hull[:, :1] * axes[:, 0] + hull[:, 1:] * axes[:, 1] for axes in (along, across))  # no BLAS, as in geometry.rotation
    areas = np.ptp(u, axis=0) * np.ptp(v, axis=0)
    best = int(np.flatnonzero(areas <= areas.min() * (1 + EQUAL))[0])
    low, high = (u[:, best].min(), v[:, best].min()), (u[:, best].max(), v[:, best].max())
    placed = np.array([low, (high[0], low[1]), high, (low[0], high[1])])
    corners = placed[:, :1] * along[best] + placed[:, 1:] * across[best]
    first = min(range(4), key=lambda i: (round(float(corners[i, 1]), 9), float(corners[i, 0])))
    return np.roll(corners, -first, axis=0)


EQUAL = 1e-12
"""Relative difference up to which areas count as equal."""


def mask_outline(part: NDArray[np.bool_], x0: int = 0, y0: int = 0) -> Float:
    """Pixel corners (N, 2) of a mask's outermost pixels, row by row: the input for its convex hull. `part` (h, w) begins at
    column x0, row y0.
    """
    rows = np.flatnonzero(part.any(axis=1))
    own = part[rows]
    left, right = own.argmax(axis=1), part.shape[1] - own[:, ::-1].argmax(axis=1)
    corners = [(x, y) for x in (left, right) for y in (rows, rows + 1)]
    return np.concatenate([np.stack([x + x0, y + y0], axis=1) for x, y in corners]).astype(np.float64)
