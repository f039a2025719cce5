"""Sailing boats: sloops and gaff cutters with keel, rudder, cabin and a full set of sails."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import Literal

import numpy as np

from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.paint import Color
from viewsphere_zoo.shapes.rods import rod, smooth
from viewsphere_zoo.shapes.sheets import bar, sheet
from viewsphere_zoo.shapes.solids import Float, Solid, both_sides, join, lathe, loft, moved, rounded_box, tube
from viewsphere_zoo.shipyard import fittings
from viewsphere_zoo.shipyard.cabin import Trunk, window
from viewsphere_zoo.shipyard.cloth import Cut
from viewsphere_zoo.shipyard.coats import TEAK, WHITE, Coats, coats
from viewsphere_zoo.shipyard.fittings import Flag
from viewsphere_zoo.shipyard.lines import Lines, Round
from viewsphere_zoo.shipyard.power import torpedo
from viewsphere_zoo.shipyard.rig import Rig, RigKind, rigged
from viewsphere_zoo.shipyard.shell import Deck, Opening, Paint, along, painted, pair, sheer_rail, skin

Keel = Literal["fin", "bulb", "long"]


@dataclass(frozen=True)
class SailingBoat:
    """Parameters of a sailing boat; lengths in metres, angles in degrees, colours sRGB 0..1.

    length, beam: of the hull; draft: keel below the water; mast: top of the mast above the water; freeboard: amidships;
    overhang: of the bow, lengths; tuck: breadth of the transom, fraction of the beam; cabin: height of the trunk's rear
    over the deck, 0 for none; windows: on each side of it; sheet: how far the boom is let out, lee 1 to port, -1 to
    starboard.
    """

    length: float = 8.0
    beam: float = 2.7
    draft: float = 1.25
    mast: float = 8.6
    freeboard: float = 0.85
    overhang: float = 0.1
    tuck: float = 0.66
    keel: Keel = "fin"
    rig: RigKind = "masthead"
    cabin: float = 0.42
    windows: int = 3
    sheet: float = 14.0
    lee: float = 1.0
    roach: float = 0.1
    rails: bool = True
    fenders: bool = False
    flag: Flag | None = None
    steering: Literal["tiller", "wheel"] = "tiller"
    wooden: bool = False
    planked_deck: bool = False
    sails: Cut = field(default_factory=Cut)
    jib: Cut = field(default_factory=Cut)
    color: Color = (0.1, 0.16, 0.33)
    bottom: Color = (0.55, 0.14, 0.1)
    boot: Color = WHITE
    stripe: Color = (0.85, 0.65, 0.25)
    deck: Color = (0.87, 0.85, 0.79)
    wood: Color = TEAK
    varnished: bool = False
    stripe_width: float = 0.045


def sailing_lines(p: SailingBoat) -> Lines:
    """The hull's lines."""
    f, d = p.freeboard, 0.062 * p.length
    classic = p.keel == "long"
    bow, aft = f * (1.38 if classic else 1.22), f * (1.1 if classic else 1.03)
    r = p.overhang
    return Lines(
        length=p.length,
        beam=p.beam,
        sheer=((0, bow), (0.3, f + 0.33 * (bow - f)), (0.66, f), (1, aft)),
        keel=((0, -0.08 * d), (0.12, -0.5 * d), (0.3, -0.92 * d), (0.48, -d), (0.75, -0.68 * d), (1, 0.28 * d)),
        stem=((0, r), (0.25, 0.62 * r), (0.6, 0.24 * r), (1, 0.0)),
        stern=((0, 0.05), (1, 0.0)) if classic else ((0, 0.0), (1, 0.035)),
        section=Round((0.2, 0.2, 0.6, 0.55), (0.62, 0.0, 1.02, 0.28), (0.5, 0.0, 0.97, 0.22)),
        widest=0.56,
        entry=(1.9, 1.0),
        quarter=(2.1, 1.0),
        tuck=p.tuck,
    )


def sailing_boat(p: SailingBoat) -> list[Piece]:
    """Return the pieces of a sailing boat in the ship's frame."""
    c = coats(p.color, p.bottom, p.boot, p.stripe, p.deck, p.wood, p.stripe, p.stripe, p.varnished, inside=(0.9, 0.89, 0.85))
    lines = sailing_lines(p)
    wide = (0.3 if p.cabin else 0.34) * p.beam
    floor = max(0.16, p.freeboard - 0.62)
    well = Opening(0.66 if p.cabin else 0.46, 0.93 if p.cabin else 0.9, wide, floor, 0.2, 7.0)
    deck = Deck(lines, 0.03 * p.beam, (well,))
    trunk = None
    if p.cabin:
        trunk = Trunk(deck, 0.29, 0.64, 0.36 * p.beam, 0.3, (0.55 * p.cabin, p.cabin), 0.12, (0.28, 0.0), 3.6, 0.06, 0.045)
    pieces = [*_hull(p, deck, c), *_below(p, lines, c), *_cockpit(p, deck, well, c)]
    if trunk:
        pieces += _cabin(p, trunk, c)
    y = 0.42 * p.length
    foot = trunk.top(y) if trunk else deck.at(y)
    boom = (0.4 if p.rig == "gaff" else 0.35) * p.length
    rig = Rig(
        deck,
        p.rig,
        foot,
        p.mast,
        float(foot[2]) + 0.03 * p.length + (0.32 if p.cabin else 0.5),
        boom,
        p.sheet,
        p.lee,
        roach=p.roach,
        wooden=p.wooden,
    )
    return [*pieces, *_outfit(p, deck, c), *rigged(rig, p.sails, p.jib, c)]


def _hull(p: SailingBoat, deck: Deck, c: Coats) -> list[Piece]:
    """Painted skin, deck, toe rail, well."""
    lines = deck.lines
    edge = (0.11, 0.11 + p.stripe_width) if p.stripe_width else None
    pieces = painted(lines, skin(deck), c, Paint(0.03, 0.05, edge))
    rail = sheer_rail(lines, bar(0.035, 0.06, (-0.012, 0.02), 0.25), 0.0, 0.998)
    strake = sheer_rail(lines, bar(0.04, 0.035, (0.004, -0.03), 0.3), 0.0, 0.998)
    walls, floor = deck.well(deck.openings[0])
    coaming = both_sides(along(deck.rim(deck.openings[0]), bar(0.045, 0.17, (0.005, 0.06), 0.3)))
    laid = p.planked_deck
    pieces += [
        Piece("toe_rail", c.wood, rail),
        Piece("rubbing_strake", c.wood if p.wooden else c.white, strake),
        Piece("deck", c.planks if laid else c.deck, deck.top()),
        Piece("cockpit", c.inside, walls),
        Piece("sole", c.planks, floor),
        Piece("coaming", c.wood if p.wooden else c.white, coaming),
    ]
    return pieces


def foil(levels: list[tuple[float, float, float, float]], count: int = 30) -> Solid:
    """A keel or rudder: (z, y of its leading edge, chord, thickness) from the tip up; sections like NACA 00xx."""
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    s = (1 - np.cos(angle)) / 2
    half = 5 * (0.2969 * np.sqrt(s) - 0.126 * s - 0.3516 * s**2 + 0.2843 * s**3 - 0.1015 * s**4) + 0.03 * s
    rings = [
        np.column_stack([-np.sign(np.sin(angle)) * half * t, y + s * chord, np.full(count, z)]) for z, y, chord, t in levels
    ]
    return loft(np.array(rings)[:, ::-1])


def _below(p: SailingBoat, lines: Lines, c: Coats) -> list[Piece]:
    """Keel, rudder, and the tiller or wheel's stock above it."""
    n, tip = p.length, -p.draft
    root = -0.035 * n
    deep = -0.062 * n
    if p.keel == "long":
        levels = [
            (tip, 0.4, 0.42, 0.12),
            (tip + 0.04, 0.39, 0.435, 0.16),
            (deep - 0.02, 0.3, 0.55, 0.17),
            (root + 0.02, 0.25, 0.6, 0.12),
        ]
        blade = [(tip + 0.06, 0.825, 0.11, 0.06), (deep, 0.855, 0.085, 0.06), (-0.005 * n, 0.88, 0.05, 0.05)]
    else:
        levels = [
            (tip + 0.01, 0.46, 0.13, 0.1),
            (tip + 0.05, 0.455, 0.14, 0.14),
            (deep, 0.41, 0.2, 0.16),
            (root, 0.4, 0.22, 0.2),
        ]
        low = 0.82 * tip
        blade = [
            (low, 0.878, 0.05, 0.04),
            (low + 0.03, 0.875, 0.058, 0.05),
            (-0.02 * n, 0.865, 0.085, 0.07),
            (0.012 * n, 0.865, 0.08, 0.06),
        ]
    keel, rudder = (foil([(z, y * n, chord * n, thick) for z, y, chord, thick in rows]) for rows in (levels, blade))
    pieces = [Piece("keel", c.bottom, keel), Piece("rudder", c.bottom, rudder)]
    if p.keel == "bulb":
        pieces.append(Piece("keel", c.bottom, torpedo(0.026 * n, 0.26 * n, (0, 0.53 * n, tip + 0.02 * n))))
    return pieces


def _cockpit(p: SailingBoat, deck: Deck, well: Opening, c: Coats) -> list[Piece]:
    """Benches along the sides, tiller or wheel, winches on the coaming."""
    lines = deck.lines
    s = np.linspace(0.03, 0.97, 16)
    t = well.start + s * (well.stop - well.start)
    y = lines.sheer_line(t)[:, 1]
    high = well.floor + 0.36
    outer = np.minimum(well.half(lines, t), deck.lines.half_at(y, high) - 0.04)
    inner = np.minimum(0.24, 0.5 * outer)
    x = inner + (outer - inner) * np.linspace(0, 1, 6)[:, None]
    seat = sheet(np.stack([x, np.broadcast_to(y, x.shape), np.full(x.shape, high)], axis=-1), 0.05)
    front = sheet(
        np.stack(
            [np.stack([inner, inner]), np.stack([y, y]), np.stack([np.full(16, high), np.full(16, well.floor - 0.01)])], axis=-1
        ),
        0.03,
    )
    pieces = [
        Piece("cockpit_seat", c.planks if p.wooden or p.planked_deck else c.white, both_sides(seat)),
        Piece("cockpit_seat", c.inside, both_sides(front)),
    ]
    k = 0.3 if p.cabin else 0.6
    at = deck.surface(
        float(well.half(lines, np.array(well.start + k * (well.stop - well.start)))) + 0.02,
        well.start + k * (well.stop - well.start),
    )
    winch = lathe(
        [
            (0, 0.0),
            (0.075, 0.0),
            (0.075, 0.02),
            (0.05, 0.045),
            (0.05, 0.09),
            (0.066, 0.11),
            (0.066, 0.135),
            (0.03, 0.14),
            (0, 0.14),
        ],
        20,
    )
    pieces += pair("winch", c.steel, moved(winch, at + np.array((0, 0, 0.14))))
    end = float(lines.sheer_line(well.stop)[1])
    if p.steering == "wheel":
        y0 = end - 0.55
        post = lathe(
            [(0, -0.01), (0.13, -0.01), (0.1, 0.03), (0.075, 0.1), (0.065, 0.72), (0.09, 0.8), (0.08, 0.9), (0, 0.93)], 20
        )
        pieces += fittings.wheel(0.4, c, (0, y0 + 0.16, well.floor + 0.78), (0, 1, 0.05), 5)
        return [*pieces, Piece("pedestal", c.white, moved(post, (0, y0, well.floor)))]
    head = deck.at(min(0.905, well.stop + 0.02) * p.length)
    y1 = end - 1.05 * min(1.0, p.length / 7)
    middle = (0.03 - head[0], 0.5 * (y1 + end - 0.2) - head[1], 0.24)
    grip = head + np.array([(0, 0.05, 0.13), (0, -0.25, 0.2), middle, (0.05 - head[0], y1 - head[1], 0.2)])
    tiller = tube(smooth(grip, 5), np.linspace(0.03, 0.018, 16), 10)
    foot = head + np.array((0, 0.04, -0.1))
    if foot[1] < end:  # in the cockpit, the stock comes up through its floor
        foot[2] = well.floor - 0.01
    stock = rod(foot, head + np.array((0, 0.04, 0.17)), 0.035, 12)
    return [*pieces, Piece("tiller", c.wood, tiller), Piece("rudder_stock", c.steel, stock)]


def _cabin(p: SailingBoat, trunk: Trunk, c: Coats) -> list[Piece]:
    """Trunk with windows, companionway, hatches, grab rails."""
    side = c.wood if p.wooden else c.white
    pieces = [Piece("cabin", side, trunk.walls()), Piece("cabin_roof", c.deck, trunk.roof())]
    panes = np.linspace(0.2, 0.87, p.windows + 1)
    for k, pair_ in enumerate(pairwise(panes.tolist())):
        name = "cabin_window" if p.windows == 1 else f"cabin_window_{k + 1}"
        a, b = trunk.spots(np.add(pair_, (0.025, -0.025)))
        pieces += window(trunk.surface, name, c, (a, b), (0.36, 0.76), 0.5 if p.wooden else 0.28)
    pieces += window(trunk.rear, "companionway", c, (-0.36, -0.03), (0.15, 0.95), 0.06, 0.03)
    aft = float(trunk.surface(1.0, 1.0)[1])
    lid = trunk.top(aft - 0.38) + np.array((0, 0, 0.008))
    pieces.append(Piece("hatch", c.wood if p.wooden else c.white, moved(rounded_box((0.62, 0.72, 0.07), 0.025, 2), lid)))
    fore = trunk.top(float(trunk.surface(0.0, 1.0)[1]) + 0.45) + np.array((0, 0, 0.004))
    pieces += [
        Piece("hatch", c.black, moved(rounded_box((0.5, 0.46, 0.05), 0.02, 2), fore)),
        Piece("hatch", c.glass, moved(rounded_box((0.41, 0.37, 0.03), 0.012, 2), fore + np.array((0, 0, 0.02)))),
    ]
    y = np.linspace(trunk.surface(0.3, 1.0)[1], aft - 0.25, 13)
    x = 0.75 * float(trunk.surface(0.5, 1.0)[0])
    base = np.array([trunk.top(float(k), min(x, 0.8 * _half(trunk, float(k)))) for k in y])
    posts = [rod(q - np.array((0, 0, 0.01)), q + np.array((0, 0, 0.05)), 0.013, 8) for q in base[1:-1:5]]
    grip = tube(base[1:-1] + np.array((0, 0, 0.05)), 0.016, 8)
    return [*pieces, Piece("grab_rail", c.wood, both_sides(join(grip, *posts)))]


def _half(trunk: Trunk, y: float) -> float:
    """Half width of the trunk's roof at y."""
    edge = trunk.surface(trunk.columns(), 1.0)
    return float(np.interp(y, edge[:, 1], edge[:, 0]))


def _outfit(p: SailingBoat, deck: Deck, c: Coats) -> list[Piece]:
    """Pulpit, lifelines, pushpit, cleats, lights, fenders, flag."""
    pieces = fittings.cleats(deck, c, (0.1, 0.95), 0.11)
    if p.rails:
        pieces += fittings.bow_rail(deck, c, 0.12, 0.52, True, 3)
        pieces += _lifelines(deck, c)
        pieces += fittings.side_lights(c, deck.surface(0.0, 0.02) + np.array((0, -0.02, 0.5)))
    if p.fenders:
        pieces += fittings.fenders(deck, c, (0.5, 0.72), c.white)
    if p.flag:
        x = float(deck.lines.half(0.985)) - 0.12
        at = deck.surface(-x, 0.975) + np.array((0, 0, -0.01))
        pieces += fittings.flag(at, c, p.flag)
    return pieces


def _lifelines(deck: Deck, c: Coats) -> list[Piece]:
    """Stanchions with two wires between pulpit and pushpit."""
    count = max(3, round(deck.lines.length * 0.72 / 1.5))
    t = np.linspace(0.115, 0.87, count)
    solids: list[Solid] = []
    feet, heads, middles = (fittings.edge_path(deck, t, 0.07, r) for r in (-0.01, 0.52, 0.27))
    solids += [rod(a, b, 0.0115, 8) for a, b in zip(feet[1:], heads[1:], strict=True)]
    fine = np.linspace(0.115, 0.87, 40)
    wires = [_straight(fittings.edge_path(deck, fine, 0.07, 0.0), row) for row in (heads, middles)]
    solids += [tube(w, 0.004, 6) for w in wires]
    s = np.linspace(0.87, 0.985, 8)
    pushpit: list[Solid] = []
    for rise, thick in ((0.52, 0.0125), (0.27, 0.0105)):
        left = fittings.edge_path(deck, s, 0.08, rise)
        corner = left[-1] * (0.86, 1, 1) + np.array((0, 0.04, 0))
        side = np.concatenate([left, [corner]])
        pushpit.append(tube(np.concatenate([side, side[::-1] * (-1.0, 1, 1)]), thick, 8))
    for k in (0.87, 0.93, 0.98):
        foot, head = (fittings.edge_path(deck, np.array([k]), 0.08, r)[0] for r in (-0.01, 0.52))
        pushpit += [rod(foot * (m, 1, 1), head * (m, 1, 1), 0.0115, 8) for m in (1, -1)]
    return [Piece("lifelines", c.steel, both_sides(join(*solids))), Piece("pushpit", c.steel, join(*pushpit))]


def _straight(shape: Float, posts: Float) -> Float:
    """A wire through the heads of the posts."""
    y = np.unique(np.concatenate([posts[:, 1], np.linspace(posts[0, 1], posts[-1, 1], len(shape))]))
    return np.stack([np.interp(y, posts[:, 1], posts[:, k]) for k in range(3)], axis=1)
