"""A cabinet's box of boards, and the fronts of its bays: doors, drawers, open bays."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material
from viewsphere_zoo.furnishing.casework import Pull, block, front, handles, pull
from viewsphere_zoo.furnishing.coats import Timber
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.paint import linear
from viewsphere_zoo.shapes.solids import Solid, join, moved, turned

Kind = Literal["door", "pair", "drawer", "open"]
Column = tuple[tuple[float, Kind], ...]
"""The bays of a column from below: the share of the height and the front of each."""

BOARD = 0.018
"""Thickness of boards, metres."""

HARDBOARD = Material("hardboard", linear((0.66, 0.53, 0.39)), roughness=0.85)


@dataclass(frozen=True)
class Carcass:
    """The box: half width, front and rear (y), bottom and top (z), columns of bays, equally wide.

    frame: width of the frame around a door's panel, 0 for flat fronts; ajar: by how many degrees its last door stands open;
    pulled: by how much its last drawer is pulled out, metres; rails: open above except for two rails, so that a basin can hang
    in it.
    """

    half: float
    depth: float
    low: float
    high: float
    columns: tuple[Column, ...]
    frame: float = 0.0
    pull: Pull = "bar"
    ajar: float = 0.0
    pulled: float = 0.0
    rails: bool = False

    @property
    def bays(self) -> Iterator[tuple[float, float, float, float, Kind, int]]:
        """Inner x range, z range, front and number of all bays: columns from -X to +X, each from below."""
        edges = np.linspace(-self.half, self.half, len(self.columns) + 1).tolist()
        number = 0
        for x0, x1, column in zip(edges[:-1], edges[1:], self.columns, strict=True):
            z = self.low
            for share, kind in column:
                top = z + share * (self.high - self.low) / sum(s for s, _ in column)
                yield x0 + BOARD / 2, x1 - BOARD / 2, z + BOARD / 2, top - BOARD / 2, kind, number
                z, number = top, number + 1

    @property
    def face(self) -> float:
        """y of the front edge of the boards; the fronts are in front of it."""
        return -self.depth / 2 + BOARD


def carcass(c: Carcass, timber: Timber) -> list[Piece]:
    """Sides, bottom, top, partitions, rear."""
    x, rear, t = c.half, c.depth / 2, BOARD
    edges = np.linspace(-x, x, len(c.columns) + 1).tolist()
    sides = [block((-x, c.face, c.low), (-x + t, rear, c.high)), block((x - t, c.face, c.low), (x, rear, c.high))]
    inner = [block((e - t / 2, c.face + 0.002, c.low), (e + t / 2, rear - 0.006, c.high)) for e in edges[1:-1]]
    level = [block((-x + t, c.face, z), (x - t, rear - 0.006, z + t)) for z in (c.low, c.high - t)]
    if c.rails:
        level[1:] = [
            block((-x + t, a, c.high - t), (x - t, b, c.high))
            for a, b in ((c.face, c.face + 0.07), (rear - 0.07, rear - 0.006))
        ]
    tops = {(x0, x1, round(z1 + t / 2, 6)) for x0, x1, _, z1, _, _ in c.bays if z1 < c.high - t}
    level += [block((x0, c.face + 0.002, z - t / 2), (x1, rear - 0.006, z + t / 2)) for x0, x1, z in sorted(tops)]
    level += [
        block((x0, c.face + 0.03, z0 + f * (z1 - z0)), (x1, rear - 0.006, z0 + f * (z1 - z0) + t))
        for x0, x1, z0, z1, kind, _ in c.bays
        if kind in ("door", "pair") and z1 - z0 > 0.45
        for f in ((0.5,) if z1 - z0 < 1.0 else (0.84,))
    ]
    panel = block((-x + 0.006, rear - 0.006, c.low + 0.004), (x - 0.006, rear - 0.002, c.high - 0.004), 0.001)
    battens = [block((e - 0.02, rear - 0.003, c.low), (e + 0.02, rear + 0.006, c.high), 0.001) for e in edges[1:-1]]
    battens += [
        block((-x + 0.01, rear - 0.003, z), (x - 0.01, rear + 0.006, z + 0.05), 0.001) for z in (c.low + 0.004, c.high - 0.06)
    ]
    return [
        Piece("side", timber.upright, join(*sides, *inner)),
        Piece("carcass", timber.along, join(*level)),
        Piece("back", HARDBOARD, panel),
        Piece("back", timber.along, join(*battens)),
    ]


def fronts(c: Carcass, timber: Timber, coat: Material) -> list[Piece]:
    """Doors and drawers with their handles; the last of each is open if `ajar` or `pulled` is set."""
    bays = list(c.bays)
    doors = [n for *_, kind, n in bays if kind in ("door", "pair")]
    drawers = [n for *_, kind, n in bays if kind == "drawer"]
    found: list[Piece] = []
    for x0, x1, z0, z1, kind, number in bays:
        low, high = (x0 - 0.0065, z0 - 0.0065), (x1 + 0.0065, z1 + 0.0065)
        if kind == "drawer":
            out = c.pulled if drawers and number == drawers[-1] else 0.0
            found += _drawer(c, low, high, timber, coat, out)
        elif kind != "open":
            ajar = np.radians(c.ajar) if number == doors[-1] else 0.0
            middle = (low[0] + high[0]) / 2
            leaves = (
                [(low[0], high[0], -1)] if kind == "door" else [(low[0], middle - 0.0015, -1), (middle + 0.0015, high[0], 1)]
            )
            for a, b, hinge in leaves:
                open_ = ajar if hinge > 0 or kind == "door" else 0.0
                found += _door(c, (a, low[1]), (b, high[1]), hinge, timber, coat, open_)
    return found


def _door(
    c: Carcass, low: tuple[float, float], high: tuple[float, float], hinge: int, timber: Timber, coat: Material, ajar: float
) -> list[Piece]:
    """A door; hinge: the side of its hinges, -1 or 1 along x; ajar in radians."""
    y = -c.depth / 2
    pieces = front(low, high, y, timber.upright, "door", c.frame, BOARD)
    tall = high[1] - low[1]
    x = high[0] - 0.035 if hinge < 0 else low[0] + 0.035
    z = low[1] + (0.5 if tall > 1.0 else 0.78) * tall
    if c.pull == "cup":
        pieces += handles("handle", coat, [pull("knob", (x, y, z), 0.0)])
    else:
        pieces += handles("handle", coat, [pull(c.pull, (x, y, z), min(0.16, 0.4 * tall), True)])
    at = np.array((low[0] if hinge < 0 else high[0], y + BOARD / 2, 0.0))
    return [Piece(q.part, q.material, moved(turned(moved(q.solid, -at), 2, hinge * ajar), at)) for q in pieces]


def _drawer(
    c: Carcass, low: tuple[float, float], high: tuple[float, float], timber: Timber, coat: Material, out: float
) -> list[Piece]:
    """A drawer's front, with its box if it is pulled out."""
    y, wide, tall = -c.depth / 2, high[0] - low[0], high[1] - low[1]
    pieces = front(low, high, y, timber.along, "drawer", c.frame if tall > 0.18 else 0.0, BOARD)
    z = low[1] + 0.55 * tall
    at = [low[0] + f * wide for f in ((0.5,) if wide < 0.62 or c.pull == "rail" else (0.25, 0.75))]
    pieces += handles("handle", coat, [pull(c.pull, (x, y, z), min(0.16, 0.35 * wide)) for x in at])
    if out:
        box = _box((low[0] + 0.02, y + BOARD, low[1] + 0.02), (high[0] - 0.02, c.depth / 2 - 0.05, high[1] - 0.04))
        pieces.append(Piece("drawer", timber.along, box))
    return [Piece(q.part, q.material, moved(q.solid, (0, -out, 0))) for q in pieces]


def _box(low: tuple[float, float, float], high: tuple[float, float, float]) -> Solid:
    """An open box of thin boards."""
    (x0, y0, z0), (x1, y1, z1), t = low, high, 0.012
    return join(
        block((x0, y0, z0), (x1, y1, z0 + t), 0.001),
        block((x0, y0, z0), (x0 + t, y1, z1), 0.001),
        block((x1 - t, y0, z0), (x1, y1, z1), 0.001),
        block((x0, y1 - t, z0), (x1, y1, z1), 0.001),
    )
