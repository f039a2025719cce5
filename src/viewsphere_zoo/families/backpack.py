"""Backpacks: for school, for hiking, with a rolled top, and rucksacks with a buckled flap."""

from __future__ import annotations

import numpy as np

from viewsphere.assets.mesh import Mesh
from viewsphere.model.annotations.keypoints import At, sided
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.sewing.carrying import back, handle, pockets, sides, straps
from viewsphere_zoo.sewing.closings import CLOSINGS
from viewsphere_zoo.sewing.cloth import coats, main_bag
from viewsphere_zoo.sewing.design import Backpack, Style
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.paint import Color
from viewsphere_zoo.shapes.solids import moved

KEYPOINTS = {
    "handle": At("handle", (0, 0, 1)),
    "pocket": At("pocket", (0, -1, 0)),
    **sided("strap", "strap_{}", (0, 1, 0)),
    **sided("bottom_front", "body", (1, -1, -1)),
    **sided("bottom_rear", "body", (1, 1, -1)),
}
SKELETON = (
    ("bottom_front_left", "bottom_front_right"),
    ("bottom_rear_left", "bottom_rear_right"),
    ("bottom_front_left", "bottom_rear_left"),
    ("bottom_front_right", "bottom_rear_right"),
    ("handle", "strap_left"),
    ("handle", "strap_right"),
    ("strap_left", "bottom_rear_left"),
    ("strap_right", "bottom_rear_right"),
)


def backpack(parameters: Backpack | None = None) -> Mesh:
    """The backpack in metres, standing on z = 0, its pockets towards -Y, its straps towards +Y.

    Parts: body, back, strap_left, strap_right, handle, zip, pocket, and by style and equipment side_pocket, bottle, lid, belt,
    buckle, band, mat, patch.
    """
    p = parameters or Backpack()
    c = coats(p)
    bag = main_bag(p)
    pieces = [Piece("body", c["main"], bag.solid()), *back(p, c), *straps(p, c), *handle(p, c)]
    pieces += [*pockets(p, c), *sides(p, c), *CLOSINGS[p.style](p, bag, c)]
    low = min(float(q.solid.vertices[:, 2].min()) for q in pieces)
    return assemble([Piece(q.part, q.material, moved(q.solid, (0, 0, -low))) for q in pieces], crease_deg=45)


def backpack_random(rng: np.random.Generator) -> Mesh:
    """A backpack with all parameters drawn."""
    return backpack(draw(rng))


_CLOTHS: tuple[Color, ...] = (
    (0.12, 0.25, 0.5),
    (0.62, 0.1, 0.12),
    (0.1, 0.1, 0.11),
    (0.2, 0.42, 0.28),
    (0.9, 0.45, 0.1),
    (0.35, 0.37, 0.4),
    (0.92, 0.72, 0.15),
    (0.75, 0.35, 0.5),
    (0.3, 0.6, 0.65),
    (0.45, 0.3, 0.55),
    (0.55, 0.5, 0.38),
    (0.85, 0.84, 0.8),
)
_HIDES: tuple[Color, ...] = ((0.36, 0.22, 0.13), (0.5, 0.33, 0.2), (0.12, 0.1, 0.09))


def draw(rng: np.random.Generator) -> Backpack:
    """The parameters of a random backpack."""
    style: Style = ("school", "hiking", "roll_top", "flap")[int(rng.choice(4, p=(0.4, 0.26, 0.14, 0.2)))]
    first, second, third = (_CLOTHS[int(k)] for k in rng.choice(len(_CLOTHS), 3, replace=False))
    r, g, b = (np.array(first) * rng.uniform(0.85, 1.08)).clip(0.03, 0.95).tolist()
    low, high = {"school": (0.38, 0.48), "hiking": (0.52, 0.68), "roll_top": (0.42, 0.52), "flap": (0.36, 0.46)}[style]
    hide = _HIDES[int(rng.integers(3))]
    return Backpack(
        style=style,
        height=float(rng.uniform(low, high)),
        width=float(rng.uniform(0.27, 0.33)),
        depth=float(rng.uniform(0.15, 0.2) + 0.04 * (style == "hiking")),
        fill=float(rng.uniform(0.2, 1.0)),
        pockets=int(rng.choice((1, 2), p=(0.6, 0.4))) if style in ("school", "hiking") else 1,
        side_pockets=style == "hiking" or bool(rng.random() < 0.7),
        bottle=bool(rng.random() < 0.4),
        mat=style == "hiking" and bool(rng.random() < 0.5),
        color=(r, g, b),
        second=hide if style == "flap" else (r, g, b) if rng.random() < 0.4 else second,
        trim=hide if style == "flap" else (0.07, 0.07, 0.08),
        accent=third,
        seed=int(rng.integers(1 << 31)),
    )


FAMILY = ZooFamily(
    random=backpack_random,
    home="floor",
    classes={"": "household item"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
)
