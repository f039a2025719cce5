"""Post boxes: a pillar, or a box on a post."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.model.annotations.keypoints import At
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.paint import Color, coated, linear
from viewsphere_zoo.shapes.solids import grid, join, lathe, moved, rounded_box

KEYPOINTS = {
    "slot": At("slot", (0, -1, 0)),
    "door": At("door", (0, -1, 0)),
    "top": At("body", (0, 0, 1)),
    "foot": At("base", (0, 0, -1)),
}


@dataclass(frozen=True)
class PostBox:
    """Parameters of a post box; metres, colour sRGB 0..1."""

    style: Literal["pillar", "box"] = "pillar"
    height: float = 1.55
    width: float = 0.46
    color: Color = (0.72, 0.06, 0.07)


def post_box(parameters: PostBox | None = None) -> Mesh:
    """The post box in metres: its slot towards -Y, on z = 0. Parts: base, body, slot, door, plate."""
    p = parameters or PostBox()
    paint = coated("paint", p.color)
    dark = Material("dark", linear((0.05, 0.05, 0.055)), roughness=0.8)
    plate = Material("plate", linear((0.93, 0.93, 0.9)), roughness=0.5)
    return assemble(_pillar(p, paint, dark, plate) if p.style == "pillar" else _box(p, paint, dark, plate), crease_deg=35)


def _pillar(p: PostBox, paint: Material, dark: Material, plate: Material) -> list[Piece]:
    """A round pillar with a domed cap."""
    r, h = p.width / 2, p.height
    foot = [(0, 0), (1.06 * r, 0), (1.06 * r, 0.17), (0.98 * r, 0.19)]
    body = [(0.98 * r, 0.18), (0.98 * r, h - 0.2)]
    cap = [
        (0.98 * r, h - 0.21),
        (1.1 * r, h - 0.19),
        (1.14 * r, h - 0.15),
        (1.12 * r, h - 0.12),
        (0.95 * r, h - 0.07),
        (0.5 * r, h - 0.015),
        (0, h),
    ]
    door = [(np.cos(a), np.sin(a)) for a in np.linspace(-0.85, 0.85, 9) - np.pi / 2]
    skin = np.array([[(1.015 * r * c, 1.015 * r * s, z) for z in (0.3, 0.98)] for c, s in door])
    slot = moved(rounded_box((0.26, 0.06, 0.045), 0.01, 1), (0, -0.95 * r, h - 0.33))
    hood = moved(rounded_box((0.32, 0.09, 0.03), 0.01, 1), (0, -0.95 * r, h - 0.28))
    card = moved(rounded_box((0.16, 0.02, 0.22), 0.004, 1), (0, -1.01 * r, h - 0.52))
    return [
        Piece("base", dark, lathe(foot, 28)),
        Piece("body", paint, join(lathe(body, 28), lathe(cap, 28), hood)),
        Piece("door", paint, grid(skin)),
        Piece("slot", dark, slot),
        Piece("plate", plate, card),
    ]


def _box(p: PostBox, paint: Material, dark: Material, plate: Material) -> list[Piece]:
    """A box with a rounded top on a square post."""
    tall, deep = 0.6, 0.36
    z = p.height - tall / 2
    post = moved(rounded_box((0.1, 0.1, p.height - tall + 0.05), 0.015, 1), (0, 0, (p.height - tall) / 2))
    foot = moved(rounded_box((0.26, 0.26, 0.04), 0.01, 1), (0, 0, 0.02))
    body = moved(rounded_box((p.width, deep, tall), 0.06, 4), (0, 0, z))
    door = moved(rounded_box((p.width - 0.1, 0.02, 0.28), 0.008, 1), (0, -deep / 2, z - 0.1))
    slot = moved(rounded_box((p.width - 0.16, 0.03, 0.035), 0.008, 1), (0, -deep / 2, z + 0.16))
    hood = moved(rounded_box((p.width - 0.1, 0.1, 0.02), 0.006, 1), (0, -deep / 2, z + 0.2))
    card = moved(rounded_box((0.14, 0.012, 0.1), 0.003, 1), (0, -deep / 2 - 0.01, z - 0.08))
    return [
        Piece("base", dark, join(post, foot)),
        Piece("body", paint, join(body, hood)),
        Piece("door", paint, door),
        Piece("slot", dark, slot),
        Piece("plate", plate, card),
    ]


def post_box_random(rng: np.random.Generator) -> Mesh:
    """A post box with all parameters drawn."""
    return post_box(draw(rng))


def draw(rng: np.random.Generator) -> PostBox:
    """The parameters of a random post box."""
    pillar = rng.random() < 0.5
    colors: tuple[Color, ...] = ((0.72, 0.06, 0.07), (0.95, 0.75, 0.08), (0.1, 0.22, 0.55), (0.08, 0.36, 0.2))
    return PostBox(
        style="pillar" if pillar else "box",
        height=float(rng.uniform(1.45, 1.65) if pillar else rng.uniform(1.25, 1.45)),
        width=float(rng.uniform(0.42, 0.5)),
        color=colors[int(rng.integers(4))],
    )


FAMILY = ZooFamily(
    random=post_box_random,
    home="street",
    classes={"": "street furniture"},
    keypoints=KEYPOINTS,
    draw=draw,
)
