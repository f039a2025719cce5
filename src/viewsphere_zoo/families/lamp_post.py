"""Lamp posts: a column with a lantern over the road, or on top."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.model.annotations.keypoints import At
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.paint import Color, coated, lamp, metal
from viewsphere_zoo.shapes.solids import join, lathe, loft, moved, rounded_box, tube, turned
from viewsphere_zoo.townscape.surfaces import cuboid

KEYPOINTS = {
    "foot": At("base|column", (0, 0, -1)),
    "lamp": At("lens|lamp"),
}
SKELETON = (("foot", "lamp"),)

Style = Literal["arm", "swan_neck", "lantern", "globe"]


@dataclass(frozen=True)
class LampPost:
    """Parameters of a lamp post; metres, colour sRGB 0..1. height: to the top; arm: how far its lamp reaches out (-Y)."""

    style: Style = "arm"
    height: float = 5.6
    arm: float = 0.65
    radius: float = 0.06
    color: Color = (0.42, 0.44, 0.46)


def lamp_post(parameters: LampPost | None = None) -> Mesh:
    """The lamp post in metres, its column on the z axis, the lamp reaching towards -Y. Parts: base, column, arm, lamp, lens."""
    p = parameters or LampPost()
    paint = metal("zinc", p.color, 0.45) if p.style == "arm" else coated("paint", p.color, "matte")
    lens = lamp("lens", (0.96, 0.94, 0.86), 0.5)
    head, top = _HEADS[p.style](p, paint, lens)
    return assemble([*_column(p, paint, top), *head], crease_deg=35)


def _column(p: LampPost, paint: Material, top: float) -> list[Piece]:
    """Base with its door, and a tapering column up to `top`."""
    r, foot = p.radius, 1.6 * p.radius
    base = [(0, 0), (1.5 * foot, 0), (1.5 * foot, 0.02), (foot, 0.03), (foot, 0.95), (1.1 * r, 1.08), (r, 1.1)]
    rings = [(r, 1.09), (r, 1.2), (0.72 * r, top), (0, top)]
    door = turned(rounded_box((1.1 * foot, 0.02, 0.42), 0.006, 1), 2, np.pi / 2)
    bands = [(1.02 * r, 1.5), (1.35 * r, 1.51), (1.35 * r, 1.54), (1.02 * r, 1.55)] if p.style in ("lantern", "globe") else []
    solids = [lathe(rings, 16), *([lathe(bands, 16)] if bands else [])]
    return [
        Piece("base", paint, join(lathe(base, 16), moved(door, (0.96 * foot, 0, 0.55)))),
        Piece("column", paint, join(*solids)),
    ]


def _arm(p: LampPost, paint: Material, lens: Material) -> tuple[list[Piece], float]:
    """A slim straight arm with a flat head of light-emitting diodes."""
    z = p.height - 0.09
    path = [(0, 0.0, z - 0.32), (0, -0.02, z - 0.12), (0, -0.12, z - 0.02), (0, -p.arm + 0.25, z + 0.02)]
    head = rounded_box((0.24, 0.55, 0.075), 0.03, 2)
    glass = rounded_box((0.19, 0.4, 0.03), 0.008, 1)
    return [
        Piece("arm", paint, tube(path, 0.035, 10)),
        Piece("lamp", paint, moved(head, (0, -p.arm, z + 0.04))),
        Piece("lens", lens, moved(glass, (0, -p.arm, z + 0.004))),
    ], z - 0.2


def _swan_neck(p: LampPost, paint: Material, lens: Material) -> tuple[list[Piece], float]:
    """A bow that ends in a bell."""
    r = p.arm / 2
    a = np.linspace(0, np.pi, 13)
    z = p.height - r
    bow = np.stack([0 * a, -r + r * np.cos(a), z + r * np.sin(a)], axis=1)
    path = np.concatenate([[(0, 0, z - 0.5)], bow, [(0, -p.arm, z - 0.1)]])
    bell = [(0.03, 0.0), (0.05, -0.02), (0.09, -0.09), (0.2, -0.17), (0.21, -0.19), (0.19, -0.185), (0.0, -0.12)]
    glass = [(0.0, -0.115), (0.1, -0.13), (0.11, -0.18), (0.07, -0.235), (0.0, -0.25)]
    at = (0, -p.arm, z - 0.06)
    return [
        Piece("arm", paint, tube(path, 0.03, 10)),
        Piece("lamp", paint, moved(lathe(bell[::-1], 20), at)),
        Piece("lens", lens, moved(lathe(glass[::-1], 16), at)),
    ], z - 0.35


def _lantern(p: LampPost, paint: Material, lens: Material) -> tuple[list[Piece], float]:
    """An old four-sided lantern on top."""
    z = p.height - 0.72
    low, high, tall = 0.13, 0.21, 0.42
    ring = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], np.float64)
    levels = ((low, 0.0), (high, tall))
    pane = np.array([np.column_stack([0.97 * ring * s, np.full(4, z + h)]) for s, h in levels])
    bars = [tube([(*(ring[k] * low), z), (*(ring[k] * high), z + tall)], 0.013, 6) for k in range(4)]
    roof = np.array(
        [np.column_stack([ring * s, np.full(4, z + h)]) for s, h in ((0.25, 0.42), (0.25, 0.45), (0.12, 0.58), (0.05, 0.62))]
    )
    top = lathe([(0, 0.72), (0.03, 0.69), (0.012, 0.66), (0.05, 0.63), (0.05, 0.6)][::-1], 10)
    foot = lathe([(0.11, 0.01), (0.12, -0.02), (0.05, -0.08), (0.06, -0.14), (0.04, -0.16)][::-1], 12)
    return [
        Piece("arm", paint, moved(foot, (0, 0, z))),
        Piece(
            "lamp",
            paint,
            join(*bars, loft(roof), moved(top, (0, 0, z)), cuboid((-0.14, -0.14, z - 0.02), (0.14, 0.14, z + 0.015))),
        ),
        Piece("lens", lens, loft(pane)),
    ], z - 0.08


def _globe(p: LampPost, paint: Material, lens: Material) -> tuple[list[Piece], float]:
    """A ball of milk glass."""
    a = np.linspace(np.pi / 2, -1.3, 14)
    z = p.height - 0.24
    ball = np.stack([0.23 * np.cos(a), z + 0.23 * np.sin(a)], axis=1)
    cup = [(0.1, z - 0.2), (0.13, z - 0.225), (0.09, z - 0.3), (0.06, z - 0.34)]
    cap = [(0, z + 0.245), (0.09, z + 0.23), (0.13, z + 0.195), (0.12, z + 0.19)]
    return [
        Piece("arm", paint, lathe(cup[::-1], 16)),
        Piece("lamp", paint, lathe(cap[::-1], 16)),
        Piece("lens", lens, lathe(ball[::-1], 24)),
    ], z - 0.3


_HEADS = {"arm": _arm, "swan_neck": _swan_neck, "lantern": _lantern, "globe": _globe}


def lamp_post_random(rng: np.random.Generator) -> Mesh:
    """A lamp post with all parameters drawn."""
    return lamp_post(draw(rng))


def draw(rng: np.random.Generator) -> LampPost:
    """The parameters of a random lamp post."""
    style: Style = ("arm", "swan_neck", "lantern", "globe")[int(rng.choice(4, p=(0.4, 0.2, 0.25, 0.15)))]
    tall = style in ("arm", "swan_neck")
    paints: tuple[Color, ...] = ((0.1, 0.11, 0.12), (0.1, 0.22, 0.17), (0.13, 0.17, 0.25), (0.32, 0.33, 0.34))
    return LampPost(
        style=style,
        height=float(rng.uniform(5.0, 6.0) if tall else rng.uniform(3.8, 4.5)),
        arm=float(rng.uniform(0.55, 0.7) if style == "arm" else rng.uniform(0.6, 0.74)),
        radius=float(rng.uniform(0.05, 0.065)),
        color=(0.6, 0.61, 0.62) if style == "arm" else paints[int(rng.integers(4))],
    )


FAMILY = ZooFamily(
    random=lamp_post_random,
    home="street",
    classes={"": "pole"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
)
