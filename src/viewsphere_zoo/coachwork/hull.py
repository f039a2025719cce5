"""The lower body: a wall around the plan outline, arched over the wheels, and the deck (bonnet, shoulders, boot lid) on top."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from viewsphere_zoo.coachwork.outline import Outline
from viewsphere_zoo.shapes.solids import Float, Solid, curve, grid

LOWER, UPPER, EDGE = 2, 7, 3
"""Rows of the wall below the bumper line, above it, and around its top edge."""


@dataclass(frozen=True)
class Arch:
    """A wheel's opening: the hub's y, z and the radius, metres."""

    y: float
    z: float
    radius: float

    def height(self, y: Float) -> Float:
        """The arch's edge over y, -inf outside."""
        d = np.abs(y - self.y) / self.radius
        rise = self.radius * (1 - np.minimum(d, 1.0) ** 2.3) ** (1 / 2.3)
        return np.where(d <= 1.0, self.z + rise, -np.inf)


Knots = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Hull:
    """A lower body, metres.

    center (y, z): the deck's line in side view; crown: how much lower the deck's sides are; sill: (y, z) of the wall's lower
    edge; side, nose, tail: (z, inset from the outline) on flanks, front and rear; edge: radius between wall and deck;
    bumper_line: z of the border between bumpers and body; crease: z of the fold along the flanks; dome: height of a bonnet
    bulge that ends at y = dome_end.
    """

    outline: Outline
    center: Knots
    crown: float
    sill: Knots
    side: Knots
    nose: Knots
    tail: Knots
    arches: tuple[Arch, ...]
    edge: float = 0.05
    bumper_line: float = 0.52
    crease: float = 0.7
    dome: float = 0.0
    dome_end: float = 0.0

    def deck(self, x: ArrayLike, y: ArrayLike) -> Float:
        """Height of the deck's surface over plan points."""
        across = np.abs(np.asarray(x)) / self.outline.half_width
        bulge = self.dome * np.exp(-((across / 0.42) ** 6)) * np.clip((self.dome_end - np.asarray(y)) / 0.3, 0, 1)
        return curve(y, self.center) - self.crown * across**2.6 + bulge

    def inset(self, u: ArrayLike, z: ArrayLike) -> Float:
        """Return the distance of the wall inside the outline."""
        n = self.outline.normal(u)
        ahead, behind = np.maximum(-n[..., 1], 0) ** 2, np.maximum(n[..., 1], 0) ** 2
        inset = n[..., 0] ** 2 * curve(z, self.side)
        return inset + ahead * curve(z, self.nose) + behind * curve(z, self.tail)

    def surface(self, u: ArrayLike, z: ArrayLike) -> Float:
        """The wall's point at outline parameter u and height z."""
        u, z = np.broadcast_arrays(np.asarray(u, np.float64), np.asarray(z, np.float64))
        plan = self.outline.point(u) - self.inset(u, z)[..., None] * self.outline.normal(u)
        return np.concatenate([plan, z[..., None]], axis=-1)

    def deck_surface(self, x: Float, y: Float) -> Float:
        """The deck's point over plan coordinates."""
        return np.stack([x, y, self.deck(x, y)], axis=-1)

    @cached_property
    def stations(self) -> Float:
        """Parameters u of the left half's columns, dense around arches and corners."""
        o = self.outline
        ends = [np.linspace(0, 0.8, 6), np.linspace(0.8, 1.25, 9), np.linspace(2.75, 3.2, 9), np.linspace(3.2, 4, 6)]
        flank = o.u_at_y(np.arange(o.point(1.25)[1], o.point(2.75)[1], 0.2))
        free = np.unique(np.concatenate([*ends, flank]))
        y = o.point(free)[:, 1]
        away = np.all([np.abs(y - a.y) > 1.06 * a.radius for a in self.arches], axis=0)
        across = np.concatenate([[1.03], np.cos(np.linspace(0, np.pi, 17)), [-1.03]])
        return np.sort(np.concatenate([free[away], *(o.u_at_y(a.y - a.radius * across) for a in self.arches)]))

    def lower_edge(self, u: Float) -> Float:
        """Height of the wall's lower edge."""
        y = self.outline.point(u)[..., 1]
        return np.max([curve(y, self.sill), *(arch.height(y) for arch in self.arches)], axis=0)

    def top(self, u: Float) -> tuple[Float, Float]:
        """Plan points (..., 2) and heights where the wall ends and the deck begins."""
        plan, n = self.outline.point(u), self.outline.normal(u)
        at, z = plan, self.deck(plan[..., 0], plan[..., 1])
        for _ in range(3):
            at = plan - (self.inset(u, z - self.edge) + self.edge)[..., None] * n
            z = self.deck(at[..., 0], at[..., 1])
        return at, z

    def wall(self) -> Float:
        """The left wall's grid (stations, rows, 3), rows upwards; row LOWER is on the bumper line."""
        u = self.stations
        _, top = self.top(u)
        low, high = self.lower_edge(u), top - self.edge
        line = np.clip(self.bumper_line, low + 0.12 * (high - low), low + 0.7 * (high - low))
        lower = low[:, None] + (line - low)[:, None] * np.linspace(0, 1, LOWER + 1)
        shoulder = line + np.minimum(0.024, 0.1 * (high - line))  # the ledge above the bumpers
        fold = np.minimum(self.crease, shoulder + 0.6 * (high - shoulder))
        after = fold + np.minimum(0.023, 0.2 * (high - fold))
        below = shoulder[:, None] + (fold - shoulder)[:, None] * np.linspace(0, 1, UPPER - 3)
        upper = np.concatenate([below, after[:, None] + (high - after)[:, None] * np.linspace(0, 1, 3)], axis=1)
        rows = self.surface(u[:, None], np.concatenate([lower, upper], axis=1))
        angle = np.linspace(0, np.pi / 2, EDGE + 1)[1:]
        n = self.outline.normal(u)[:, None]
        inward = self.edge * (1 - np.cos(angle))[:, None]
        plan = rows[:, -1:, :2] - inward * n
        rise = (top - self.edge)[:, None] + self.edge * np.sin(angle)
        return np.concatenate([rows, np.concatenate([plan, rise[..., None]], axis=-1)], axis=1)

    def deck_to(self, inner: Float, steps: int = 5) -> Solid:
        """The left half of the deck, from the wall's top inwards to a plan curve (stations, 2)."""
        outer, _ = self.top(self.stations)
        share = np.linspace(0, 1, steps + 1)[:, None]
        plan = outer[:, None] * (1 - share) + inner[:, None] * share
        return grid(np.concatenate([plan, self.deck(plan[..., 0], plan[..., 1])[..., None]], axis=-1))

    def underside(self, track: float) -> Solid:
        """Left half of floor and wheel houses; `track` is the x of the houses' inner walls."""
        u = self.stations
        edge = self.surface(u, self.lower_edge(u))
        arched = np.any([np.abs(edge[:, 1] - a.y) <= 1.001 * a.radius for a in self.arches], axis=0)
        floor = curve(edge[:, 1], self.sill) + 0.01
        wall_x = np.where(arched, np.minimum(track, edge[:, 0]), edge[:, 0] * 0.97)
        house = np.stack([wall_x, edge[:, 1], edge[:, 2]], axis=1)
        foot = np.stack([wall_x, edge[:, 1], floor], axis=1)
        keel = np.stack([np.zeros(len(u)), edge[:, 1], floor], axis=1)
        return grid(np.stack([keel, foot, house, edge], axis=1))


def follow(hull: Hull, inner: Outline, corner: float, overlap: float = 0.0) -> Float:
    """A point on an inner outline for each of the hull's stations, (stations, 2).

    Stations beside the inner outline's flank (parameters corner to 4 - corner) keep their y; stations ahead and behind are
    spread around its ends. All points are moved `overlap` metres further inwards.
    """
    u = hull.stations
    y = hull.outline.point(u)[:, 1]
    u0, u1 = (float(hull.outline.u_at_y(inner.point(end)[1])) for end in (corner, 4 - corner))
    ahead, behind = corner * u / u0, 4 - corner * (4 - u) / (4 - u1)
    at = np.where(u < u0, ahead, np.where(u > u1, behind, inner.u_at_y(y)))
    return inner.point(at) - overlap * inner.normal(at)
