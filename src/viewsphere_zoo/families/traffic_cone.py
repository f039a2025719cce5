"""Traffic cones: with or without white bands, on square, eight-sided and round feet, single and stacked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.model.annotations.keypoints import At, sided
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.paint import Color, coated, lamp, linear
from viewsphere_zoo.shapes.solids import Float, Solid, join, lathe, loft, moved, rounded_box, superellipse, turned

KEYPOINTS = {
    "tip": At("cone", (0, 0, 1)),
    **sided("foot_front", "foot", (1, -1, -1)),
    **sided("foot_rear", "foot", (1, 1, -1)),
}
SKELETON = (
    ("foot_front_left", "foot_front_right"),
    ("foot_rear_left", "foot_rear_right"),
    ("foot_front_left", "foot_rear_left"),
    ("foot_front_right", "foot_rear_right"),
    ("tip", "foot_front_left"),
    ("tip", "foot_front_right"),
)

Foot = Literal["square", "octagon", "round"]


@dataclass(frozen=True)
class TrafficCone:
    """Parameters of a cone; metres, colours sRGB 0..1.

    height: of the tip; base: the foot's width; flare: 0 straight walls to 1 curved out at the foot; bands: (from, to) as
    shares of the height, of white sheeting; stack: number of cones on one another; light: an amber lamp on top; dark_foot: of
    black rubber.
    """

    height: float = 0.75
    base: float = 0.42
    foot: Foot = "square"
    flare: float = 0.2
    bands: tuple[tuple[float, float], ...] = ((0.35, 0.52), (0.68, 0.8))
    stack: int = 1
    light: bool = False
    dark_foot: bool = True
    color: Color = (0.95, 0.33, 0.06)
    band_color: Color = (0.93, 0.93, 0.92)


def traffic_cone(parameters: TrafficCone | None = None) -> Mesh:
    """The cone in metres, its axis the z axis. Parts: foot, cone, band, and where fitted light; a stack has one of each."""
    p = parameters or TrafficCone()
    skin = coated("plastic", p.color, "matte")
    rubber = Material("rubber", linear((0.08, 0.08, 0.085)), roughness=0.9)
    white = Material("sheeting", linear(p.band_color), roughness=0.35)
    pieces: list[Piece] = []
    for k in range(p.stack):
        lift, turn = k * 0.17 * p.height, 0.4 * k
        solids = [
            Piece("foot", rubber if p.dark_foot else skin, _foot(p)),
            Piece("cone", skin, lathe(_wall(p), 32)),
            *(Piece("band", white, lathe(_band(p, *b), 32)) for b in p.bands),
        ]
        pieces += [Piece(q.part, q.material, moved(turned(q.solid, 2, turn), (0, 0, lift))) for q in solids]
    if p.light:
        top = p.height + (p.stack - 1) * 0.17 * p.height
        pieces += _lamp(top)
    return assemble(pieces, crease_deg=35)


def _radius(p: TrafficCone, share: Float) -> Float:
    """The wall's radius at a share of the height."""
    foot, tip = 0.36 * p.base, 0.028 + 0.012 * p.height
    bend = p.flare * 0.16 * p.base * np.maximum(1 - share / 0.3, 0.0) ** 2
    return foot * (1 - 0.1 * p.flare) * (1 - share) + tip * share + bend


def _wall(p: TrafficCone) -> Float:
    """The cone's profile from its foot, with a rounded tip and a hole in it."""
    share = np.concatenate([np.linspace(0.03, 0.3, 6), np.linspace(0.4, 0.97, 5)])
    r = _radius(p, share)
    tip = [(0.85 * r[-1], p.height), (0.55 * r[-1], p.height), (0.5 * r[-1], p.height - 0.05), (0, p.height - 0.05)]
    return np.concatenate([np.stack([r, share * p.height], axis=1), tip])


def _band(p: TrafficCone, low: float, high: float) -> Float:
    """A sleeve just outside the wall."""
    share = np.linspace(low, high, 4)
    r = _radius(p, share) + 0.004
    rows = np.stack([r, share * p.height], axis=1)
    return np.concatenate([[(r[0] - 0.006, low * p.height)], rows, [(r[-1] - 0.006, high * p.height)]])


def _foot(p: TrafficCone) -> Solid:
    """A flat plate with a low collar."""
    thick, half = 0.035 + 0.02 * p.height, p.base / 2
    collar = lathe(
        [(0.42 * p.base, 0.5 * thick), (0.4 * p.base, thick), (0.37 * p.base, 1.5 * thick), (0.3 * p.base, 1.6 * thick)], 32
    )
    if p.foot == "round":
        plate = lathe([(0, 0), (half, 0), (half, 0.7 * thick), (0.95 * half, thick), (0, thick)], 32)
        return join(plate, collar)
    if p.foot == "square":
        feet = [
            moved(rounded_box((0.3 * half, 0.3 * half, thick), 0.012, 2), (x * 0.8 * half, y * 0.8 * half, thick / 2))
            for x in (-1, 1)
            for y in (-1, 1)
        ]
        ring = superellipse(half, half, 9.0, 40)
        low = 0.25 * thick
    else:
        a = np.pi / 8 + np.arange(8) * np.pi / 4
        ring, feet, low = half / np.cos(np.pi / 8) * np.stack([np.cos(a), np.sin(a)], axis=1), [], 0.0
    levels = ((1.0, low), (1.0, 0.8 * thick), (0.97, thick))
    plate = loft(np.array([np.column_stack([ring * s, np.full(len(ring), z)]) for s, z in levels]))
    return join(plate, collar, *feet)


def _lamp(z: float) -> list[Piece]:
    """A warning lamp with a lens on both sides."""
    case = moved(rounded_box((0.13, 0.09, 0.12), 0.02, 2), (0, 0, z + 0.04))
    lens = lathe([(0.085, -0.03), (0.085, 0.03), (0.07, 0.05), (0, 0.06)], 20)
    back = turned(lens, 0, np.pi)
    both = moved(turned(join(lens, back), 0, np.pi / 2), (0, 0, z + 0.17))
    return [
        Piece("light", coated("lamp_case", (0.95, 0.75, 0.08), "matte"), case),
        Piece("light", lamp("amber", (1.0, 0.55, 0.05), 0.6), both),
    ]


def traffic_cone_random(rng: np.random.Generator) -> Mesh:
    """A cone with all parameters drawn."""
    return traffic_cone(draw(rng))


_COLORS: tuple[Color, ...] = ((0.95, 0.33, 0.06), (0.88, 0.12, 0.08), (0.95, 0.75, 0.08), (0.62, 0.82, 0.12))
_BANDS: tuple[tuple[tuple[float, float], ...], ...] = (
    ((0.35, 0.52), (0.68, 0.8)),
    ((0.42, 0.7),),
    ((0.3, 0.46), (0.6, 0.76)),
    ((0.55, 0.78),),
    ((0.22, 0.36), (0.48, 0.6), (0.72, 0.82)),
    (),
)


def draw(rng: np.random.Generator) -> TrafficCone:
    """The parameters of a random cone."""
    height = float(rng.choice((0.45, 0.5, 0.75, 0.75, 1.0)) * rng.uniform(0.93, 1.07))
    r, g, b = (
        (np.array(_COLORS[int(rng.choice(4, p=(0.66, 0.16, 0.1, 0.08)))]) * rng.uniform(0.88, 1.03)).clip(0.03, 0.97).tolist()
    )
    return TrafficCone(
        height=height,
        base=float(height * rng.uniform(0.5, 0.62) if height < 0.9 else height * rng.uniform(0.4, 0.5)),
        foot=("square", "octagon", "round")[int(rng.choice(3, p=(0.6, 0.2, 0.2)))],
        flare=float(rng.uniform(0, 1)),
        bands=_BANDS[int(rng.choice(6, p=(0.25, 0.2, 0.2, 0.15, 0.1, 0.1)))],
        stack=int(rng.choice((1, 2, 3), p=(0.8, 0.12, 0.08))),
        light=bool(rng.random() < 0.12),
        dark_foot=bool(rng.random() < 0.55),
        color=(r, g, b),
        band_color=(0.94, 0.94, 0.93) if rng.random() < 0.85 else (0.95, 0.85, 0.2),
    )


FAMILY = ZooFamily(
    random=traffic_cone_random,
    home="street",
    classes={"": "street furniture"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
)
