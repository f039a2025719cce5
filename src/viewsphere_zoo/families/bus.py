"""Buses: city buses, coaches and double-deckers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.model.annotations.keypoints import At, sided
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.coachwork import saloon
from viewsphere_zoo.coachwork.coats import car_paint, coats
from viewsphere_zoo.coachwork.saloon import Bus, RoofUnit, Style
from viewsphere_zoo.shapes.assembly import assemble
from viewsphere_zoo.shapes.paint import Color, linear

KEYPOINTS = {
    **sided("wheel_front", "wheel_front_{}_rim", (1, 0, 0)),
    **sided("wheel_rear", "wheel_rear_{}_rim", (1, 0, 0)),
    **sided("headlight", "headlight_{}", (0, -1, 0)),
    **sided("taillight", "taillight_{}", (0, 1, 0)),
    **sided("mirror", "mirror_{}"),
    **sided("roof_front", "roof", (1, -1, 1)),
    **sided("roof_rear", "roof", (1, 1, 1)),
    "door": At("door_1"),
    "windshield": At("windshield", (0, -1, 0)),
}
SKELETON = (
    ("roof_front_left", "roof_front_right"),
    ("roof_rear_left", "roof_rear_right"),
    ("roof_front_left", "roof_rear_left"),
    ("roof_front_right", "roof_rear_right"),
    ("roof_front_left", "headlight_left"),
    ("roof_front_right", "headlight_right"),
    ("roof_rear_left", "taillight_left"),
    ("roof_rear_right", "taillight_right"),
    ("headlight_left", "headlight_right"),
    ("taillight_left", "taillight_right"),
    ("wheel_front_left", "wheel_rear_left"),
    ("wheel_front_right", "wheel_rear_right"),
)


def bus(parameters: Bus | None = None) -> Mesh:
    """The bus in metres: front towards -Y, wheels on z = 0, centred in x and y.

    Parts: body, roof, bumper_*, sill, underbody, wheel_arch, wheel_<end>_<side>_tyre and _rim, window_*, windshield, door_1 to
    door_3, destination, headlight_*, indicator_*, taillight_*, reversing_light_*, brake_light, mirror_*, wiper, grille,
    engine_grille, badge, licence_plate, seam, and where fitted stripe, roof_unit, hatch.
    """
    p = parameters or Bus()
    c = coats(p.color, p.roof_color, 0.15, p.rim_color, True, p.glass_color)
    c = replace(
        c,
        cladding=c.paint if p.skirt_color == p.color else car_paint("skirt_paint", p.skirt_color, 0.15),
        letters=Material("stripe", linear(p.stripe_color), roughness=0.35, clearcoat=0.6),
    )
    return assemble(saloon.pieces(p, c), crease_deg=36)


def bus_random(rng: np.random.Generator) -> Mesh:
    """A bus with parameters drawn to resemble real buses."""
    return bus(draw(rng))


_SIZES: dict[Style, tuple[tuple[float, float], tuple[float, float]]] = {
    "city": ((9.2, 12.2), (2.95, 3.15)),
    "coach": ((10.6, 12.9), (3.5, 3.75)),
    "double_decker": ((9.6, 11.2), (4.2, 4.4)),
}
"""Lengths and heights, metres."""

_PAINTS: tuple[Color, ...] = (
    (0.74, 0.07, 0.08),
    (0.93, 0.93, 0.91),
    (0.95, 0.76, 0.08),
    (0.1, 0.3, 0.6),
    (0.12, 0.45, 0.28),
    (0.85, 0.85, 0.8),
    (0.3, 0.62, 0.82),
    (0.93, 0.5, 0.1),
    (0.62, 0.64, 0.67),
    (0.35, 0.12, 0.35),
    (0.45, 0.68, 0.2),
    (0.1, 0.14, 0.28),
)
_PLACES = ("STATION", "CENTRE", "AIRPORT", "MARKET", "HARBOUR", "PARK", "TOWN HALL")


def draw(rng: np.random.Generator) -> Bus:
    """The parameters of a random bus."""
    style: Style = ("city", "coach", "double_decker")[int(rng.choice(3, p=(0.5, 0.27, 0.23)))]
    (short, long), (low, high) = _SIZES[style]
    length = float(rng.uniform(short, long))
    first, second, third = (_PAINTS[int(k)] for k in rng.choice(len(_PAINTS), 3, replace=False))
    color = _shaded(first, rng)
    flush = bool(rng.random() < 0.65)
    units: tuple[RoofUnit, ...] = ("none", "none", "rear") if style == "double_decker" else ("none", "rear", "front", "long")
    return Bus(
        style=style,
        length=length,
        width=float(rng.uniform(2.45, 2.55)),
        height=float(rng.uniform(low, high)),
        roundness=float(rng.uniform(0.05, 1.0)),
        pitch=float(rng.uniform(1.1, 1.9)),
        flush=flush,
        doors=1 + int(style == "coach")
        if style == "coach"
        else int(rng.choice((1, 2, 3), p=(0.2, 0.5, 0.3) if length > 10.8 else (0.4, 0.6, 0.0))),
        door_side=("right", "left")[int(rng.random() < 0.35)],
        split=bool(rng.random() < 0.4),
        lamps=("slim", "block", "round")[int(rng.integers(3))],
        livery=("plain", "stripe", "double", "sweep")[int(rng.integers(4))],
        roof_unit=units[int(rng.integers(len(units)))],
        rear_window=bool(rng.random() < 0.75),
        route=f"{int(rng.integers(1, 100))} {_PLACES[int(rng.integers(len(_PLACES)))]}",
        color=color,
        skirt_color=color if rng.random() < 0.5 else _shaded(second, rng),
        roof_color=color if rng.random() < 0.5 else (0.92, 0.92, 0.9),
        stripe_color=third if rng.random() < 0.7 else (0.94, 0.94, 0.92),
        rim_color=(0.74, 0.75, 0.77) if rng.random() < 0.6 else (0.4, 0.41, 0.43),
        glass_color=(0.12, 0.145, 0.16) if rng.random() < 0.7 else (0.17, 0.17, 0.15),
    )


def _shaded(color: Color, rng: np.random.Generator) -> Color:
    r, g, b = (np.array(color) * rng.uniform(0.88, 1.06)).clip(0.03, 0.96).tolist()
    return r, g, b


FAMILY = ZooFamily(
    random=bus_random,
    home="street",
    classes={"": "vehicle"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
)
