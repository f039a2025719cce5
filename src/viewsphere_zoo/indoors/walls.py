"""A room's walls: plain surfaces with holes, skirting boards along their feet."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from viewsphere_zoo.indoors.plan import SIDES, Opening, Room, Side
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.solids import Float, Solid, flipped, join, moved, turned
from viewsphere_zoo.townscape import masonry
from viewsphere_zoo.townscape.surfaces import cuboid

SKIRTING = (0.014, 0.085)
"""Thickness and height of skirting boards, metres."""


def on_side(solid: Solid, room: Room, side: Side, outwards: bool = False) -> Solid:
    """Return a solid moved to this side of the room; it faces the room, or outwards.
    It was built on the wall y = 0 that faces -Y, its middle at x = 0.
    """
    quarter = SIDES.index(side) + 2 * outwards
    return moved(turned(solid, 2, -quarter * math.pi / 2), (*room.middle(side), 0.0))


def placed(pieces: Sequence[Piece], room: Room, side: Side) -> list[Piece]:
    """Pieces brought to a side of the room, as `on_side` does."""
    return [Piece(piece.part, piece.material, on_side(piece.solid, room, side)) for piece in pieces]


def wall(length: float, height: float, openings: Sequence[Opening], reveal: float) -> Solid:
    """A wall with its holes; `reveal` is how deep the holes are lined."""
    holes = [masonry.Opening(o.x, o.foot, o.width, o.height) for o in openings]
    return masonry.facade(length, height, holes, reveal=reveal)


def skirting(length: float, openings: Sequence[Opening], trim: float) -> Solid:
    """Boards along the wall's foot, interrupted at doors and their trim."""
    out, high = SKIRTING
    doors = sorted((o.span[0] - trim, o.span[1] + trim) for o in openings if o.foot <= 0)
    ends = [-length / 2, *(edge for span in doors for edge in span), length / 2]
    pairs = zip(ends[::2], ends[1::2], strict=True)
    return join(*(cuboid((a, -out, 0.0), (b, 0.0, high)) for a, b in pairs if b - a > 1e-3))


def level(low: Sequence[float], high: Sequence[float], z: float, faces_up: bool = True) -> Solid:
    """A level rectangle that faces up or down."""
    corners: Float = np.array(
        [(low[0], low[1], z), (high[0], low[1], z), (high[0], high[1], z), (low[0], high[1], z)], np.float64
    )
    solid = Solid(corners, np.array([(0, 1, 2), (0, 2, 3)]))
    return solid if faces_up else flipped(solid)
