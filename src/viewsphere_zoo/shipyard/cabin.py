"""Cabin trunks and wheelhouses: a wall around a rounded plan on deck, windows in it, a cambered roof."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.panels import Surface, panel
from viewsphere_zoo.shapes.sheets import bar
from viewsphere_zoo.shapes.solids import Float, Solid, both_sides, flipped, grid
from viewsphere_zoo.shipyard.coats import Coats
from viewsphere_zoo.shipyard.shell import Deck, along, pair

Span = tuple[float, float]


@dataclass(frozen=True, eq=False)
class Trunk:
    """A house on deck from t = start to stop, metres.

    width: half of the trunk's greatest; margin: width of the side deck; height: of front and rear above the deck's middle;
    lean: how far the sides fall inwards, fraction of the width; rake: how far the front's top stands behind its foot, and the
    rear's top before its foot; square: exponent of the plan; camber: rise of the roof.
    """

    deck: Deck
    start: float
    stop: float
    width: float
    margin: float
    height: Span
    lean: float = 0.1
    rake: Span = (0.3, 0.0)
    square: float = 5.0
    camber: float = 0.05
    edge: float = 0.03

    def surface(self, u: ArrayLike, h: ArrayLike) -> Float:
        """The left wall: u from 0 (middle of the front) to 1 (middle of the rear), h from 0 (deck) to 1 (top)."""
        u, h = np.broadcast_arrays(np.asarray(u, np.float64), np.asarray(h, np.float64))
        sine, cosine = np.sin(np.pi * u), np.cos(np.pi * u)
        s = (1 - np.sign(cosine) * np.abs(cosine) ** (2 / self.square)) / 2
        t = self.start + s * (self.stop - self.start)
        wide = np.minimum(self.width, np.maximum(self.deck.lines.half(t) - self.margin, 0))
        foot = wide * np.abs(sine) ** (2 / self.square)
        low = self.deck.height(t, foot) - 0.015
        top = self.deck.height(t, 0.0) + self.height[0] + s * (self.height[1] - self.height[0]) - self.camber
        y = self.deck.lines.sheer_line(t)[..., 1]
        y = y + h * (self.rake[0] * (1 - s) ** 3 - self.rake[1] * s**3)
        return np.stack([foot * (1 - self.lean * h), y, low + h * (top - low)], axis=-1)

    def columns(self) -> Float:
        """Values of u at the wall's columns."""
        return np.concatenate([np.linspace(0, 0.3, 14), np.linspace(0.3, 0.7, 16)[1:-1], np.linspace(0.7, 1, 14)])

    def walls(self) -> Solid:
        """Both walls from the deck to the roof's edge."""
        return both_sides(grid(self.surface(self.columns()[:, None], np.linspace(0, 1, 7))))

    def roof(self) -> Solid:
        """A cambered top with rounded sides."""
        edge = self.surface(self.columns(), 1.0)
        angle = np.linspace(0, np.pi / 2, 4)
        half = np.maximum(edge[:, :1], 1e-6)
        round_ = np.minimum(self.edge, 0.5 * half)
        x = np.concatenate([half - round_ * (1 - np.cos(angle)), (half - round_) * np.linspace(1, 0, 8)[1:]], axis=1)
        rise = np.minimum(self.edge, 0.5 * half) * np.concatenate([np.sin(angle), np.ones(7)])
        z = edge[:, 2:] + rise + self.camber * (1 - (x / half) ** 2)
        points = np.stack([x, np.broadcast_to(edge[:, 1:2], x.shape), z], axis=-1)
        return both_sides(flipped(grid(points.swapaxes(0, 1))))

    def top(self, y: float, x: float = 0.0) -> Float:
        """The roof's point at y and x."""
        edge = self.surface(self.columns(), 1.0)
        half = float(np.interp(y, edge[:, 1], edge[:, 0]))
        z = float(np.interp(y, edge[:, 1], edge[:, 2]))
        across = min(abs(x) / max(half, 1e-6), 1.0)
        return np.array([x, y, z + min(self.edge, 0.5 * half) + self.camber * (1 - across**2)])

    def spots(self, shares: ArrayLike) -> list[float]:
        """u of the left wall's middle at these fractions of its length."""
        u = np.linspace(0, 1, 401)
        y = self.surface(u, 0.6)[:, 1]
        return np.interp(y[0] + np.asarray(shares, np.float64) * (y[-1] - y[0]), y, u).tolist()

    def front(self, q: Float, h: Float) -> Float:
        """The left half of the front face: q from 0 (middle) to 1 (left side) is even across."""
        return self.surface(np.arcsin(np.clip(q, 1e-6, 1) ** (self.square / 2)) / np.pi, h)

    def rear(self, q: Float, h: Float) -> Float:
        """The left half of the rear face: q from -1 (left side) to 0 (middle)."""
        return self.surface(1 - np.arcsin(np.clip(-q, 1e-6, 1) ** (self.square / 2)) / np.pi, h)


def window(
    face: Surface, part: str, c: Coats, across: Span, up: Span, rounding: float = 0.25, frame: float = 0.012
) -> list[Piece]:
    """A framed pane between these u and h of a left wall, and its mirror image; the frame's width is in u."""
    (a, b), (low, high) = across, up
    pieces: list[Piece] = []
    for e, f, height, material in ((0.0, 0.0, 0.012, c.glass), (frame, 0.05, 0.006, c.black)):
        quad = [(a - e, low - f), (b + e, low - f), (b + e, high + f), (a - e, high + f)]
        pieces += pair(part, material, panel(face, quad, height, rounding, 6, 0.012, 3))
    return pieces


def eyebrow(trunk: Trunk, depth: float = 0.05, reach: float = 0.07) -> Solid:
    """A moulding around the roof's edge."""
    path = trunk.surface(trunk.columns(), 1.0) + np.array((0, 0, 0.01))
    return both_sides(along(path, bar(reach, depth, (0.1 * reach, 0.0), 0.3)))
