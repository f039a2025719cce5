"""Spars, wires and ropes."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.rods import between, rod, smooth, unit
from viewsphere_zoo.shapes.solids import Float, Solid, both_sides, join, lathe, moved, rounded_box, tube
from viewsphere_zoo.shipyard.cloth import Cut, Sail, dressed
from viewsphere_zoo.shipyard.coats import Coats
from viewsphere_zoo.shipyard.shell import Deck

RigKind = Literal["masthead", "fractional", "gaff"]


@dataclass(frozen=True, eq=False)
class Rig:
    """A mast with its sails, metres.

    foot: where the mast stands, (3,); head: z of its top; gooseneck: z of the boom; boom: its length; sheet: angle of the
    boom from the middle, degrees, towards lee (1 port, -1 starboard); rake: how far the mast leans aft over its height;
    wire: radius of the shrouds.
    """

    deck: Deck
    kind: RigKind
    foot: Float
    head: float
    gooseneck: float
    boom: float
    sheet: float
    lee: float
    rake: float = 0.02
    roach: float = 0.1
    wooden: bool = False
    wire: float = 0.004

    @property
    def length(self) -> float:
        """Length of the hull."""
        return self.deck.lines.length

    @property
    def radius(self) -> float:
        """Radius of the mast."""
        return (0.0098 if self.wooden else 0.0078) * self.length + 0.008

    def mast_at(self, z: float) -> Float:
        """The mast's middle at a height."""
        return np.array([0.0, self.foot[1] + self.rake * (z - self.foot[2]), z])

    @property
    def hounds(self) -> float:
        """z where forestay and shrouds meet the mast."""
        share = {"masthead": 0.985, "fractional": 0.86, "gaff": 0.93}[self.kind]
        return self.gooseneck + share * (self.head - self.gooseneck)

    @property
    def stem(self) -> Float:
        """The forestay's lower end."""
        if self.kind == "gaff":
            return self.deck.surface(0.0, 0.0) + np.array((0.0, -0.13 * self.length, 0.075))
        return self.deck.surface(0.0, 0.015) + np.array((0.0, 0.0, 0.03))

    def boom_end(self) -> Float:
        """The boom's outer end."""
        a = np.radians(self.sheet)
        aft = np.array([self.lee * np.sin(a), np.cos(a), 0.035])
        return self.mast_at(self.gooseneck) + aft * (self.boom + self.radius)

    def main(self) -> Sail:
        """The mainsail."""
        step = np.array([0.0, 1.25 * self.radius, 0.0])
        tack = self.mast_at(self.gooseneck + 0.09) + step
        clew = between(self.mast_at(self.gooseneck), self.boom_end(), 0.97) + np.array((0, 0, 0.075))
        if self.kind == "gaff":
            throat = self.mast_at(self.gooseneck + 0.6 * (self.head - self.gooseneck)) + step
            peak = self.peak() - np.array((0, 0, 0.05))
            return Sail(tack, throat, clew, peak, self.lee, 0.09, 0.01, 0.05)
        throat = self.mast_at(self.head - 0.03 * self.length) + step
        peak = throat + np.array((0.3 * self.lee, 1.0, 0.0)) * 0.04 * self.boom
        return Sail(tack, throat, clew, peak, self.lee, 0.1, self.roach, 0.06)

    def peak(self) -> Float:
        """The outer end of the gaff."""
        a = np.radians(self.sheet + 7)
        reach = 0.74 * self.boom
        throat = self.mast_at(self.gooseneck + 0.6 * (self.head - self.gooseneck))
        return throat + np.array([self.lee * np.sin(a) * reach * 0.6, np.cos(a) * reach * 0.6, 0.8 * reach])

    def jib(self) -> Sail:
        """The headsail."""
        top = self.mast_at(self.hounds) - np.array((0, self.radius, 0))
        tack, throat = between(self.stem, top, 0.04), between(self.stem, top, 0.93)
        half = float(self.deck.lines.half(self.deck.lines.at_y(float(self.foot[1]))))
        clew = self.deck.at(float(self.foot[1]) - 0.022 * self.length) + np.array(
            (self.lee * 0.52 * half, 0, 0.07 * self.length)
        )
        peak = throat + np.array((0.3 * self.lee, 1.0, -0.02)) * 0.02 * self.length
        return Sail(tack, throat, clew, peak, self.lee, 0.1, -0.05, 0.05)


def rigged(rig: Rig, look: Cut, jib_look: Cut, c: Coats) -> list[Piece]:
    """Spars, standing and running rigging, sails."""
    return [
        *_spars(rig, c),
        *_standing(rig, c),
        *_running(rig, c),
        *dressed(rig.main(), "mainsail", look, True),
        *dressed(rig.jib(), "jib", jib_look, False),
    ]


def _spars(rig: Rig, c: Coats) -> list[Piece]:
    """Mast and boom, for a gaff rig also gaff and bowsprit."""
    spar = c.wood if rig.wooden else c.alloy
    r = rig.radius
    z = rig.foot[2] + np.array([-0.05, 0.0, 0.5, 0.8, 0.95, 1.0]) * (rig.head - rig.foot[2])
    mast = tube([rig.mast_at(k) for k in z.tolist()], r * np.array([1, 1, 1, 0.92, 0.72, 0.62]), 16)
    goose = rig.mast_at(rig.gooseneck)
    boom = tube([goose, between(goose, rig.boom_end(), 0.5), rig.boom_end()], r * np.array([0.72, 0.8, 0.66]), 14)
    collar = moved(
        lathe([(0.9 * r, -0.02), (1.9 * r, -0.02), (1.7 * r, 0.03), (1.05 * r, 0.05), (0.9 * r, 0.05)], 18), rig.foot
    )
    pieces = [Piece("mast", spar, mast), Piece("mast_step", c.steel, collar), Piece("boom", spar, boom)]
    top = rig.mast_at(rig.head)
    vane = join(
        rod(top, top + np.array((0, 0, 0.22)), 0.006, 6),
        rod(top + np.array((0, -0.14, 0.2)), top + np.array((0, 0.16, 0.2)), 0.006, 6),
    )
    crane = moved(rounded_box((1.4 * r, 4.2 * r, 0.05), 0.012, 2), top + np.array((0, 0.6 * r, -0.02)))
    pieces += [Piece("masthead", c.steel if not rig.wooden else c.bronze, crane), Piece("wind_vane", c.black, vane)]
    if rig.kind != "gaff":
        return pieces
    throat = rig.mast_at(rig.gooseneck + 0.6 * (rig.head - rig.gooseneck) + 0.05)
    gaff = tube([throat, between(throat, rig.peak(), 0.5), rig.peak()], r * np.array([0.62, 0.66, 0.45]), 12)
    heel = rig.deck.at(0.16 * rig.length) + np.array((0, 0, 0.05))
    sprit = tube([heel, between(heel, rig.stem, 0.7), rig.stem - np.array((0, 0.08, 0))], r * np.array([0.95, 0.9, 0.6]), 14)
    return [*pieces, Piece("gaff", spar, gaff), Piece("bowsprit", spar, sprit)]


def _standing(rig: Rig, c: Coats) -> list[Piece]:
    """Forestay, shrouds over spreaders, backstay."""
    w, lines = rig.wire, rig.deck.lines
    hounds = rig.mast_at(rig.hounds)
    pieces = [Piece("forestay", c.steel, rod(rig.stem, hounds - np.array((0, rig.radius, 0)), 1.2 * w, 8))]
    drum = lathe(
        [(0.01, 0.0), (0.07, 0.0), (0.07, 0.015), (0.035, 0.03), (0.035, 0.1), (0.07, 0.115), (0.07, 0.13), (0.01, 0.13)], 16
    )
    if rig.kind != "gaff":
        pieces.append(Piece("furler", c.black, moved(drum, rig.stem)))
    else:
        waterline = lines.point(0.0, lines.level(0.0, 0.12)) - np.array((0, 0.01, 0))
        pieces.append(Piece("bobstay", c.steel, rod(rig.stem - np.array((0, 0.02, 0)), waterline, 1.3 * w, 8)))
    y = float(rig.foot[1]) + 0.02 * rig.length
    t = lines.at_y(y)
    plate = rig.deck.surface(float(lines.half(t)) - 0.05, t)
    spread = {"masthead": (0.52,), "fractional": (0.5,), "gaff": ()}[rig.kind]
    if rig.head - rig.gooseneck > 8.5:
        spread = (0.37, 0.7)[: 2 * len(spread)]
    wires, spreaders = _shrouds(rig, plate, spread)
    pieces.append(Piece("shrouds", c.steel, both_sides(join(*wires))))
    if spreaders:
        pieces.append(Piece("spreaders", c.wood if rig.wooden else c.alloy, both_sides(join(*spreaders))))
        end = rig.deck.surface(0.0, 0.99)
        top = rig.mast_at(rig.head - 0.03) + np.array((0, 2.2 * rig.radius, 0))
        pieces.append(Piece("backstay", c.steel, rod(end, top, 1.1 * w, 8)))
    return pieces


def _shrouds(rig: Rig, plate: Float, spread: tuple[float, ...]) -> tuple[list[Solid], list[Solid]]:
    """Wires and spreaders of the left side, `spread` up the mast."""
    w = rig.wire
    hounds = rig.mast_at(rig.hounds)
    span = rig.hounds - float(plate[2])
    points, wires, spreaders = [plate], [], []
    for k, share in enumerate(spread):
        root = rig.mast_at(float(plate[2]) + share * span)
        tip = root + np.array((float(plate[0]) * (0.62 - 0.12 * k), 0.012 * rig.length, 0.02))
        spreaders.append(tube([root, between(root, tip, 0.5), tip], np.array([0.026, 0.024, 0.014]), 10))
        points.append(tip)
        wires.append(rod(points[-2] if k else plate + np.array((-0.04, 0.1, 0)), root - np.array((0, 0, 0.05)), w, 8))
    points.append(hounds + np.array((0.6 * rig.radius, 0, 0)))
    wires += [rod(a, b, w, 8) for a, b in pairwise(points)]
    starts = [(plate, points[1])]
    if not spread:
        second = plate + np.array((0.0, 0.05 * rig.length, 0.0))
        wires.append(rod(second, points[-1], w, 8))
        starts.append((second, points[-1]))
    for low, high in starts:
        a = unit(high - low)
        wires.append(rod(low, low + 0.22 * a, 2.2 * w, 8))
    return wires, spreaders


def _running(rig: Rig, c: Coats) -> list[Piece]:
    """Mainsheet, kicker, jib sheets, halyards, topping lift."""
    lines = rig.deck.lines
    end, goose = rig.boom_end(), rig.mast_at(rig.gooseneck)
    hold = between(goose, end, 0.86) - np.array((0, 0, 0.5 * rig.radius))
    well = rig.deck.openings[-1]
    anchor = np.array([0.0, min(float(hold[1]) - 0.02, 0.97 * float(lines.sheer_line(well.stop)[1])), well.floor])
    falls = [rod(hold + np.array((0, d, 0)), anchor + np.array((1.6 * d, 0, 0)), 0.007, 6) for d in (-0.03, 0.03)]
    blocks = [
        moved(rounded_box((0.03, 0.05, 0.1), 0.012, 2), p)
        for p in (hold - np.array((0, 0, 0.04)), anchor + np.array((0, 0, 0.04)))
    ]
    kicker = rod(rig.mast_at(rig.foot[2] + 0.12), between(goose, end, 0.26), 0.012, 8)
    sail = rig.jib()
    side = float(lines.half(lines.at_y(float(rig.foot[1]) + 0.12 * rig.length)))
    lead = rig.deck.at(float(rig.foot[1]) + 0.12 * rig.length, rig.lee * 0.8 * side, 0.03)
    lazy = rig.deck.at(float(rig.foot[1]) + 0.12 * rig.length, -rig.lee * 0.8 * side, 0.03)
    around = rig.mast_at(float(sail.clew[2]) - 0.12) - np.array((rig.lee * 0.02, 1.6 * rig.radius, 0))
    sheets = [rod(sail.clew, lead, 0.007, 6), tube(smooth([sail.clew, around, lazy], 6), 0.007, 6)]
    lift = rod(end - np.array((0, 0.02, 0)), rig.mast_at(rig.head - 0.04) + np.array((0, 1.4 * rig.radius, 0)), 0.0035, 6)
    halyards = [
        rod(
            rig.mast_at(rig.foot[2] + 0.08) + np.array((s * 1.12 * rig.radius, 0, 0)),
            rig.mast_at(rig.hounds) + np.array((s * 0.8 * rig.radius, 0, 0)),
            0.005,
            6,
        )
        for s in (1, -1)
    ]
    return [
        Piece("mainsheet", c.rope, join(*falls)),
        Piece("mainsheet", c.black, join(*blocks)),
        Piece("kicker", c.rope, kicker),
        Piece("sheets", c.rope, join(*sheets)),
        Piece("halyards", c.rope, join(lift, *halyards) if rig.kind != "gaff" else join(*halyards)),
    ]
