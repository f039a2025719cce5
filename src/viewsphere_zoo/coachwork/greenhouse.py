"""The upper body: pillars, panes and roof, on an outline at the belt and a smaller one at the roof."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from viewsphere_zoo.coachwork.hull import Hull, Knots
from viewsphere_zoo.coachwork.outline import Outline
from viewsphere_zoo.shapes.panels import frame, in_quad, rim
from viewsphere_zoo.shapes.solids import Float, Solid, curve, flipped, grid

GLASS_DEPTH = 0.009
"""Depth of panes behind their frames, metres."""


@dataclass(frozen=True)
class Cell:
    """A stretch [start, stop] of the ring around the cabin. It holds a pane if it has a name.

    margins: frame left, right, below, above the pane, metres; slant: how much higher the pane's lower right corner is.
    """

    start: float
    stop: float
    name: str = ""
    margins: tuple[float, float, float, float] = (0.05, 0.05, 0.03, 0.05)
    slant: float = 0.0


@dataclass(frozen=True)
class Greenhouse:
    """The cabin above the belt, metres; roof (y, z) is the roof's line in side view; drop is how much lower its edge is."""

    hull: Hull
    base: Outline
    top: Outline
    roof: Knots
    drop: float = 0.05
    bulge: float = 0.018
    fillet: float = 0.9

    def _corners(self, u: Float) -> tuple[Float, Float]:
        """Points on the belt and on the (unrounded) roof edge."""
        low, high = self.base.point(u), self.top.point(u)
        z_low = self.hull.deck(low[..., 0], low[..., 1]) - 0.015
        z_high = curve(high[..., 1], self.roof) - self.drop
        return np.concatenate([low, z_low[..., None]], -1), np.concatenate([high, z_high[..., None]], -1)

    def surface(self, u: ArrayLike, v: ArrayLike) -> Float:
        """The side wall's point at outline parameter u and height fraction v (0 belt, 1 where the roof's rounding begins)."""
        u, v = np.broadcast_arrays(np.asarray(u, np.float64), np.asarray(v, np.float64))
        low, high = self._corners(u)
        points = low + (high - low) * (v * self.fillet)[..., None]
        points[..., :2] += self.base.normal(u) * (self.bulge * 4 * v * (1 - v))[..., None]
        return points

    def roof_height(self, y: ArrayLike) -> Float:
        """Height of the roof's middle line."""
        return curve(y, self.roof)

    def roof_solid(self) -> Solid:
        """Rounded edge and crown of the whole roof."""
        near = np.linspace(1, 0, 6, endpoint=False) ** 1.7
        left = np.concatenate([1 - near, [1.0], 1 + near[:0:-1], 3 - near, [3.0], 3 + near[::-1]])
        u = np.concatenate([-left[:0:-1], left])
        _, edge = self._corners(u)
        start = self.surface(u, np.ones_like(u))
        middle = np.array([0.0, (self.top.front + self.top.rear) / 2])
        k = np.array([0.88, 0.76, 0.56, 0.32, 0.1])
        plan = middle + (edge[:, :2] - middle) * k[:, None, None]
        inner = np.concatenate([plan, (curve(plan[..., 1], self.roof) - self.drop * k[:, None] ** 4)[..., None]], -1)
        t = np.linspace(0, 1, 5)[:-1, None, None]
        round_ = (1 - t) ** 2 * start + 2 * t * (1 - t) * edge + t**2 * inner[0]
        rings = np.concatenate([round_, inner, np.broadcast_to(inner[-1].mean(axis=0), (1, *edge.shape))])
        return flipped(grid(rings, wrap=True))

    def wall(self, cell: Cell) -> Solid:
        """A cell without a pane."""
        u, v = np.meshgrid(np.linspace(cell.start, cell.stop, 6), np.linspace(0, 1, 6), indexing="ij")
        return grid(self.surface(u, v))

    def opening(self, cell: Cell) -> Float:
        """The corners (4, 2) of a cell's pane in (u, v)."""
        corners = np.array([[cell.start, 0], [cell.stop, 0], [cell.stop, 1], [cell.start, 1]])
        at = self.surface(corners[:, 0], corners[:, 1])
        width = np.linalg.norm(at[[1, 2]] - at[[0, 3]], axis=1)
        height = np.linalg.norm(at[[3, 2]] - at[[0, 1]], axis=1).mean()
        left, right, below, above = cell.margins
        s0, s1 = np.minimum(left / width, 0.35), 1 - np.minimum(right / width, 0.35)
        t0, t1 = below / height, 1 - above / height
        square = np.array([[s0[0], t0], [s1[0], t0 + cell.slant], [s1[1], t1], [s0[1], t1]])
        return in_quad(corners, square)

    def framed(self, cell: Cell, rounding: float = 0.09) -> tuple[Solid, Solid, Solid]:
        """A cell's frame, its rubber seal and its pane."""
        count = max(5, round((cell.stop - cell.start) * 8))
        corners = [(cell.start, 0.0), (cell.stop, 0.0), (cell.stop, 1.0), (cell.start, 1.0)]
        around, ring = frame(self.surface, corners, self.opening(cell), rounding, count)
        seal = rim(self.surface, ring, (0.0, -0.5 * GLASS_DEPTH), 0.012)
        u, v = np.meshgrid(np.linspace(cell.start, cell.stop, count + 3), np.linspace(-0.03, 1.02, 6), indexing="ij")
        return around, seal, grid(self._inset(u, v))

    def _inset(self, u: Float, v: Float) -> Float:
        """Points behind the surface, at the depth of the panes."""
        points = self.surface(u, v)
        points[..., :2] -= GLASS_DEPTH * self.base.normal(u)
        return points
