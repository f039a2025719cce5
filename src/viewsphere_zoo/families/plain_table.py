"""Plain tables: a board on four legs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.paint import Color, linear
from viewsphere_zoo.shapes.solids import join, moved, rounded_box

TOPS: tuple[Color, ...] = ((0.76, 0.59, 0.41), (0.66, 0.48, 0.3), (0.33, 0.23, 0.155), (0.9, 0.89, 0.86), (0.6, 0.61, 0.62))

BOARD = 0.03
"""Thickness of the board, metres."""


@dataclass(frozen=True)
class PlainTable:
    """Parameters of a table; metres, colours sRGB 0..1."""

    width: float = 1.2
    height: float = 0.75
    length: float = 0.8
    color: Color = TOPS[0]
    legs: Color = (0.2, 0.2, 0.21)


def plain_table(parameters: PlainTable | None = None) -> Mesh:
    """The table in metres, on z = 0, its top level. Parts: top, and leg if there is room for legs."""
    p = parameters or PlainTable()
    thick = min(BOARD, p.height)
    board = moved(rounded_box((p.width, p.length, thick), 0.15 * thick, 2), (0, 0, p.height - thick / 2))
    pieces = [Piece("top", Material("wood", linear(p.color), roughness=0.5), board)]
    tall = p.height - thick
    if tall > 0:
        wide = min(0.06, 0.1 * min(p.width, p.length))
        x, y = p.width / 2 - wide, p.length / 2 - wide
        leg = rounded_box((wide, wide, tall), 0.1 * wide, 1)
        legs = [moved(leg, (a * x, b * y, tall / 2)) for a in (-1, 1) for b in (-1, 1)]
        pieces.append(Piece("leg", Material("metal", linear(p.legs), metallic=0.4, roughness=0.5), join(*legs)))
    return assemble(pieces, crease_deg=35)


def plain_table_random(rng: np.random.Generator) -> Mesh:
    """A table with all parameters drawn."""
    size = (float(rng.uniform(0.8, 1.8)), float(rng.uniform(0.7, 0.78)), float(rng.uniform(0.6, 0.95)))
    return plain_table_sized(rng, size)


def plain_table_sized(rng: np.random.Generator, size: tuple[float, float, float]) -> Mesh:
    """A table of this width, height and length in a random colour."""
    return plain_table(PlainTable(*size, TOPS[int(rng.integers(len(TOPS)))]))


FAMILY = ZooFamily(
    random=plain_table_random,
    home="place",
    classes={"": "furniture"},
    sized=plain_table_sized,
)
