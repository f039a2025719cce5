"""Lorries: a cab over the front axle, and behind it a box, curtains, an open bed or a tipper's tub."""

from __future__ import annotations

import numpy as np

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.model.annotations.keypoints import At, sided
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.coachwork.cargo import Skin, cargo_pieces
from viewsphere_zoo.coachwork.coats import coats
from viewsphere_zoo.coachwork.lorry import Frame, Load, Truck, cab_pieces, chassis_pieces
from viewsphere_zoo.shapes.assembly import assemble
from viewsphere_zoo.shapes.paint import Color, linear, metal

KEYPOINTS = {
    **sided("wheel_front", "wheel_front_{}_rim", (1, 0, 0)),
    **sided("wheel_rear", "wheel_rear_{}_rim", (1, 0, 0)),
    **sided("headlight", "headlight_{}", (0, -1, 0)),
    **sided("taillight", "taillight_{}", (0, 1, 0)),
    **sided("mirror", "mirror_{}"),
    **sided("load_front", "cargo_frame|cargo_box|cargo_bed", (1, -1, 1)),
    **sided("load_rear", "cargo_frame|cargo_box|cargo_bed", (1, 1, 1)),
    "roof": At("roof", (0, 0, 1)),
    "windshield": At("windshield", (0, -1, 0)),
}
SKELETON = (
    ("headlight_left", "headlight_right"),
    ("taillight_left", "taillight_right"),
    ("load_front_left", "load_front_right"),
    ("load_rear_left", "load_rear_right"),
    ("load_front_left", "load_rear_left"),
    ("load_front_right", "load_rear_right"),
    ("load_rear_left", "taillight_left"),
    ("load_rear_right", "taillight_right"),
    ("wheel_front_left", "wheel_rear_left"),
    ("wheel_front_right", "wheel_rear_right"),
    ("headlight_left", "wheel_front_left"),
    ("headlight_right", "wheel_front_right"),
)


def truck(parameters: Truck | None = None) -> Mesh:
    """The lorry in metres: front towards -Y, wheels on z = 0, centred in x.

    Parts: body (the cab), roof, windshield, window_*, door_handle_*, bumper_*, grille, badge, headlight_*, indicator_*,
    mirror_*, wiper, step, chassis, wheel_<end>_<side>_tyre and _rim, mudguard, mud_flap, taillight_*, licence_plate, underbody,
    and by its load cargo_box, cargo_frame, cargo_door, livery, curtain, strap, cooling_unit, cargo_bed, headboard, load; where
    fitted visor, deflector, tank, battery_box, side_guard.
    """
    p = parameters or Truck()
    c = coats(p.color, p.color, 0.2, p.rim_color, p.painted_bumper, p.glass_color)
    wood: Color = (0.5, 0.47, 0.42) if p.load == "tipper" else (0.62, 0.47, 0.3)
    skin = Skin(
        wall=Material("load_wall", linear(p.load_color), roughness=0.6 if p.load == "curtain" else 0.35, clearcoat=0.3),
        mark=Material("livery", linear(p.mark_color), roughness=0.4, clearcoat=0.4),
        trim=metal("aluminium", (0.7, 0.71, 0.73), 0.4),
        wood=Material("load", linear(wood), roughness=0.9),
    )
    s = Frame(p)
    return assemble([*cab_pieces(s, c), *chassis_pieces(s, c), *cargo_pieces(s, c, skin)], crease_deg=36)


def truck_random(rng: np.random.Generator) -> Mesh:
    """A lorry with parameters drawn to resemble real lorries."""
    return truck(draw(rng))


_PAINTS: tuple[Color, ...] = (
    (0.93, 0.93, 0.91),
    (0.74, 0.07, 0.08),
    (0.1, 0.26, 0.55),
    (0.95, 0.76, 0.08),
    (0.1, 0.4, 0.25),
    (0.93, 0.45, 0.08),
    (0.35, 0.37, 0.4),
    (0.3, 0.55, 0.75),
    (0.45, 0.06, 0.1),
    (0.1, 0.12, 0.2),
    (0.4, 0.25, 0.5),
    (0.5, 0.7, 0.2),
)
_WALLS: tuple[Color, ...] = ((0.93, 0.93, 0.92), (0.93, 0.93, 0.92), (0.86, 0.86, 0.84), (0.75, 0.76, 0.78))
_NAMES = ("EXPRESS", "FRESH FOOD", "MOVING", "CARGO", "DAIRY", "FURNITURE", "BREAD", "TOOLS", "PARCELS", "")


def draw(rng: np.random.Generator) -> Truck:
    """The parameters of a random lorry."""
    load: Load = ("box", "cold_box", "curtain", "dropside", "tipper")[int(rng.choice(5, p=(0.36, 0.14, 0.18, 0.16, 0.16)))]
    light = bool(rng.random() < 0.4)
    axles = 3 if not light and rng.random() < 0.4 else 2
    first, second, third = (_PAINTS[int(k)] for k in rng.choice(len(_PAINTS), 3, replace=False))
    color = _shaded(first, rng)
    cab = float(rng.uniform(2.0, 2.3) if light else rng.uniform(2.6, 2.95))
    tipper = load == "tipper"
    wall = (
        _WALLS[int(rng.integers(len(_WALLS)))] if load in ("box", "cold_box") and rng.random() < 0.65 else _shaded(second, rng)
    )
    boxed = load in ("box", "cold_box", "curtain")
    high = not light and boxed and bool(rng.random() < 0.3)
    length = float(
        rng.uniform(5.6, 6.8) if light else rng.uniform(7.2, 8.4) if tipper or axles == 2 else rng.uniform(8.8, 10.2)
    )
    return Truck(
        load=load,
        length=length,
        width=float(rng.uniform(2.1, 2.3) if light else rng.uniform(2.42, 2.55)),
        height=float(rng.uniform(2.9, 3.3) if light else rng.uniform(3.4, 3.9)),
        cab_length=float(rng.uniform(1.65, 1.85) if light else rng.uniform(1.85, 2.25)),
        cab_width=float(rng.uniform(1.95, 2.1) if light else rng.uniform(2.3, 2.45)),
        cab_height=cab + 0.35 * high,
        roundness=float(rng.uniform(0.05, 1.0)),
        rake=float(rng.uniform(0.05, 0.3)),
        axles=axles,
        wheel_radius=float(rng.uniform(0.37, 0.41) if light else rng.uniform(0.46, 0.52)),
        slats=int(rng.integers(2, 7)),
        chrome=bool(rng.random() < 0.4),
        round_lamps=bool(rng.random() < 0.4),
        high_roof=high,
        visor=bool(rng.random() < 0.5),
        deflector=load in ("box", "curtain") and not high and bool(rng.random() < 0.5),
        livery=("plain", "stripe", "both", "wedge")[int(rng.integers(4))],
        name=_NAMES[int(rng.integers(len(_NAMES)))],
        goods=("none", "gravel", "gravel")[int(rng.integers(3))]
        if tipper
        else ("none", "crates", "pipes")[int(rng.choice(3, p=(0.2, 0.5, 0.3)))],
        color=color,
        load_color=wall,
        mark_color=_legible(third, wall),
        rim_color=((0.76, 0.77, 0.79), (0.5, 0.51, 0.53), (0.6, 0.1, 0.1), (0.9, 0.9, 0.88))[int(rng.integers(4))],
        painted_bumper=bool(rng.random() < 0.5),
    )


def _legible(mark: Color, wall: Color) -> Color:
    """The mark's colour, or white or near-black where it would not stand out from the wall."""
    light = [float(np.dot(c, (0.3, 0.6, 0.1))) for c in (mark, wall)]
    return mark if abs(light[0] - light[1]) > 0.25 else (0.12, 0.13, 0.17) if light[1] > 0.45 else (0.94, 0.94, 0.92)


def _shaded(color: Color, rng: np.random.Generator) -> Color:
    r, g, b = (np.array(color) * rng.uniform(0.88, 1.06)).clip(0.03, 0.96).tolist()
    return r, g, b


FAMILY = ZooFamily(
    random=truck_random,
    home="street",
    classes={"": "vehicle"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
)
