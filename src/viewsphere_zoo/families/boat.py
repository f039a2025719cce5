"""Boats: rowing boats, motor boats and sailing boats."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from viewsphere.assets.mesh import Mesh
from viewsphere.model.annotations.keypoints import At, sided
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.paint import Color
from viewsphere_zoo.shapes.solids import moved
from viewsphere_zoo.shipyard.cloth import Cut
from viewsphere_zoo.shipyard.coats import MAHOGANY, TEAK, WHITE
from viewsphere_zoo.shipyard.fittings import Flag
from viewsphere_zoo.shipyard.motor import MotorBoat, motor_boat
from viewsphere_zoo.shipyard.rowing import RowingBoat, rowing_boat
from viewsphere_zoo.shipyard.sailing import SailingBoat, sailing_boat

KEYPOINTS = {
    "bow": At("hull", (0, -1, 1)),
    **sided("beam", "hull", (1, 0, 1)),
    **sided("stern", "transom|hull", (1, 1, 1)),
    "masthead": At("mast", (0, 0, 1)),
    "propeller": At("propeller"),
    "rudder": At("rudder", (0, 1, -1)),
    **sided("oar_blade", "oar_blade_{}"),
    **sided("side_light", "side_light_{}"),
}
SKELETON = (
    ("bow", "beam_left"),
    ("bow", "beam_right"),
    ("beam_left", "stern_left"),
    ("beam_right", "stern_right"),
    ("stern_left", "stern_right"),
)

T = TypeVar("T")
Boat = RowingBoat | MotorBoat | SailingBoat


def boat(parameters: Boat | None = None) -> Mesh:
    """The boat in metres: bow towards -Y, its lowest point on z = 0, centred in x and y; without parameters a sailing boat.

    Parts of every boat: hull, antifouling. Rowing boats: inside, ribs, floorboards, thwart, gunwale, rowlock_*,
    oar_*, transom if they have one. Motor boats: deck, cockpit, sole, windscreen or windshield_*, wheel, seats,
    rubbing_strake, cleat_*, outboard_* or stern_drive, propeller, bow_rail if fitted. Sailing boats: deck, keel, rudder,
    cockpit, cabin and cabin_window_* if they have one, mast, boom, mainsail, jib, forestay, shrouds, and either spreaders and
    backstay, or gaff and bowsprit.
    """
    p = parameters or SailingBoat()
    if isinstance(p, RowingBoat):
        return _standing(rowing_boat(p))
    return _standing(motor_boat(p) if isinstance(p, MotorBoat) else sailing_boat(p))


def _standing(pieces: Sequence[Piece]) -> Mesh:
    """The mesh moved from the ship's frame to z = 0 under its lowest point, centred in x and y."""
    low = np.min([q.solid.vertices.min(axis=0) for q in pieces], axis=0)
    high = np.max([q.solid.vertices.max(axis=0) for q in pieces], axis=0)
    by = (-(low[0] + high[0]) / 2, -(low[1] + high[1]) / 2, -low[2])
    return assemble([Piece(q.part, q.material, moved(q.solid, by)) for q in pieces], crease_deg=36)


def boat_random(rng: np.random.Generator) -> Mesh:
    """A boat with parameters drawn to resemble boats in a small harbour."""
    return boat(draw(rng))


def draw(rng: np.random.Generator) -> Boat:
    """The parameters of a random boat."""
    kind = rng.random()
    if kind < 0.3:
        return _drawn_rowing_boat(rng)
    return _drawn_motor_boat(rng) if kind < 0.64 else _drawn_sailing_boat(rng)


_NAVY: Color = (0.08, 0.13, 0.3)
_CREAM: Color = (0.93, 0.89, 0.78)
_HULLS: tuple[Color, ...] = (
    WHITE,
    WHITE,
    _CREAM,
    _NAVY,
    (0.62, 0.07, 0.09),  # red
    (0.1, 0.34, 0.2),  # racing green
    (0.45, 0.7, 0.8),  # light blue
    (0.12, 0.36, 0.62),  # blue
    (0.93, 0.72, 0.12),  # yellow
    (0.12, 0.13, 0.14),  # black
    (0.56, 0.6, 0.63),  # grey
    (0.88, 0.36, 0.1),  # orange
    (0.1, 0.48, 0.47),  # turquoise
    (0.42, 0.08, 0.16),  # burgundy
)
_BOTTOMS: tuple[Color, ...] = ((0.5, 0.12, 0.09), (0.1, 0.15, 0.28), (0.13, 0.14, 0.15), (0.1, 0.28, 0.2), (0.35, 0.1, 0.09))
_STRIPES: tuple[Color, ...] = (
    _NAVY,
    (0.7, 0.08, 0.1),
    (0.82, 0.62, 0.22),
    (0.1, 0.4, 0.35),
    (0.15, 0.16, 0.17),
    (0.15, 0.45, 0.75),
)
_DECKS: tuple[Color, ...] = ((0.9, 0.89, 0.85), (0.86, 0.82, 0.72), (0.7, 0.74, 0.77), (0.78, 0.84, 0.86), (0.9, 0.86, 0.7))
_WOODS: tuple[Color, ...] = (TEAK, (0.55, 0.33, 0.17), (0.74, 0.55, 0.34), MAHOGANY)
_CLOTHS: tuple[tuple[Color, Color], ...] = (
    ((0.95, 0.94, 0.9), (0.75, 0.1, 0.12)),
    ((0.95, 0.94, 0.9), (0.1, 0.25, 0.6)),
    ((0.93, 0.88, 0.75), (0.55, 0.2, 0.12)),
    ((0.95, 0.94, 0.92), (0.95, 0.7, 0.1)),
    ((0.94, 0.95, 0.94), (0.1, 0.5, 0.45)),
    ((0.93, 0.93, 0.93), (0.2, 0.21, 0.23)),
)
_FLAGS: tuple[Flag, ...] = (
    ((0.75, 0.1, 0.12), (0.95, 0.95, 0.93), (0.1, 0.2, 0.5)),
    ((0.1, 0.2, 0.5), (0.95, 0.95, 0.93), (0.75, 0.1, 0.12)),
    ((0.95, 0.78, 0.1), (0.75, 0.1, 0.12), (0.12, 0.12, 0.13)),
    ((0.1, 0.45, 0.25), (0.95, 0.95, 0.93), (0.75, 0.1, 0.12)),
    ((0.1, 0.3, 0.6), (0.95, 0.8, 0.15), (0.1, 0.3, 0.6)),
)
_TANNED: tuple[Color, ...] = ((0.52, 0.19, 0.11), (0.6, 0.3, 0.14), (0.85, 0.76, 0.56))


def _one(rng: np.random.Generator, choices: Sequence[T]) -> T:
    """One of the choices."""
    return choices[int(rng.integers(len(choices)))]


def _hull_color(rng: np.random.Generator) -> tuple[Color, Color]:
    """Colour of the topsides, and of a stripe that shows on them."""
    base = np.array(_one(rng, _HULLS))
    r, g, b = np.clip(base * rng.uniform(0.88, 1.04) + rng.normal(0, 0.012, 3), 0.03, 0.96)
    dark = float(r + g + b) < 1.5
    return (float(r), float(g), float(b)), (_one(rng, (WHITE, _CREAM, _STRIPES[2])) if dark else _one(rng, _STRIPES))


def _drawn_rowing_boat(rng: np.random.Generator) -> RowingBoat:
    """Any rowing boat from a pram-like dinghy to a pointed skiff."""
    length = float(rng.uniform(3.0, 5.0))
    pointed = bool(rng.random() < 0.38)
    varnished = bool(rng.random() < 0.2)
    wood = _one(rng, _WOODS)
    color, stripe = (wood, WHITE) if varnished else _hull_color(rng)
    inside = (color, wood, (0.85, 0.83, 0.76), (0.55, 0.62, 0.64))[1 if varnished else int(rng.integers(4))]
    spring = rng.uniform(0.45, 0.8) if pointed else rng.uniform(0.25, 0.55)
    return RowingBoat(
        length=length,
        beam=length * float(rng.uniform(0.27, 0.33) if pointed else rng.uniform(0.34, 0.4)) + 0.1,
        depth=0.34 + 0.045 * length + float(rng.uniform(-0.03, 0.05)),
        spring=(float(spring), float(spring * (rng.uniform(0.75, 1.0) if pointed else rng.uniform(0.4, 0.7)))),
        stern="pointed" if pointed else "transom",
        planks=int(rng.integers(6, 10)) if rng.random() < 0.6 else 0,
        thwarts=2 if length < 4.1 else 3,
        oars=2 if length > 4.2 and rng.random() < 0.6 else 1,
        sweep=None if rng.random() < 0.22 else float(rng.uniform(24, 54)),
        fullness=float(rng.uniform(0.1, 1.0)),
        stem_rake=float(rng.uniform(0.04, 0.1)),
        color=color,
        bottom=_one(rng, _BOTTOMS),
        stripe=stripe,
        wood=wood,
        inside=inside,
        blades=_one(rng, (WHITE, wood, color, stripe)),
        varnished=varnished,
        striped=bool(rng.random() < 0.7),
    )


def _drawn_motor_boat(rng: np.random.Generator) -> MotorBoat:
    """A runabout, perhaps a wooden one, an open boat with a console, or a cabin cruiser."""
    style = ("runabout", "console", "cruiser")[int(rng.choice(3, p=(0.44, 0.26, 0.3)))]
    low, high = {"runabout": (4.6, 7.0), "console": (5.2, 7.8), "cruiser": (6.2, 9.0)}[style]
    length = float(rng.uniform(low, high))
    varnished = style == "runabout" and bool(rng.random() < 0.28)
    color, stripe = (_one(rng, (MAHOGANY, (0.5, 0.25, 0.12))), _CREAM) if varnished else _hull_color(rng)
    drive = "stern_drive" if varnished or (style != "console" and rng.random() < 0.45) else "outboard"
    return MotorBoat(
        style=style,
        length=length,
        beam=1.06 + length * float(rng.uniform(0.205, 0.24)),
        freeboard=(0.36 if style == "cruiser" else 0.26) + 0.075 * length + float(rng.uniform(-0.04, 0.04)),
        spring=float(rng.uniform(0.16, 0.42)),
        flare=float(rng.uniform(0.2, 0.95)),
        stem_rake=float(rng.uniform(0.12, 0.22)),
        cockpit=float(rng.uniform(0.4, 0.48)),
        screen=float(rng.uniform(0.34, 0.52)),
        drive=drive,
        engines=2 if drive == "outboard" and length > 6.4 and rng.random() < 0.4 else 1,
        bow_seats=not varnished and bool(rng.random() < 0.4),
        top=bool(rng.random() < (0.3 if style == "runabout" else 0.6)),
        cuddy=not varnished and bool(rng.random() < 0.6),
        house=float(rng.uniform(0.31, 0.4)),
        house_height=float(rng.uniform(1.12, 1.36)),
        house_rake=float(rng.uniform(-0.1, 0.75)),
        windows=int(rng.integers(1, 4)),
        rail=not varnished and bool(rng.random() < 0.8 or style == "cruiser"),
        fenders=bool(rng.random() < 0.35),
        flag=_one(rng, _FLAGS) if rng.random() < 0.4 else None,
        planked_deck=varnished,
        color=color,
        bottom=_one(rng, _BOTTOMS),
        boot=_one(rng, (stripe, WHITE)),
        stripe=stripe,
        deck=_one(rng, _DECKS),
        cushion=_one(rng, (WHITE, _CREAM, (0.75, 0.75, 0.74), (0.55, 0.3, 0.2))),
        accent=_one(rng, ((0.08, 0.08, 0.09), _NAVY, WHITE, (0.35, 0.37, 0.4), stripe)),
        wood=color if varnished else _one(rng, _WOODS),
        varnished=varnished,
        stripe_width=float(_one(rng, (0.0, 0.06, 0.1, 0.15))) * (not varnished),
    )


def _drawn_sailing_boat(rng: np.random.Generator) -> SailingBoat:
    """A day sailer, a cruising sloop, or a long-keeled boat with a gaff."""
    style = ("cruiser", "day_sailer", "classic")[int(rng.choice(3, p=(0.5, 0.2, 0.3)))]
    low, high = {"cruiser": (6.4, 10.0), "day_sailer": (5.0, 6.4), "classic": (5.8, 9.0)}[style]
    length = float(rng.uniform(low, high))
    classic = style == "classic"
    gaff = classic and bool(rng.random() < 0.6)
    color, stripe = _hull_color(rng)
    varnished = classic and bool(rng.random() < 0.25)
    wood = _one(rng, _WOODS[:3])
    draft = length * float(rng.uniform(0.13, 0.165))
    cloth, second = _one(rng, _CLOTHS)
    if gaff and rng.random() < 0.7:
        cloth = _one(rng, _TANNED)
    pattern = "plain" if classic else _one(rng, ("plain", "plain", "head", "foot", "bands", "stripe"))
    sails = Cut(
        cloth,
        second,
        pattern,
        int(rng.integers(12, 9999)),
        _one(rng, ("diamond", "bars", "wave", "none")),
        0 if gaff else int(rng.integers(3, 6)),
    )
    jib = Cut(cloth, second, _one(rng, ("plain", "plain", "foot", "head")) if pattern != "plain" else "plain", 1, "none", 0)
    return SailingBoat(
        length=length,
        beam=0.75 + length * float(rng.uniform(0.19, 0.215) if classic else rng.uniform(0.225, 0.26)),
        draft=draft,
        mast=length * float(rng.uniform(1.0, 1.08) if gaff else rng.uniform(0.92, 1.0)),
        freeboard=0.3 + 0.062 * length + float(rng.uniform(-0.04, 0.06)),
        overhang=float(rng.uniform(0.1, 0.16) if classic else rng.uniform(0.03, 0.11)),
        tuck=float(rng.uniform(0.4, 0.58) if classic else rng.uniform(0.62, 0.82)),
        keel="long" if classic else _one(rng, ("fin", "fin", "bulb")),
        rig="gaff" if gaff else _one(rng, ("masthead", "fractional")),
        cabin=0.0 if style == "day_sailer" else float(rng.uniform(0.3, 0.45)),
        windows=int(rng.integers(1, 5)),
        sheet=float(rng.uniform(7, 24)),
        lee=float(rng.choice((-1.0, 1.0))),
        roach=float(rng.uniform(0.05, 0.17)),
        rails=style == "cruiser" or (classic and bool(rng.random() < 0.4)),
        fenders=bool(rng.random() < 0.2),
        flag=_one(rng, _FLAGS) if rng.random() < 0.5 else None,
        steering="wheel" if length > 8.4 and not classic else "tiller",
        wooden=classic,
        planked_deck=classic or bool(rng.random() < 0.2),
        sails=sails,
        jib=jib,
        color=wood if varnished else color,
        bottom=_one(rng, _BOTTOMS),
        boot=_one(rng, (WHITE, stripe)),
        stripe=stripe,
        deck=_one(rng, _DECKS),
        wood=wood,
        varnished=varnished,
        stripe_width=float(_one(rng, (0.0, 0.04, 0.07))),
    )


FAMILY = ZooFamily(
    random=boat_random,
    home="water",
    classes={"": "vehicle"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
)
