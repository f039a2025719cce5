"""Skin, transom, deck with its wells, and rails along the sheer."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from viewsphere.assets.mesh import Material
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.cut import cut
from viewsphere_zoo.shapes.sheets import moulding
from viewsphere_zoo.shapes.solids import Float, Solid, both_sides, flipped, grid, join, mirrored
from viewsphere_zoo.shipyard.coats import Coats
from viewsphere_zoo.shipyard.lines import Lines, stations

UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Paint:
    """The borders between colours, metres.
    bottom: z of the antifouling's upper edge.
    boot: width of the stripe above it.
    stripe: depth of the sheer stripe's edges below the sheer, or None.
    """

    bottom: float = 0.03
    boot: float = 0.05
    stripe: tuple[float, float] | None = None


def pair(part: str, material: Material, solid: Solid) -> list[Piece]:
    """A piece on the left and its mirror image on the right."""
    return [Piece(f"{part}_left", material, solid), Piece(f"{part}_right", material, mirrored(solid))]


def painted(lines: Lines, solid: Solid, c: Coats, paint: Paint) -> list[Piece]:
    """The solid in the hull's colours."""
    z = solid.vertices[:, 2]
    low, rest = cut(solid, z - paint.bottom)
    bands, side = [("antifouling", c.bottom, low)], rest
    if paint.boot:
        boot, side = cut(rest, rest.vertices[:, 2] - paint.bottom - paint.boot)
        bands.append(("boot_stripe", c.boot, boot))
    if paint.stripe:
        below, rest = cut(side, _below_sheer(lines, side) + paint.stripe[1])
        stripe, above = cut(rest, _below_sheer(lines, rest) + paint.stripe[0])
        bands += [("hull", c.hull, below), ("sheer_stripe", c.stripe, stripe), ("hull", c.hull, above)]
    else:
        bands.append(("hull", c.hull, side))
    return [Piece(part, material, s) for part, material, s in bands if len(s.triangles)]


def _below_sheer(lines: Lines, solid: Solid) -> Float:
    """Heights of the vertices over the sheer, negative below it."""
    edge = lines.sheer_line(np.linspace(0, 1, 101))
    return solid.vertices[:, 2] - np.interp(solid.vertices[:, 1], edge[:, 1], edge[:, 2])


@dataclass(frozen=True)
class Opening:
    """A well in the deck: from t = start to stop, at most 2 `width` wide, `margin` within the sheer, with its floor at
    z = floor; square: the exponent of its outline."""

    start: float
    stop: float
    width: float
    floor: float
    margin: float = 0.15
    square: float = 9.0

    def share(self) -> Float:
        """Columns from 0 to 1, closer in the corners."""
        angle = np.linspace(0, 0.42 * np.pi, 12)
        end = (1 - np.cos(angle) ** (2 / self.square)) / 2
        return np.unique(np.concatenate([end, 1 - end, np.linspace(end[-1], 1 - end[-1], 14)]).round(9))

    def half(self, lines: Lines, t: Float) -> Float:
        """Half width at t, 0 outside."""
        s = (t - self.start) / (self.stop - self.start)
        bow = np.clip(1 - np.abs(2 * s - 1) ** self.square, 0, 1) ** (1 / self.square)
        return np.where((s >= 0) & (s <= 1), np.clip(np.minimum(self.width, lines.half(t) - self.margin), 0, None) * bow, 0.0)


@dataclass(frozen=True, eq=False)
class Deck:
    """The deck between the sheers; camber: its rise over the beam, metres at the widest place."""

    lines: Lines
    camber: float = 0.06
    openings: tuple[Opening, ...] = ()

    def height(self, t: ArrayLike, x: ArrayLike) -> Float:
        """z of the deck at t and x."""
        half = np.maximum(self.lines.half(t), 1e-6)
        across = np.clip(np.asarray(x, np.float64) / half, -1, 1)
        return self.lines.sheer_line(t)[..., 2] + self.camber * 2 * half / self.lines.beam * (1 - across**2)

    def surface(self, x: ArrayLike, t: ArrayLike) -> Float:
        """Points (..., 3); outside is d/dx x d/dt."""
        x, t = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(t, np.float64))
        return np.stack([x, self.lines.sheer_line(t)[..., 1], self.height(t, x)], axis=-1)

    def at(self, y: float, x: float = 0.0, rise: float = 0.0) -> Float:
        """The point of the deck at y and x, (3,), `rise` above it."""
        return np.add(self.surface(x, self.lines.at_y(y)), (0, 0, rise))

    @cached_property
    def columns(self) -> Float:
        """The deck's t."""
        wells = [o.start + o.share() * (o.stop - o.start) for o in self.openings]
        free = stations(44)
        for o in self.openings:
            free = free[(free < o.start - 0.004) | (free > o.stop + 0.004)]
        return np.sort(np.concatenate([free, *wells]))

    def top(self, steps: int = 6) -> Solid:
        """Both halves of the deck, without the openings."""
        t = self.columns
        inner = np.sum([o.half(self.lines, t) for o in self.openings], axis=0) if self.openings else np.zeros(len(t))
        x = inner + (self.lines.half(t) - inner) * np.linspace(0, 1, steps + 1)[:, None]
        return both_sides(grid(self.surface(x, np.broadcast_to(t, x.shape))))

    def rim(self, opening: Opening) -> Float:
        """The left edge of an opening, from its front to its rear, (N, 3)."""
        t = opening.start + opening.share() * (opening.stop - opening.start)
        return self.surface(opening.half(self.lines, t), t)

    def well(self, opening: Opening, steps: int = 4) -> tuple[Solid, Solid]:
        """Walls and floor of an opening."""
        rim = self.rim(opening)
        foot = self.lines.within(rim, opening.floor, 0.05)
        share = np.linspace(0, 1, steps + 1)[:, None]
        walls = flipped(grid(foot[:, None] + (rim - foot)[:, None] * share))
        middle = foot * (0.0, 1.0, 1.0)
        floor = grid(np.stack([middle, foot]))
        return both_sides(walls), both_sides(floor)


def skin(deck: Deck, columns: int = 56, rows: int = 22) -> Solid:
    """Both sides of a decked hull and the transom, up to the deck."""
    lines, v = deck.lines, np.linspace(0, 1, rows)
    side = both_sides(grid(lines.point(stations(columns)[:, None], v)))
    edge = lines.point(1.0, v)
    share = np.linspace(-1, 1, 13)
    points = np.repeat(edge[:, None], len(share), axis=1)
    points[..., 0] *= share
    return join(side, grid(np.concatenate([points, deck.surface(edge[-1, 0] * share, 1.0)[None]])))


def along(path: Float, profile: Float) -> Solid:
    """A profile (outwards, up) led along a path on the left side that runs aft."""
    tangent = np.gradient(path, axis=0)
    return moulding(path, profile, np.cross(tangent, UP))


def sheer_rail(lines: Lines, profile: Float, start: float = 0.0, stop: float = 1.0, count: int = 50) -> Solid:
    """A moulding along both sheers."""
    return both_sides(along(lines.sheer_line(start + (stop - start) * stations(count)), profile))


def backbone(lines: Lines, profile: Float, start: float = 0.0, stop: float = 1.0, rise: float = 0.04) -> Solid:
    """A timber along the stem, down from `rise` above its head, and the keel; its profile is (across, inwards)."""
    stem = lines.point(0.0, np.linspace(1, 0, 16))
    head = stem[0] + (stem[0] - stem[1]) / np.linalg.norm(stem[0] - stem[1]) * rise
    keel = lines.point(stations(40)[1:] * (stop - start) + start, 0.0)
    return moulding(np.concatenate([[head], stem, keel]), profile, (1.0, 0, 0))
