"""The things on the floor, indexed so that a spot is compared only with its neighbours."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.composing.placing.shared.footprint import Footprint, Outline

Float = NDArray[np.float64]

CELLS = 1024
"""Cells along the side of a map: 1,000 chairs have cells of 6 cm, and a thousand things are marked in 0.1 s."""

FINE = 0.25
"""Least side of a cell, as a share of the narrowest thing's inner radius: finer cells find hardly more taken spots."""

LEAST = 1e-4
"""Smallest cell and inner radius, metres: nothing thinner is marked."""

SURE = 1e-6
"""Safety margin, metres: a spot must be too near by more than this to count as taken without an exact test; far above rounding
errors.
"""


@dataclass(eq=False)
class Crowd:
    """Covers of one type, in the order in which they were added."""

    covers: list[Any] = field(default_factory=list[Any])
    _circles: Float = field(default_factory=lambda: np.empty((16, 3)))

    def add(self, cover: Footprint | Outline) -> None:
        """Add one more."""
        count = len(self.covers)
        if count == len(self._circles):
            self._circles = np.concatenate([self._circles, np.empty_like(self._circles)])
        self._circles[count] = cover.circle[:3]
        self.covers.append(cover)

    def is_clear(self, own: Footprint | Outline, gap: float) -> bool:
        """True if all covers are apart from this one by a gap."""
        x, y, outer, _, spread = own.circle
        there = self._circles[: len(self.covers)]
        far, reach = np.hypot(there[:, 0] - x, there[:, 1] - y), spread * (there[:, 2] + (outer + gap))
        return all(own.apart(self.covers[i], gap) for i in np.flatnonzero(far < reach).tolist())


def inner_class(radius: float) -> float:
    """The power of two at or below an inner radius: things of a class share a map."""
    return 2.0 ** math.floor(math.log2(max(radius, LEAST)))


@dataclass(frozen=True, eq=False)
class TakenMap:
    """A map of the floor around the middle: cells that cannot hold the middle of another thing, because it would be nearer to
    an existing one than the gap. slim: the least inner radius of these things; reach: metres from the middle to the map's
    edges.
    """

    gap: float
    slim: float
    cell: float
    reach: float
    taken: NDArray[np.bool_]

    @classmethod
    def empty(cls, gap: float, slim: float, reach: float) -> TakenMap:
        """An empty map."""
        cell = max(2 * reach / CELLS, FINE * slim, LEAST)
        count = min(int(2 * reach / cell) + 1, CELLS)
        return cls(gap, slim, cell, count * cell / 2, np.zeros((count, count), np.bool_))

    def add(self, cover: Footprint | Outline) -> None:
        """Mark the cells that are entirely too near to a cover."""
        far = self.slim + self.gap - SURE - 0.7072 * self.cell  # from a cell's middle, because its corners are farther away
        corners = cover.corners
        low = np.maximum(np.floor((corners.min(axis=0) - far + self.reach) / self.cell).astype(int), 0)
        high = np.minimum(np.ceil((corners.max(axis=0) + far + self.reach) / self.cell).astype(int), len(self.taken))
        if far <= 0 or (high <= low).any():
            return
        x, y = (np.arange(a, b) * self.cell + self.cell / 2 - self.reach for a, b in zip(low, high, strict=True))
        points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
        self.taken[low[0] : high[0], low[1] : high[1]] |= _are_near(points, corners, far)

    def are_taken(self, middles: Float) -> NDArray[np.bool_]:
        """True for middles (N, 2) of things that are certainly too near to another."""
        cells = np.floor((middles + self.reach) / self.cell)
        is_beyond = ((cells < 0) | (cells >= len(self.taken))).any(axis=1)
        cells[is_beyond] = 0
        columns, rows = cells.astype(np.intp).T
        return ~is_beyond & self.taken[columns, rows]


def _are_near(points: Float, corners: Float, far: float) -> NDArray[np.bool_]:
    """True for points (..., 2) within a convex polygon, or nearer to one of its sides than `far`."""
    left, right = np.ones((2, *points.shape[:-1]), np.bool_)
    near = np.zeros(points.shape[:-1], np.bool_)
    for start, side in zip(corners, np.roll(corners, -1, axis=0) - corners, strict=True):
        away = points - start
        turn = side[0] * away[..., 1] - side[1] * away[..., 0]
        share = np.clip(away @ side / max(float(side @ side), 1e-24), 0, 1)
        near |= np.hypot(away[..., 0] - share * side[0], away[..., 1] - share * side[1]) < far
        left, right = left & (turn > 0), right & (turn < 0)
    return near | left | right
