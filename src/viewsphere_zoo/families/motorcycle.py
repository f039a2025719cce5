"""Motorcycles: naked, sports, cruisers, tourers and scooters."""

from __future__ import annotations

import numpy as np

from viewsphere.assets.mesh import Mesh
from viewsphere.model.annotations.keypoints import At, sided
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.motorbike.bodywork import body_pieces
from viewsphere_zoo.motorbike.design import Engine, Motorcycle, Style, coats
from viewsphere_zoo.motorbike.engine import engine_pieces, frame_pieces, middle
from viewsphere_zoo.motorbike.front import front_pieces, steered
from viewsphere_zoo.motorbike.scooter import cover_pieces, scooter_pieces
from viewsphere_zoo.motorbike.wheels import swing_arm, wheel_pieces
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.paint import Color
from viewsphere_zoo.shapes.rods import shifted
from viewsphere_zoo.shapes.solids import moved

KEYPOINTS = {
    "wheel_front": At("wheel_front_hub"),
    "wheel_rear": At("wheel_rear_hub"),
    "headlight": At("headlight", (0, -1, 0)),
    "taillight": At("taillight", (0, 1, 0)),
    "seat": At("seat", (0, 0, 1)),
    "licence_plate": At("licence_plate"),
    **sided("grip", "grip_{}", (1, 0, 0)),
    **sided("mirror", "mirror_{}"),
}
SKELETON = (
    ("wheel_front", "headlight"),
    ("headlight", "grip_left"),
    ("headlight", "grip_right"),
    ("headlight", "seat"),
    ("seat", "taillight"),
    ("taillight", "wheel_rear"),
    ("wheel_front", "wheel_rear"),
    ("grip_left", "mirror_left"),
    ("grip_right", "mirror_right"),
)

__all__ = ["Engine", "Motorcycle", "Style", "draw", "motorcycle", "motorcycle_random"]


def motorcycle(parameters: Motorcycle | None = None) -> Mesh:
    """The motorcycle in metres: front towards -Y, upright, both wheels on z = 0, centred in y.

    Parts: wheel_<end>_tyre, _rim, _hub and _disc, fork, caliper, handlebar, grip_*, lever_*, mirror_*, clock, headlight,
    taillight, indicator_*, seat, engine, exhaust, muffler, mudguard_*, licence_plate, stand; of motorcycles tank, side_panel,
    frame, swing_arm, chain, peg, tail; of scooters leg_shield, floor, rear_body, cover, grab_rail; where fitted fairing,
    windscreen, top_box, pannier, shock.
    """
    p = parameters or Motorcycle()
    c = coats(p)
    pieces = [*front_pieces(p, c), *wheel_pieces(p, 1, c)]
    if p.style == "scooter":
        pieces += [*scooter_pieces(p, c), *steered(cover_pieces(p, c), p)]
    else:
        pivot = shifted(middle(p), 0, 0.27, -0.02)
        pieces += [*frame_pieces(p, c, p.style == "naked"), *swing_arm(p, pivot, c), *engine_pieces(p, c), *body_pieces(p, c)]
    ends = [f([f(q.solid.vertices, axis=0) for q in pieces], axis=0) for f in (np.min, np.max)]
    shift = (0.0, -float(ends[0][1] + ends[1][1]) / 2, -float(ends[0][2]))
    return assemble([Piece(q.part, q.material, moved(q.solid, shift)) for q in pieces], crease_deg=42)


def motorcycle_random(rng: np.random.Generator) -> Mesh:
    """A motorcycle with parameters drawn to resemble real motorcycles."""
    return motorcycle(draw(rng))


_PAINTS: tuple[Color, ...] = (
    (0.7, 0.06, 0.07),
    (0.08, 0.08, 0.09),
    (0.93, 0.93, 0.91),
    (0.08, 0.2, 0.55),
    (0.95, 0.76, 0.08),
    (0.93, 0.42, 0.06),
    (0.2, 0.55, 0.2),
    (0.6, 0.62, 0.65),
    (0.1, 0.28, 0.2),
    (0.4, 0.05, 0.1),
    (0.35, 0.65, 0.68),
    (0.78, 0.7, 0.55),
)
_SEATS: tuple[Color, ...] = ((0.07, 0.07, 0.07), (0.07, 0.07, 0.07), (0.34, 0.2, 0.11), (0.5, 0.45, 0.36))


def draw(rng: np.random.Generator) -> Motorcycle:
    """The parameters of a random motorcycle."""
    style: Style = ("naked", "sport", "cruiser", "tourer", "scooter")[int(rng.choice(5, p=(0.24, 0.2, 0.2, 0.14, 0.22)))]
    first, second, third = (_PAINTS[int(k)] for k in rng.choice(len(_PAINTS), 3, replace=False))
    r, g, b = (np.array(first) * rng.uniform(0.85, 1.06)).clip(0.03, 0.96).tolist()
    base, low, high = {
        "naked": (1.42, 24.0, 27.0),
        "sport": (1.4, 23.0, 25.5),
        "cruiser": (1.64, 30.0, 35.0),
        "tourer": (1.5, 25.0, 28.0),
        "scooter": (1.3, 25.0, 28.0),
    }[style]
    small, cruiser = style == "scooter", style == "cruiser"
    size = float(rng.uniform(0.215, 0.26) if small else rng.uniform(0.295, 0.325) + 0.02 * cruiser)
    engines: tuple[Engine, ...] = ("v_twin", "v_twin", "four") if cruiser else ("four", "single", "v_twin")
    return Motorcycle(
        style=style,
        wheelbase=base * float(rng.uniform(0.96, 1.05)),
        rake=float(rng.uniform(low, high)),
        fork={"sport": 0.66, "cruiser": 0.78, "tourer": 0.74, "scooter": 0.82 - size}.get(style, 0.7)
        + float(rng.uniform(-0.015, 0.025)),
        radius=(size, size * float(rng.uniform(0.96, 1.0) if not cruiser else rng.uniform(0.9, 0.96))),
        tyre=(float(rng.uniform(0.1, 0.125)), float(rng.uniform(0.11, 0.13) if small else rng.uniform(0.14, 0.19))),
        spokes=0 if (cruiser or style == "tourer") and rng.random() < 0.65 else int(rng.choice((3, 5, 6, 7, 10))),
        seat=float(
            {"sport": 0.82, "cruiser": 0.69, "tourer": 0.84, "scooter": 0.77}.get(style, 0.8) + rng.uniform(-0.02, 0.02)
        ),
        bar=(
            float(rng.uniform(0.66, 0.72) if style == "sport" or small else rng.uniform(0.74, 0.88)),
            float(
                rng.uniform(-0.04, 0.0)
                if style == "sport"
                else rng.uniform(0.04, 0.08)
                if small
                else rng.uniform(0.07, 0.14) + 0.12 * cruiser * rng.random()
            ),
        ),
        pull=float(rng.uniform(0.18, 0.3) if cruiser else rng.uniform(0.08, 0.14)),
        engine=engines[int(rng.integers(3))],
        screen=float(rng.uniform(0.3, 0.45)) if style == "tourer" or (cruiser and rng.random() < 0.25) else 0.0,
        top_box=(style == "tourer" and bool(rng.random() < 0.5)) or (small and bool(rng.random() < 0.25)),
        panniers=(style == "tourer" and bool(rng.random() < 0.8)) or (cruiser and bool(rng.random() < 0.35)),
        mufflers=int(rng.choice((1, 2))),
        steering=float(rng.uniform(-22, 22)) if rng.random() < 0.6 else 0.0,
        color=(r, g, b),
        second=(0.09, 0.09, 0.095) if rng.random() < 0.6 else second,
        stripe=third,
        seat_color=_SEATS[int(rng.integers(4))] if style != "sport" else (0.07, 0.07, 0.07),
        rim_color=((0.14, 0.14, 0.15), (0.75, 0.76, 0.78), (0.65, 0.5, 0.2), first)[
            int(rng.choice(4, p=(0.45, 0.3, 0.1, 0.15)))
        ],
        bright=bool(rng.random() < (0.85 if cruiser else 0.5)),
    )


FAMILY = ZooFamily(
    random=motorcycle_random,
    home="street",
    classes={"": "vehicle"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
)
