"""Open boxes: crates and bins of five boards, to be filled with objects."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.geometry.open_box import boards
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.paint import Color, coated, linear
from viewsphere_zoo.shapes.solids import Solid, join, moved, rounded_box

WOODS: tuple[Color, ...] = ((0.76, 0.59, 0.41), (0.66, 0.48, 0.3), (0.82, 0.69, 0.51), (0.53, 0.37, 0.22))
PLASTICS: tuple[Color, ...] = ((0.2, 0.33, 0.47), (0.55, 0.56, 0.57), (0.62, 0.11, 0.09), (0.13, 0.38, 0.3), (0.14, 0.14, 0.15))


@dataclass(frozen=True)
class OpenBox:
    """Parameters of a box; outside measures in metres, colours sRGB 0..1."""

    width: float = 0.6
    height: float = 0.25
    length: float = 0.4
    is_wooden: bool = True
    color: Color = WOODS[0]


def open_box(parameters: OpenBox | None = None) -> Mesh:
    """The box in metres, on z = 0. Parts: bottom, side."""
    p = parameters or OpenBox()
    skin = Material("wood", linear(p.color), roughness=0.7) if p.is_wooden else coated("plastic", p.color, "matte")
    solids: list[Solid] = [moved(rounded_box(size, 0.1 * min(size), 2), at) for at, size in boards(p.width, p.height, p.length)]
    return assemble([Piece("bottom", skin, solids[0]), Piece("side", skin, join(*solids[1:]))], crease_deg=35)


def open_box_random(rng: np.random.Generator) -> Mesh:
    """A box with all parameters drawn."""
    width = float(rng.uniform(0.3, 0.8))
    return open_box_sized(rng, (width, width * float(rng.uniform(0.3, 0.6)), width * float(rng.uniform(0.6, 0.9))))


def open_box_sized(rng: np.random.Generator, size: tuple[float, float, float]) -> Mesh:
    """A box of this width, height and length in a random material."""
    is_wooden = bool(rng.random() < 0.5)
    colors = WOODS if is_wooden else PLASTICS
    return open_box(OpenBox(*size, is_wooden, colors[int(rng.integers(len(colors)))]))


FAMILY = ZooFamily(
    random=open_box_random,
    home="place",
    classes={"": "household item"},
    sized=open_box_sized,
)
