"""Motor boats: runabouts, centre consoles and cabin cruisers on a planing hull with chines."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.paint import Color
from viewsphere_zoo.shapes.rods import rod, smooth
from viewsphere_zoo.shapes.sheets import bar, sheet
from viewsphere_zoo.shapes.solids import Float, Solid, both_sides, join, lathe, moved, rounded_box, tube, turned
from viewsphere_zoo.shipyard import fittings
from viewsphere_zoo.shipyard.cabin import Trunk, eyebrow, window
from viewsphere_zoo.shipyard.coats import TEAK, WHITE, Coats, coats
from viewsphere_zoo.shipyard.fittings import Flag
from viewsphere_zoo.shipyard.lines import Chine, Lines, stations
from viewsphere_zoo.shipyard.power import outboard, stacked, stern_drive
from viewsphere_zoo.shipyard.shell import Deck, Opening, Paint, along, painted, sheer_rail, skin

Style = Literal["runabout", "console", "cruiser"]
Drive = Literal["outboard", "stern_drive"]


@dataclass(frozen=True)
class MotorBoat:
    """Parameters of a motor boat; lengths in metres, colours sRGB 0..1.

    length, beam: of the hull; freeboard: sheer above the water amidships; spring: how much higher the bow is, fraction;
    flare: how hollow the bow's sides are; stem_rake: overhang of the bow, lengths; cockpit: where the well begins (t);
    screen: height of the windscreen; bow_seats: a second well ahead of the cockpit; cuddy: a low cabin in its stead; top:
    canopy over console or cockpit; house: where the wheelhouse begins (t), with its height, the rake of its front and windows
    on a side.
    """

    style: Style = "runabout"
    length: float = 6.0
    beam: float = 2.3
    freeboard: float = 0.74
    spring: float = 0.28
    flare: float = 0.75
    stem_rake: float = 0.17
    cockpit: float = 0.42
    screen: float = 0.42
    drive: Drive = "outboard"
    engines: int = 1
    bow_seats: bool = False
    top: bool = False
    rail: bool = True
    cuddy: bool = False
    house: float = 0.37
    house_height: float = 1.28
    house_rake: float = 0.5
    windows: int = 2
    fenders: bool = False
    flag: Flag | None = None
    planked_deck: bool = False
    color: Color = WHITE
    bottom: Color = (0.1, 0.13, 0.2)
    boot: Color = (0.1, 0.2, 0.45)
    stripe: Color = (0.1, 0.2, 0.45)
    deck: Color = (0.88, 0.87, 0.83)
    cushion: Color = (0.92, 0.9, 0.85)
    accent: Color = (0.1, 0.12, 0.2)
    wood: Color = TEAK
    varnished: bool = False
    stripe_width: float = 0.1


def motor_lines(p: MotorBoat) -> Lines:
    """The hull's lines."""
    f, bow, d = p.freeboard, p.freeboard * (1 + p.spring), 0.05 * p.length
    r = p.stem_rake
    return Lines(
        length=p.length,
        beam=p.beam,
        sheer=((0, bow), (0.3, f + 0.5 * (bow - f)), (0.7, f), (1, 0.95 * f)),
        keel=((0, -0.1 * d), (0.1, -0.5 * d), (0.3, -0.93 * d), (0.5, -d), (1, -0.94 * d)),
        stem=((0, r), (0.4, 0.48 * r), (0.75, 0.16 * r), (1, 0.0)),
        stern=((0, 0.025), (1, 0.0)),
        section=Chine(fore=(0.3, 0.52, p.flare), middle=(0.85, 0.36, 0.4 * p.flare), aft=(0.9, 0.28, -0.1)),
        widest=0.6,
        entry=(2.3, 0.86),
        quarter=(2.2, 1.0),
        tuck=0.88,
    )


def motor_boat(p: MotorBoat) -> list[Piece]:
    """Return the pieces of a motor boat in the ship's frame."""
    c = coats(p.color, p.bottom, p.boot, p.stripe, p.deck, p.wood, p.cushion, p.accent, p.varnished)
    lines = motor_lines(p)
    deck = Deck(lines, 0.035 * p.beam, _openings(p))
    inside = {"runabout": _runabout, "console": _console, "cruiser": _cruiser}[p.style]
    pieces = [*_hull(p, deck, c), *inside(p, deck, c), *_outfit(p, deck, c)]
    if p.drive == "stern_drive":
        return pieces + stern_drive(lines, c)
    at = lines.point(1.0, lines.level(1.0, 0.3 + 0.03 * p.length)) * (0, 1, 1)
    size = 0.72 + 0.05 * p.length
    leg = float(at[2] - lines.point(1.0, 0.0)[2]) + 0.02
    for x in ((0.0,), (-0.27 * size, 0.27 * size))[p.engines - 1]:
        pieces += outboard(c, at + np.array((x, 0, 0)), leg, size)
    return pieces


def _openings(p: MotorBoat) -> tuple[Opening, ...]:
    """The wells of the style."""
    floor = 0.07
    if p.style == "console":
        return (Opening(0.13, 0.93, 0.46 * p.beam, floor, 0.14, 7.0),)
    if p.style == "cruiser":
        return (Opening(0.66, 0.95, 0.4 * p.beam, floor + 0.08, 0.17, 12.0),)
    cockpit = Opening(p.cockpit + 0.02, 0.93, 0.42 * p.beam, floor, 0.15, 8.0)
    bow = Opening(0.1, p.cockpit - 0.06, 0.36 * p.beam, floor + 0.16, 0.2, 4.0)
    return (bow, cockpit) if p.bow_seats else (cockpit,)


def _hull(p: MotorBoat, deck: Deck, c: Coats) -> list[Piece]:
    """Painted skin, spray rails, rubbing strake, deck and wells."""
    lines = deck.lines
    edge = (0.1, 0.1 + p.stripe_width) if p.stripe_width else None
    pieces = painted(lines, skin(deck), c, Paint(0.02, 0.05, edge))
    t = 0.06 + 0.935 * stations(44)
    spray = both_sides(along(lines.point(t, 0.5), bar(0.06, 0.022, (0.0, 0.0), 0.3)))
    strake = sheer_rail(lines, bar(0.06, 0.06, (0.008, -0.026), 0.3), 0.0, 0.999)
    steel = sheer_rail(lines, bar(0.02, 0.018, (0.038, -0.026), 0.3), 0.002, 0.997)
    pieces += [
        Piece("spray_rail", c.hull, spray),
        Piece("rubbing_strake", c.wood if p.varnished else c.black, strake),
        Piece("rubbing_strake", c.steel, steel),
        Piece("deck", c.planks if p.planked_deck else c.deck, deck.top()),
    ]
    if p.planked_deck:
        pieces.append(Piece("deck_seams", c.rope, join(*_seams(deck))))
    for opening in deck.openings:
        walls, floor = deck.well(opening)
        coaming = both_sides(along(deck.rim(opening), bar(0.05, 0.045, (0.005, 0.008), 0.35)))
        pieces += [
            Piece("cockpit", c.inside, walls),
            Piece("sole", c.planks if p.planked_deck or p.style != "console" else c.deck, floor),
            Piece("coaming", c.wood if p.varnished else c.white, coaming),
        ]
    return pieces


def _seams(deck: Deck) -> list[Solid]:
    """Caulking between the planks of the foredeck."""
    first = deck.openings[0].start - 0.01
    seams: list[Solid] = []
    for k in range(-9, 10):
        x = 0.09 * k
        t = np.linspace(0.005, first, 30)
        t = t[deck.lines.half(t) > abs(x) + 0.06]
        if len(t) > 2:
            seams.append(sheet(np.stack([deck.surface(x + s, t) for s in (-0.004, 0.004)]), 0.004))
    return seams


def windscreen(deck: Deck, c: Coats, front: float, rear: float, height: float, margin: float) -> list[Piece]:
    """A raked screen that wraps around from t = rear over the middle at t = front; glass, frame, posts."""

    def surface(u: Float, h: Float) -> Float:
        sine, cosine = np.sin(np.pi / 2 * u), np.cos(np.pi / 2 * u)
        t = front + (rear - front) * (1 - np.abs(cosine) ** 0.5)
        half = np.maximum(deck.lines.half(t) - margin, 0.1)
        x = half * np.sign(sine) * np.abs(sine) ** 0.62
        foot = deck.surface(x, t)
        tall = height * (1 - 0.35 * np.abs(u) ** 3)
        lean = np.stack([-0.16 * x * h, 0.75 * tall * h * (1 - 0.3 * u**2), tall * h - 0.015], axis=-1)
        return foot + lean

    u = np.linspace(-1, 1, 49)
    glass = sheet(surface(u[:, None], np.linspace(0, 1, 6)), 0.008)
    top = tube(surface(u, np.ones_like(u)), 0.016, 8)
    foot = tube(surface(u, np.full_like(u, 0.03)), 0.016, 8)
    h = np.linspace(0, 1, 5)
    posts = [tube(surface(np.full(5, k), h), 0.014, 8) for k in (-0.99, -0.5, -0.14, 0.14, 0.5, 0.99)]
    return [Piece("windscreen", c.glass, glass), Piece("windscreen_frame", c.alloy, join(top, foot, *posts))]


def _runabout(p: MotorBoat, deck: Deck, c: Coats) -> list[Piece]:
    """Screen, dashboards, two seats, a bench aft; seats in the bow if there is a well."""
    lines, well = deck.lines, deck.openings[-1]
    floor = well.floor
    pieces = windscreen(deck, c, p.cockpit - 0.045, p.cockpit + 0.14, p.screen, 0.13)
    y = float(lines.sheer_line(well.start)[1])
    half = min(0.98 * float(well.half(lines, np.array(well.start + 0.12))), float(lines.half_at(y, floor)) - 0.05)
    top = float(deck.height(well.start, 0.0)) - 0.02
    dash = _box_to((half - 0.3, 0.42, top - floor), (0, y + 0.17, floor))
    pieces.append(Piece("dashboard", c.inside, both_sides(moved(dash, ((half + 0.3) / 2, 0, 0)))))
    panel = moved(turned(rounded_box((0.5, 0.03, 0.2), 0.01, 2), 0, -0.5), (-(half + 0.3) / 2, y + 0.38, top - 0.09))
    pieces.append(Piece("dashboard", c.black, panel))
    side = -(half + 0.3) / 2
    pieces += _gauges(c, (side, y + 0.395, top - 0.075))
    pieces += fittings.wheel(0.18, c, (side, y + 0.5, top - 0.2), (0, 0.88, 0.48), wooden=p.varnished)
    for x in (side, -side):
        pieces += fittings.seat(c, (x, y + 1.05, floor))
    end = float(lines.sheer_line(well.stop)[1])
    wide = _seat_width(deck, well, 0.08, 0.5)
    pieces += fittings.bench(c, (0, end - 0.4, floor), wide)
    if end - y > 3.3:
        lid = moved(rounded_box((0.9, 0.5, 0.4), 0.06, 3), (0, end - 0.95, floor + 0.19))
        pieces.append(Piece("engine_box", c.cushion, lid))
    if p.bow_seats:
        pieces += _bow_cushions(p, deck, c, deck.openings[0])
    elif p.cuddy:
        low = Trunk(deck, 0.13, p.cockpit - 0.055, 0.36 * p.beam, 0.2, (0.12, 0.26), 0.14, (0.2, 0.0), 2.6, 0.05)
        pieces.append(Piece("cabin", c.white, join(low.walls(), low.roof())))
        pieces += window(low.surface, "cabin_window", c, (0.34, 0.6), (0.35, 0.78), 0.45)
    return pieces + (_bimini(deck, c, p.cockpit + 0.13, 0.86) if p.top and not p.varnished else [])


def _bimini(deck: Deck, c: Coats, start: float, stop: float) -> list[Piece]:
    """A cloth roof on three hoops that spread from one foot on each side."""
    lines = deck.lines
    foot = deck.surface(float(lines.half((start + stop) / 2)) - 0.08, (start + stop) / 2)
    y = np.linspace(lines.sheer_line(start)[1], lines.sheer_line(stop)[1], 13)
    half = 0.88 * float(foot[0])
    x = half * np.sin(np.linspace(-np.pi / 2, np.pi / 2, 17))[:, None]
    rise = (
        float(foot[2]) + 1.24 + 0.1 * np.sqrt(np.clip(1 - (x / half) ** 2, 0, 1)) + 0.05 * np.cos(np.linspace(-1, 1, 13) * 1.3)
    )
    cloth = np.stack(np.broadcast_arrays(x, y, rise), axis=-1)
    hoops = [tube(np.concatenate([[foot * (-1, 1, 1)], cloth[:, k], [foot]]), 0.014, 8) for k in (0, 6, 12)]
    return [Piece("canopy", c.accent, sheet(cloth, 0.012)), Piece("canopy_frame", c.steel, join(*hoops))]


def _box_to(size: tuple[float, float, float], foot: tuple[float, float, float]) -> Solid:
    """A box standing on a point."""
    return moved(rounded_box((size[0], size[1], size[2] + 0.01), 0.03, 2), np.add(foot, (0, 0, size[2] / 2 - 0.005)))


def _gauges(c: Coats, at: tuple[float, float, float]) -> list[Piece]:
    """Round instruments on a sloping panel."""
    face = turned(
        lathe([(0.04, -0.01), (0.04, 0.006), (0.034, 0.009), (0.032, 0.004), (0, 0.004)], 18), 0, -np.pi / 2 + np.pi - 0.5
    )
    dials = [moved(face, np.add(at, (x, 0.005, 0.02))) for x in (-0.17, -0.06, 0.06, 0.17)]
    return [Piece("gauges", c.steel, join(*dials))]


def _seat_width(deck: Deck, well: Opening, back: float, ahead: float) -> float:
    """Width of a bench across a well's rear, `back` (t) ahead of the well's end, clear of the hull `ahead` metres on."""
    end = float(deck.lines.sheer_line(well.stop)[1])
    inside = float(well.half(deck.lines, np.array(well.stop - back)))
    return 2 * min(inside, float(deck.lines.half_at(end - ahead, well.floor))) - 0.12


def _bow_cushions(p: MotorBoat, deck: Deck, c: Coats, well: Opening) -> list[Piece]:
    """An upholstered U in the bow's well."""
    s = np.linspace(0.05, 0.93, 14)
    t = well.start + s * (well.stop - well.start)
    edge = deck.surface(well.half(deck.lines, t), t)
    solids: list[Solid] = []
    for rise, thickness in ((0.3, 0.12), (0.12, 0.26)):
        outer = deck.lines.within(edge, well.floor, 0.06) + np.array((0, 0, rise))
        inner = np.stack([np.maximum(outer[:, 0] - 0.46, 0.0), outer[:, 1], outer[:, 2]], axis=1)
        share = np.linspace(0, 1, 7)[:, None, None]
        solids.append(both_sides(sheet(inner + (outer - inner) * share, thickness)))
    pad, lower = solids
    return [Piece("bow_seat", c.cushion, pad), Piece("bow_seat", c.inside, lower)]


def _console(p: MotorBoat, deck: Deck, c: Coats) -> list[Piece]:
    """A helm stand amidships with a leaning post, a cushion ahead of it, cushions in the bow, optionally a top."""
    well = deck.openings[0]
    floor, y = well.floor, 0.5 * p.length
    body = [(floor - 0.01, 0.36, 0.36, y), (floor + 0.06, 0.36, 0.36, y), (floor + 0.75, 0.34, 0.3, y + 0.02)]
    body += [(floor + 1.02, 0.32, 0.2, y - 0.03), (floor + 1.05, 0.29, 0.17, y - 0.03)]
    pieces = [Piece("console", c.white, stacked(body, 5.0, 40))]
    helm = moved(turned(rounded_box((0.5, 0.03, 0.25), 0.012, 2), 0, 0.42), (0, y + 0.245, floor + 0.88))
    pieces.append(Piece("console", c.black, helm))
    pieces += fittings.wheel(0.19, c, (0, y + 0.36, floor + 0.8), (0, 0.92, 0.38))
    u, h = np.linspace(-1, 1, 21)[:, None], np.linspace(0, 1, 5)
    screen = np.stack(
        np.broadcast_arrays(
            0.31 * np.sin(1.35 * u) * (1 - 0.08 * h), y - 0.12 - 0.1 * np.cos(1.4 * u) + 0.16 * h, floor + 1.02 + 0.36 * h
        ),
        axis=-1,
    )
    pieces.append(Piece("windscreen", c.glass, sheet(screen, 0.008)))
    pieces.append(Piece("windscreen_frame", c.steel, tube(screen[:, -1], 0.011, 8)))
    pieces += fittings.bench(c, (0, y + 1.0, floor), 0.95, 0.42, 0.6, 0.26)
    pieces.append(Piece("console_seat", c.cushion, _box_to((0.6, 0.34, 0.48), (0, y - 0.5, floor))))
    front = Opening(well.start, well.start + 0.28, well.width, floor + 0.1, well.margin, 5.0)
    pieces += _bow_cushions(p, deck, c, front)
    end = float(deck.lines.sheer_line(well.stop)[1])
    wide = _seat_width(deck, well, 0.08, 0.4)
    pieces += fittings.bench(c, (0, end - 0.32, floor), wide, 0.42, 0.3, 0.2)
    return pieces + (_tee_top(c, floor, y) if p.top else [])


def _tee_top(c: Coats, floor: float, y: float) -> list[Piece]:
    """A canopy on tubes around the console."""
    high = floor + 2.02
    legs: list[Solid] = []
    for y0, y1 in ((y - 0.2, y - 0.42), (y + 0.36, y + 0.5)):
        path = smooth(
            [(0.44, y0, floor - 0.01), (0.44, y0, floor + 0.9), (0.5, y1, high - 0.25), (0.55, y1 * 0.7 + y * 0.3, high)], 5
        )
        legs.append(tube(path, 0.022, 10))
    beams = [rod((0.46, y - 0.24, floor + 0.95), (0.46, y + 0.38, floor + 0.95), 0.018, 8)]
    cross = [tube([(-0.6, b, high), (0, b, high + 0.03), (0.6, b, high)], 0.02, 8) for b in (y - 0.35, y + 0.4)]
    x, s = np.linspace(-0.85, 0.85, 15)[:, None], np.linspace(-0.85, 0.95, 13)
    bow = np.broadcast_arrays(x * (1 - 0.12 * np.abs(s) ** 4), y + s, high + 0.055 - 0.05 * x**2 - 0.03 * s**2)
    return [
        Piece("canopy", c.accent, sheet(np.stack(bow, axis=-1), 0.04)),
        Piece("canopy_frame", c.alloy, join(both_sides(join(*legs, *beams)), *cross)),
    ]


def _cruiser(p: MotorBoat, deck: Deck, c: Coats) -> list[Piece]:
    """A low cabin forward, a wheelhouse with big windows, a cockpit with a bench."""
    lines, well = deck.lines, deck.openings[0]
    fore = Trunk(deck, 0.15, 0.52, 0.36 * p.beam, 0.24, (0.2, 0.38), 0.14, (0.25, 0.0), 2.6, 0.05)
    tall = p.house_height
    house = Trunk(deck, p.house, 0.665, 0.4 * p.beam, 0.2, (tall - 0.06, tall), 0.12, (p.house_rake, 0.05), 6.0, 0.05, 0.045)
    pieces = [Piece("cabin", c.white, join(fore.walls(), fore.roof()))]
    pieces += window(fore.surface, "cabin_window", c, (0.34, 0.56), (0.4, 0.78), 0.45)
    pieces += [
        Piece("wheelhouse", c.white, join(house.walls(), house.roof())),
        Piece("wheelhouse_roof", c.hull, eyebrow(house, 0.06, 0.12)),
    ]
    pieces += window(house.front, "windshield", c, (0.05, 0.88), (0.42, 0.92), 0.1, 0.03)
    panes = np.linspace(0.13, 0.94, p.windows + 1)
    for k, pair_ in enumerate(pairwise(panes.tolist())):
        a, b = house.spots(np.add(pair_, (0.02, -0.02)))
        pieces += window(house.surface, f"side_window_{k + 1}", c, (a, b), (0.42, 0.91), 0.12)
    pieces += window(house.rear, "door", c, (-0.8, -0.04), (0.08, 0.9), 0.1, 0.03)
    hatch = fore.top(0.5 * (fore.start + fore.stop) * p.length - 0.2)
    pieces += [
        Piece("hatch", c.black, moved(rounded_box((0.52, 0.52, 0.05), 0.02, 2), hatch + np.array((0, 0, 0.004)))),
        Piece("hatch", c.glass, moved(rounded_box((0.42, 0.42, 0.03), 0.012, 2), hatch + np.array((0, 0, 0.022)))),
    ]
    end = float(lines.sheer_line(well.stop)[1])
    wide = _seat_width(deck, well, 0.05, 0.4)
    pieces += fittings.bench(c, (0, end - 0.36, well.floor), wide, 0.45, 0.36, 0.3)
    y = float(house.surface(1.0, 1.0)[1])
    mast = house.top(y - 0.5)
    pole = tube([mast + np.array((0, 0, -0.05)), mast + np.array((0, 0.06, 0.25)), mast + np.array((0, 0.1, 0.55))], 0.02, 8)
    pieces += [
        Piece(
            "light_mast", c.white, join(pole, moved(rounded_box((0.5, 0.09, 0.07), 0.03, 2), mast + np.array((0, 0.06, 0.24))))
        ),
        Piece(
            "light_mast",
            c.white_lamp,
            moved(lathe([(0, -0.03), (0.03, -0.03), (0.03, 0.04), (0, 0.05)], 14), mast + np.array((0, 0.1, 0.57))),
        ),
    ]
    x, z = 0.3 * p.beam, float(house.top(y - 0.9, 0.3 * p.beam)[2])
    s = np.linspace(0, 1, 12)
    rail = np.stack([np.full(12, x), y - 1.1 + 0.9 * s, z + 0.07 * np.minimum(1, 8 * np.minimum(s, 1 - s)) - 0.01], axis=1)
    return [*pieces, Piece("roof_rail", c.steel, both_sides(tube(rail, 0.012, 8)))]


def _outfit(p: MotorBoat, deck: Deck, c: Coats) -> list[Piece]:
    """Cleats, lights, bow rail, anchor roller, fenders, flag."""
    pieces = fittings.cleats(deck, c, (0.09, 0.95) if p.length < 6.5 else (0.09, 0.55, 0.95), 0.085)
    pieces += fittings.side_lights(c, deck.surface(0.0, 0.02) + np.array((0, 0, 0.02)))
    if p.rail:
        stop = {"runabout": p.cockpit - 0.06, "console": 0.34, "cruiser": 0.62}[p.style]
        high = {"runabout": 0.2, "console": 0.16, "cruiser": 0.42}[p.style]
        pieces += fittings.bow_rail(deck, c, stop, high, p.style == "cruiser", 5)
    eye = tube([(0.03 * np.cos(a), -0.01, 0.03 * np.sin(a)) for a in np.linspace(0.3, 2 * np.pi + 0.2, 14)], 0.007, 8)
    pieces.append(Piece("bow_eye", c.steel, moved(eye, deck.lines.point(0.0, 0.62) + np.array((0, -0.02, 0)))))
    if p.fenders:
        pieces += fittings.fenders(deck, c, (0.5, 0.78), c.stripe if p.style == "runabout" else c.white)
    if p.flag:
        x = float(deck.lines.half(0.985)) - 0.1
        at = deck.surface(x, 0.975) - np.array((0, 0, 0.01))
        pieces += fittings.flag(at, c, p.flag)
    return pieces
