"""Cars: sedans, hatchbacks, vans and pickups."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from viewsphere.assets.mesh import Mesh
from viewsphere.model.annotations.keypoints import At, sided
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.coachwork import fittings, lights, structure
from viewsphere_zoo.coachwork.coats import Coats, coats
from viewsphere_zoo.coachwork.lights import Grille, Lamps
from viewsphere_zoo.coachwork.shape import PROPORTIONS, Body, Proportions, Shape
from viewsphere_zoo.coachwork.wheels import Wheel
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.paint import Color
from viewsphere_zoo.shapes.solids import both_sides

KEYPOINTS = {
    **sided("wheel_front", "wheel_front_{}_rim", (1, 0, 0)),
    **sided("wheel_rear", "wheel_rear_{}_rim", (1, 0, 0)),
    **sided("headlight", "headlight_{}", (0, -1, 0)),
    **sided("taillight", "taillight_{}", (0, 1, 0)),
    **sided("mirror", "mirror_{}"),
    **sided("door_handle_front", "door_handle_front_{}", (1, 0, 0)),
    **sided("bumper_front", "bumper_front", (1, -1, 0)),
    **sided("bumper_rear", "bumper_rear", (1, 1, 0)),
    "grille": At("grille", (0, -1, 0)),
    "roof": At("roof", (0, 0, 1)),
}
SKELETON = (
    ("wheel_front_left", "wheel_rear_left"),
    ("wheel_front_right", "wheel_rear_right"),
    ("headlight_left", "headlight_right"),
    ("taillight_left", "taillight_right"),
    ("headlight_left", "mirror_left"),
    ("headlight_right", "mirror_right"),
    ("mirror_left", "taillight_left"),
    ("mirror_right", "taillight_right"),
)


@dataclass(frozen=True)
class Car:
    """Parameters of a car; lengths in metres, colours sRGB 0..1.

    length, width (without mirrors) and height (without rack and aerial) are the body's; None stands for the usual measure of
    the body style. proportions: the car's side view; roundness: 0 boxy to 1 soft; dome: height of a bulge in the bonnet;
    windows: 1 to 3 on a side; slant: how far the rear side windows rise towards the rear, fraction of their height; flare:
    height of the wheel arches' lips; flakes: 0 solid paint to 1 strong metallic; phase: turn of the rims, radians.
    """

    body: Body = "sedan"
    length: float | None = None
    width: float | None = None
    height: float | None = None
    proportions: Proportions | None = None
    roundness: float = 0.5
    dome: float = 0.015
    windows: int | None = None
    slant: float = 0.08
    flare: float = 0.01
    wheel: Wheel = field(default_factory=Wheel)
    phase: float = 0.3
    lamps: Lamps = "swept"
    tail_lamps: Lamps = "swept"
    grille: Grille = "bars"
    color: Color = (0.55, 0.07, 0.08)
    roof_color: Color | None = None
    flakes: float = 0.6
    rim_color: Color = (0.72, 0.73, 0.75)
    glass_color: Color = (0.13, 0.155, 0.17)
    painted_cladding: bool = True
    black_pillars: bool = True
    chrome_handles: bool = False
    rear_window: bool = True
    roof_rack: bool = False
    rack_bars: bool = False
    rear_spoiler: bool = False
    shark_fin: bool = True
    exhausts: int = 1


SIZES: dict[Body, tuple[float, float, float]] = {
    "sedan": (4.7, 1.82, 1.45),
    "hatchback": (4.1, 1.77, 1.5),
    "van": (4.95, 1.95, 1.97),
    "pickup": (5.3, 1.9, 1.81),
}
"""Usual length, width and height, metres."""


def car(parameters: Car | None = None) -> Mesh:
    """The car in metres: front towards -Y, wheels on z = 0, centred in x and y.

    Parts: body, roof, bumper_*, sill, underbody, wheel_arch, window_*, windshield, seal, seam, headlight_*, taillight_*,
    wheel_<end>_<side>_tyre and _rim, indicator_*, fog_light_*, grille, intake, badge, licence_plate, mirror_*, wiper,
    door_handle_*, scuttle, and where fitted cargo_bed, roof_rack, spoiler, aerial, exhaust.
    """
    p = parameters or Car()
    shape = _shape(p)
    materials = coats(p.color, p.roof_color or p.color, p.flakes, p.rim_color, p.painted_cladding, p.glass_color)
    pieces = [*_shell(p, shape, materials), *_fitted(p, shape, materials)]
    return assemble(pieces, crease_deg=36)


def _shape(p: Car) -> Shape:
    """The surfaces that the parameters describe."""
    usual = SIZES[p.body]
    length, width, height = (given or by_style for given, by_style in zip((p.length, p.width, p.height), usual, strict=True))
    return Shape(p.body, length, width, height, p.proportions or PROPORTIONS[p.body], p.wheel, p.roundness, p.dome)


def _windows(p: Car) -> int:
    """Panes on a side."""
    return p.windows or {"sedan": 2, "hatchback": 3, "van": 1, "pickup": 2}[p.body]


def _shell(p: Car, shape: Shape, c: Coats) -> list[Piece]:
    """Hull, deck, cabin, bed and wheels."""
    hull = shape.hull
    pickup = p.body == "pickup"
    names = ("bumper_front", "sill" if pickup else "bumper_rear")
    pieces = structure.hull_pieces(hull, shape.track, c, names)
    pieces.append(Piece("body", c.paint, both_sides(hull.deck_to(shape.deck_inner()))))
    pieces += structure.arch_trims(hull, c, p.flare)
    if pickup:
        pieces += structure.bed_pieces(shape, c)
        pieces += structure.arch_trims(shape.bed, c, p.flare)
    cells = shape.side_cells(_windows(p), p.slant)
    pieces += structure.cabin_pieces(shape, c, cells, p.black_pillars, p.rear_window)
    return pieces + structure.wheel_pieces(shape, p.wheel, c, p.phase)


def _fitted(p: Car, shape: Shape, c: Coats) -> list[Piece]:
    """All parts fitted to the shell."""
    rear_door = p.body != "pickup" or _windows(p) > 1
    pieces = [
        *lights.headlights(shape, p.lamps, c),
        *lights.taillights(shape, p.tail_lamps, c),
        *lights.front_face(shape, p.grille, c),
        *lights.rear_face(shape, c, p.exhausts),
        *fittings.seams(shape, c, rear_door),
        *fittings.handles(shape, c, rear_door, p.chrome_handles),
        *fittings.mirrors(shape, c, p.body in ("van", "pickup")),
        *fittings.wipers(shape, c),
    ]
    if p.roof_rack:
        pieces += fittings.rack(shape, c, p.rack_bars)
    if p.rear_spoiler:
        pieces += fittings.spoiler(shape, c)
    if p.shark_fin:
        pieces += fittings.aerial(shape, c)
    return pieces


def car_random(rng: np.random.Generator) -> Mesh:
    """A car with parameters drawn to resemble real cars."""
    return car(draw(rng))


def draw(rng: np.random.Generator) -> Car:
    """The parameters of a random car."""
    body: Body = ("sedan", "hatchback", "van", "pickup")[int(rng.choice(4, p=(0.3, 0.36, 0.16, 0.18)))]
    size = float(rng.uniform())
    windows = int(rng.choice({"sedan": (2, 2, 3), "hatchback": (3, 3, 2), "van": (1, 2, 3), "pickup": (1, 2)}[body]))
    color, flakes = _drawn_color(rng)
    tall = float(rng.uniform())
    low, high = _RANGES[body]
    height = low[2] + tall * (high[2] - low[2])
    rugged = body in ("pickup", "hatchback") and rng.random() < 0.3 + 0.4 * tall
    return Car(
        body=body,
        length=low[0] + size * (high[0] - low[0]),
        width=low[1] + float(np.clip(size + rng.normal(0, 0.2), 0, 1)) * (high[1] - low[1]),
        height=height,
        proportions=_drawn_proportions(body, windows, size, rng),
        roundness=float(rng.uniform(0.05, 1.0)),
        dome=float(rng.uniform(0, 0.03)),
        windows=windows,
        slant=float(rng.uniform(0.0, 0.18)),
        flare=float(rng.uniform(0.006, 0.012)) + 0.016 * rugged,
        wheel=_drawn_wheel(body, height, rng),
        phase=float(rng.uniform(0, 2 * np.pi)),
        lamps=_LAMPS[int(rng.integers(4))],
        tail_lamps=_LAMPS[int(rng.integers(4))],
        grille=("bars", "mesh", "wide", "slim")[int(rng.integers(4))],
        color=color,
        roof_color=_TOPS[int(rng.integers(len(_TOPS)))] if body == "hatchback" and rng.random() < 0.3 else None,
        flakes=flakes,
        rim_color=_RIMS[int(rng.choice(len(_RIMS), p=(0.45, 0.2, 0.25, 0.1)))],
        painted_cladding=not (rugged or (body == "van" and rng.random() < 0.4)),
        black_pillars=bool(rng.random() < 0.65),
        chrome_handles=bool(rng.random() < 0.25),
        rear_window=body != "van" or windows > 1 or bool(rng.random() < 0.5),
        roof_rack=(body == "hatchback" and bool(rng.random() < 0.45)) or (body == "van" and bool(rng.random() < 0.3)),
        rack_bars=bool(rng.random() < 0.5),
        rear_spoiler=body == "hatchback" and bool(rng.random() < 0.6),
        shark_fin=bool(rng.random() < 0.7),
        exhausts=int(rng.integers(0, 3)),
    )


Triple = tuple[float, float, float]
_RANGES: dict[Body, tuple[Triple, Triple]] = {
    "sedan": ((4.35, 1.74, 1.4), (5.1, 1.9, 1.52)),
    "hatchback": ((3.65, 1.66, 1.44), (4.85, 1.92, 1.74)),
    "van": ((4.5, 1.82, 1.82), (5.6, 2.0, 2.2)),
    "pickup": ((4.95, 1.8, 1.72), (5.6, 2.0, 1.95)),
}
_LAMPS: tuple[Lamps, ...] = ("swept", "round", "slim", "block")
_TOPS: tuple[Color, ...] = ((0.05, 0.05, 0.055), (0.93, 0.93, 0.92), (0.35, 0.36, 0.38))
_RIMS: tuple[Color, ...] = ((0.76, 0.77, 0.79), (0.5, 0.51, 0.53), (0.13, 0.13, 0.14), (0.62, 0.5, 0.3))
_PAINTS: tuple[tuple[float, Color], ...] = (
    (0.08, (0.93, 0.93, 0.91)),  # white
    (0.07, (0.07, 0.07, 0.08)),  # black
    (0.07, (0.66, 0.68, 0.7)),  # silver
    (0.05, (0.35, 0.37, 0.39)),  # grey
    (0.1, (0.08, 0.2, 0.5)),  # blue
    (0.11, (0.68, 0.05, 0.07)),  # red
    (0.05, (0.1, 0.13, 0.24)),  # midnight blue
    (0.05, (0.35, 0.04, 0.09)),  # burgundy
    (0.07, (0.95, 0.76, 0.08)),  # yellow
    (0.05, (0.92, 0.38, 0.06)),  # orange
    (0.05, (0.1, 0.3, 0.18)),  # racing green
    (0.04, (0.45, 0.72, 0.12)),  # lime
    (0.06, (0.12, 0.55, 0.62)),  # turquoise
    (0.04, (0.75, 0.68, 0.54)),  # beige
    (0.03, (0.36, 0.23, 0.14)),  # brown
    (0.02, (0.4, 0.2, 0.5)),  # violet
)


def _drawn_color(rng: np.random.Generator) -> tuple[Color, float]:
    """A paint's colour and its share of flakes."""
    weights = np.array([w for w, _ in _PAINTS])
    base = np.array(_PAINTS[int(rng.choice(len(_PAINTS), p=weights / weights.sum()))][1])
    r, g, b = np.clip(base * rng.uniform(0.85, 1.08) + rng.normal(0, 0.015, 3), 0.03, 0.96)
    return (float(r), float(g), float(b)), float(rng.uniform(0, 1))


def _drawn_wheel(body: Body, height: float, rng: np.random.Generator) -> Wheel:
    """A wheel with a tyre that suits the car, and one of many rim designs."""
    usual = {"sedan": 0.225, "hatchback": 0.212, "van": 0.172, "pickup": 0.208}[body] * height
    design = (
        Wheel(spokes=5, spoke_width=0.55, flare=0.75),
        Wheel(spokes=5, spoke_width=0.5, flare=0.7, paired=True),
        Wheel(spokes=6, spoke_width=0.7, flare=0.65),
        Wheel(spokes=7, spoke_width=0.5, flare=0.8, twist=0.35),
        Wheel(spokes=9, spoke_width=0.45, flare=0.8),
        Wheel(spokes=12, spoke_width=0.5, flare=0.9, twist=0.2),
        Wheel(spokes=10, spoke_width=0.85, flare=1.45),
        Wheel(spokes=4, spoke_width=0.9, flare=0.8),
        Wheel(spokes=5, spoke_width=0.9, flare=1.1, twist=-0.25),
    )[int(rng.integers(9))]
    return replace(
        design,
        radius=float(usual * rng.uniform(0.95, 1.05)),
        width=float(rng.uniform(0.19, 0.25)),
        rim=float(rng.uniform(0.6, 0.74)) - 0.04 * (body in ("van", "pickup")),
    )


def _drawn_proportions(body: Body, windows: int, size: float, rng: np.random.Generator) -> Proportions:
    """The body style's side view with a character of its own."""
    p = PROPORTIONS[body]
    move = rng.normal(0, 1, 8).clip(-1.8, 1.8)
    upright = 0.018 * (1 - size) if body == "hatchback" else 0.0
    cab = 0.075 * (windows - 1) if body == "pickup" else 0.0
    pillar = {1: 0.47, 2: 0.43}[windows] if body == "pickup" else p.doors[1]
    return replace(
        p,
        front_axle=p.front_axle + 0.007 * move[0],
        rear_axle=p.rear_axle + 0.007 * move[1],
        cowl=p.cowl + 0.01 * move[2],
        roof_front=p.roof_front + 0.012 * move[2] + 0.008 * move[3],
        roof_rear=p.roof_rear + 0.016 * move[4] * (body == "sedan") + 0.013 * move[4] * (body == "hatchback") + upright + cab,
        rear_glass=p.rear_glass + 0.008 * move[4] * (body == "sedan") + cab,
        cab_end=p.cab_end + cab,
        doors=(p.doors[0] + 0.01 * move[2], pillar, p.doors[2] + cab),
        nose=p.nose + 0.022 * move[5],
        bonnet=p.bonnet + 0.012 * move[5],
        belt=p.belt + 0.012 * move[6],
        boot=p.boot + 0.016 * move[6] + 0.01 * move[7],
        tail=p.tail + 0.012 * move[6] + 0.02 * move[7],
        clearance=p.clearance + 0.02 * max(float(move[7]), 0),
    )


FAMILY = ZooFamily(
    random=car_random,
    home="street",
    classes={"": "vehicle"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
)
