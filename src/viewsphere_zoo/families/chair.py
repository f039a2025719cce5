"""Chairs: dining, office, armchairs, stools and folding chairs."""

from __future__ import annotations

import numpy as np

from viewsphere.assets.mesh import Mesh
from viewsphere.model.annotations.keypoints import sided
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.joinery import armchair, dining, folding, office, stool, windsor
from viewsphere_zoo.joinery.armchair import Armchair
from viewsphere_zoo.joinery.dining import Dining
from viewsphere_zoo.joinery.folding import Folding
from viewsphere_zoo.joinery.office import Office
from viewsphere_zoo.joinery.stool import Stool
from viewsphere_zoo.joinery.windsor import Shell, Windsor
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.solids import moved

KEYPOINTS = {
    **sided("seat_front", "seat_pad|seat_cushion|seat|seat_slat", (1, -1, 1)),
    **sided("seat_rear", "seat_pad|seat_cushion|seat|seat_slat", (1, 1, 1)),
    **sided("back_top", "crest_rail|backrest|back_pad|back|back_slat", (1, 0, 1)),
    **sided("foot_front", "leg_front", (1, -1, -1)),
    **sided("foot_rear", "leg_rear", (1, 1, -1)),
    **sided("armrest", "armrest", (1, -1, 1)),
}
SKELETON = (
    ("seat_front_left", "seat_front_right"),
    ("seat_rear_left", "seat_rear_right"),
    ("seat_front_left", "seat_rear_left"),
    ("seat_front_right", "seat_rear_right"),
    ("seat_rear_left", "back_top_left"),
    ("seat_rear_right", "back_top_right"),
    ("back_top_left", "back_top_right"),
    ("seat_front_left", "foot_front_left"),
    ("seat_front_right", "foot_front_right"),
    ("seat_rear_left", "foot_rear_left"),
    ("seat_rear_right", "foot_rear_right"),
)

Chair = Dining | Windsor | Shell | Office | Armchair | Stool | Folding
"""Parameters of a chair, by its style; lengths in metres, colours sRGB 0..1."""


def chair(parameters: Chair | None = None) -> Mesh:
    """The chair in metres: the sitter looks towards -Y, feet on z = 0, centred in x and y.

    Parts, by style: seat, seat_pad, seat_cushion, seat_slat, back_* and backrest, crest_rail, leg_*, foot, stretcher,
    footrest, apron, armrest, base, castor, gas_lift, mechanism, lever, headrest, wing, button, hinge, shell.
    """
    found = _pieces(parameters or Dining())
    corners = np.concatenate([q.solid.vertices for q in found])
    low, high = corners.min(axis=0), corners.max(axis=0)
    home = -(low[0] + high[0]) / 2, -(low[1] + high[1]) / 2, -low[2]
    return assemble([Piece(q.part, q.material, moved(q.solid, home)) for q in found], crease_deg=42)


def _pieces(p: Chair) -> list[Piece]:
    """The pieces of the chair's style."""
    match p:
        case Dining():
            return dining.pieces(p)
        case Windsor():
            return windsor.windsor_pieces(p)
        case Shell():
            return windsor.shell_pieces(p)
        case Office():
            return office.pieces(p)
        case Armchair():
            return armchair.pieces(p)
        case Stool():
            return stool.pieces(p)
        case Folding():
            return folding.pieces(p)


def chair_random(rng: np.random.Generator) -> Mesh:
    """A chair with parameters drawn to resemble chairs in homes and offices."""
    return chair(draw(rng))


def draw(rng: np.random.Generator) -> Chair:
    """The parameters of a random chair."""
    drawers = (dining.draw, windsor.draw_windsor, windsor.draw_shell, office.draw, armchair.draw, stool.draw, folding.draw)
    return drawers[int(rng.choice(len(drawers), p=(0.18, 0.08, 0.06, 0.18, 0.18, 0.16, 0.16)))](rng)


FAMILY = ZooFamily(
    random=chair_random,
    home="floor",
    classes={"": "furniture"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
)
