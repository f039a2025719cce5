"""Tables: dining, coffee and side tables, and desks."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.model.annotations.keypoints import sided
from viewsphere.model.place import LevelFace
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.furnishing.casework import Leg, Pull, block, four, front, handles, pull
from viewsphere_zoo.furnishing.coats import BLACK_STEEL, GLASS, WHITE_STEEL, Timber, Wood, drawn_wood, furnished, grain
from viewsphere_zoo.furnishing.underframes import pedestal, sleds, trestles, tripod
from viewsphere_zoo.joinery.coats import BRASS, CHROME
from viewsphere_zoo.joinery.slabs import level, polygon, slab
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.rods import circle
from viewsphere_zoo.shapes.solids import Float, Solid, join, superellipse

KEYPOINTS = {
    **sided("top_front", "top", (1, -1, 1)),
    **sided("top_rear", "top", (1, 1, 1)),
    **sided("foot_front", "leg|foot", (1, -1, -1)),
    **sided("foot_rear", "leg|foot", (1, 1, -1)),
}
SKELETON = (
    ("top_front_left", "top_front_right"),
    ("top_rear_left", "top_rear_right"),
    ("top_front_left", "top_rear_left"),
    ("top_front_right", "top_rear_right"),
    ("top_front_left", "foot_front_left"),
    ("top_front_right", "foot_front_right"),
    ("top_rear_left", "foot_rear_left"),
    ("top_rear_right", "foot_rear_right"),
)

Style = Literal["dining", "coffee", "side", "desk"]
Top = Literal["rectangle", "oval", "round"]
Frame = Literal["legs", "pedestal", "tripod", "trestle", "sled"]
Metal = Literal["black", "white", "brass", "chrome"]
METALS = {"black": BLACK_STEEL, "white": WHITE_STEEL, "brass": BRASS, "chrome": CHROME}


@dataclass(frozen=True)
class Table:
    """Parameters of a table; lengths in metres.

    frame: the support of the top: legs of the kind `leg`, a pedestal (of metal unless `metal` is black), three feet, trestles
    or frames of steel; apron: height of the rails under the top, 0 for none; shelf: height of a lower shelf, 0 for none;
    drawers: cases of drawers under a desk, or drawers in a side table's apron; riser: height of a ledge at a desk's rear, 0
    for none; painted_frame: legs in a different colour from the top; planks: number of boards glued into the top; seed: of the
    grain.
    """

    style: Style = "dining"
    top: Top = "rectangle"
    frame: Frame = "legs"
    leg: Leg = "square"
    width: float = 1.6
    depth: float = 0.9
    height: float = 0.75
    thickness: float = 0.032
    leg_size: float = 0.065
    apron: float = 0.09
    shelf: float = 0.0
    drawers: int = 0
    riser: float = 0.0
    glass: bool = False
    metal: Metal = "black"
    pull: Pull = "knob"
    wood: Wood = field(default_factory=Wood)
    painted_frame: Wood | None = None
    planks: int = 0
    seed: int = 0

    @property
    def corner(self) -> tuple[float, float]:
        """x and y, positive, of the middle of a leg."""
        inset = self.leg_size / 2 + (0.06 if self.leg in ("splayed", "hairpin") else 0.012)
        if self.top == "rectangle":
            return self.width / 2 - inset, self.depth / 2 - inset
        return 0.62 * self.width / 2, 0.62 * self.depth / 2

    @property
    def under(self) -> float:
        """Height of the underside of the top."""
        return self.height - self.thickness


def table(parameters: Table | None = None) -> Mesh:
    """The table in metres, its long side along x, feet on z = 0, centred; a desk's sitter is at -Y.

    Parts: top; leg, or foot and column; apron, shelf, drawer, handle, case, riser, panel by style.
    """
    p = parameters or Table()
    rng = np.random.default_rng(p.seed)
    images = [grain(rng, p.wood, p.planks)]
    wood = frame = p.wood.timber(0)
    if p.painted_frame:
        images.append(grain(rng, p.painted_frame))
        frame = p.painted_frame.timber(1, "frame")
    pieces = [Piece("top", GLASS if p.glass else wood.along, _top(p)), *_frame(p, frame)]
    if p.shelf:
        x, y = _shelf(p)
        thick = 0.018
        outline = circle(x, 40) * (1, y / x) if p.top != "rectangle" else polygon([(-x, -y), (x, -y), (x, y), (-x, y)], 0.01, 9)
        pieces.append(Piece("shelf", wood.along, slab(outline, level(p.shelf - thick), level(p.shelf), 0.004, 1, 1)))
    return furnished([*pieces, *_drawers(p, wood), *_riser(p, wood)], images)


def _outline(p: Table) -> Float:
    """The top's outline."""
    x, y = p.width / 2, p.depth / 2
    if p.top == "rectangle":
        return polygon([(-x, -y), (x, -y), (x, y), (-x, y)], 0.04 if p.glass or p.planks == 0 else 0.012, 9)
    return superellipse(x, y, 2.0 if p.top == "round" else 2.6, 56)


def _top(p: Table) -> Solid:
    return slab(_outline(p), level(p.under), level(p.height), min(0.008, 0.3 * p.thickness), 1, 2)


def _shelf(p: Table) -> tuple[float, float]:
    """Half width and depth of the lower shelf."""
    x, y = p.corner
    return (0.92 * x, 0.92 * y) if p.top != "rectangle" else (x + 0.2 * p.leg_size, y + 0.2 * p.leg_size)


def _frame(p: Table, wood: Timber) -> list[Piece]:
    """Return the frame under the top."""
    steel = METALS[p.metal]
    if p.frame == "pedestal":
        return pedestal(wood.upright if p.metal == "black" else steel, p.under, min(p.width, p.depth), p.metal == "black")
    if p.frame == "tripod":
        return tripod(wood, p.under, min(p.width, p.depth) / 2)
    if p.frame == "trestle":
        return trestles(wood, p.under, p.width, p.depth, p.leg_size)
    if p.frame == "sled":
        return sleds(steel, p.under, (p.width / 2 - 0.06, p.depth / 2 - 0.04), p.style == "desk")
    coat = steel if p.leg == "hairpin" else wood.upright
    legs = Piece("leg", coat, four(p.leg, p.corner, p.under, p.leg_size))
    return [legs, *_apron(p, wood)]


def _apron(p: Table, wood: Timber) -> list[Piece]:
    """Rails between the legs."""
    if p.apron == 0 or p.leg == "hairpin":
        return []
    (x, y), low = p.corner, p.under - p.apron
    half = 0.011
    set_back = 0.15 * p.leg_size
    solids = [block((-x, s * (y + set_back) - half, low), (x, s * (y + set_back) + half, p.under)) for s in (-1, 1)]
    solids += [block((s * (x + set_back) - half, -y, low), (s * (x + set_back) + half, y, p.under)) for s in (-1, 1)]
    return [Piece("apron", wood.along, join(*solids))]


def _drawers(p: Table, wood: Timber) -> list[Piece]:
    """A case of drawers at one or both ends of a desk, or a drawer in the apron."""
    if p.drawers == 0 or p.top != "rectangle":
        return []
    coat = METALS[p.metal]
    if p.style != "desk":
        x, y = p.corner
        face, low, high = -y - 0.5 * p.leg_size - 0.004, p.under - p.apron + 0.01, p.under - 0.008
        wide = 2 * (x - 0.5 * p.leg_size) / p.drawers
        solids: list[Piece] = []
        grips = []
        for k in range(p.drawers):
            left = -x + 0.5 * p.leg_size + k * wide
            solids += front((left + 0.006, low), (left + wide - 0.006, high), face, wood.along, "drawer")
            grips.append(pull(p.pull, (left + wide / 2, face, (low + high) / 2), 0.1))
        return [*solids, *handles("handle", coat, grips)]
    sides = (-1, 1) if p.drawers == 2 else (1,)
    return [piece for side in sides for piece in _case(p, wood, side, coat)]


def _case(p: Table, wood: Timber, side: int, coat: Material) -> list[Piece]:
    """Three drawers under a desk."""
    wide, low, y = 0.38, 0.1 if p.frame == "legs" else 0.05, p.depth / 2 - 0.05
    outer = side * (p.corner[0] - p.leg_size / 2 - 0.002 if p.frame == "legs" else p.width / 2 - 0.11)
    x0, x1 = sorted((outer, outer - side * wide))
    pieces = [Piece("case", wood.upright, block((x0, -y + 0.02, low), (x1, y, p.under - 0.001)))]
    levels = np.cumsum([low, *(np.array((0.42, 0.3, 0.28)) * (p.under - 0.004 - low))])
    grips = []
    for z0, z1 in pairwise(levels.tolist()):
        pieces += front((x0 + 0.004, z0 + 0.004), (x1 - 0.004, z1), -y, wood.along, "drawer")
        grips.append(pull(p.pull, ((x0 + x1) / 2, -y, z1 - 0.4 * min(z1 - z0, 0.2)), 0.14))
    return [*pieces, *handles("handle", coat, grips)]


def _riser(p: Table, wood: Timber) -> list[Piece]:
    """A ledge over the rear of a desk, and the panel that hides the sitter's legs."""
    if p.style != "desk":
        return []
    x, y = p.width / 2, p.depth / 2
    panel = block((-x + 0.1, y - 0.09, p.under - 0.3), (x - 0.1, y - 0.074, p.under))
    pieces = [Piece("panel", wood.along, panel)]
    if p.riser:
        z = p.height + p.riser
        posts = [block((s * (x - 0.03) - 0.009, y - 0.2, p.height), (s * (x - 0.03) + 0.009, y, z - 0.018)) for s in (-1, 0, 1)]
        board = block((-x, y - 0.21, z - 0.018), (x, y, z))
        back = block((-x, y - 0.012, p.height), (x, y - 0.002, z - 0.018), 0.001)
        pieces.append(Piece("riser", wood.along, join(*posts, board, back)))
    return pieces


def surfaces(parameters: Table) -> tuple[LevelFace, ...]:
    """The top (in front of the riser), the riser's ledge and the lower shelf; for round tops, the square inside."""
    p = parameters
    x, y = p.width / 2, p.depth / 2
    if p.top != "rectangle":
        x, y = 0.7 * x, 0.7 * y
    found = [_shrunk("top", (x, y), p.height)]
    if p.riser:
        found = [LevelFace("top", (0.02 - x, 0.02 - y, x - 0.02, y - 0.22), p.height)]
        found.append(LevelFace("riser", (0.02 - x, y - 0.19, x - 0.02, y - 0.02), p.height + p.riser))
    if p.shelf:
        a, b = _shelf(p)
        share = 0.66 if p.top != "rectangle" else 1.0
        clear = p.under - p.apron - p.shelf
        found.append(_shrunk("shelf", (share * a - p.leg_size / 2, share * b - p.leg_size / 2), p.shelf, clearance=clear))
    return tuple(found)


def table_random(rng: np.random.Generator) -> Mesh:
    """A table with parameters drawn to resemble tables in homes and offices."""
    return table(draw(rng))


def draw(rng: np.random.Generator) -> Table:
    """The parameters of a random table."""
    style: Style = ("dining", "coffee", "side", "desk")[int(rng.choice(4, p=(0.36, 0.24, 0.14, 0.26)))]
    return _DRAWS[style](rng, drawn_wood(rng, 0.2), drawn_wood(rng, 0.9) if rng.random() < 0.3 else None)


def _dining(rng: np.random.Generator, wood: Wood, paint: Wood | None) -> Table:
    top: Top = ("rectangle", "oval", "round")[int(rng.choice(3, p=(0.6, 0.15, 0.25)))]
    frames: tuple[Frame, ...] = ("legs", "legs", "trestle", "sled") if top == "rectangle" else ("legs", "pedestal", "pedestal")
    width = float({"rectangle": rng.uniform(1.2, 2.2), "oval": rng.uniform(1.5, 2.1), "round": rng.uniform(0.9, 1.3)}[top])
    leg: Leg = ("square", "tapered", "turned", "splayed")[int(rng.integers(4))]
    return Table(
        style="dining",
        top=top,
        frame=frames[int(rng.integers(len(frames)))],
        leg="splayed" if top != "rectangle" and leg != "tapered" else leg,
        width=width,
        depth=width if top == "round" else float(rng.uniform(0.78, 1.0)),
        height=float(rng.uniform(0.72, 0.77)),
        thickness=float(rng.uniform(0.022, 0.048)),
        leg_size=float(rng.uniform(0.055, 0.095)),
        apron=0.0 if top != "rectangle" else float(rng.uniform(0.07, 0.11)),
        metal=_metal(rng),
        wood=wood,
        painted_frame=paint,
        planks=int(rng.choice((0, 5, 6))),
        seed=int(rng.integers(1 << 31)),
    )


def _coffee(rng: np.random.Generator, wood: Wood, paint: Wood | None) -> Table:
    top: Top = ("rectangle", "oval", "round")[int(rng.choice(3, p=(0.55, 0.15, 0.3)))]
    leg: Leg = ("square", "tapered", "splayed", "hairpin")[int(rng.integers(4))]
    width = float(rng.uniform(0.75, 0.95) if top == "round" else rng.uniform(0.95, 1.25))
    glass = bool(rng.random() < 0.25)
    shelf = glass or leg in ("square", "tapered")
    return Table(
        style="coffee",
        top=top,
        frame="sled" if top == "rectangle" and leg in ("hairpin", "splayed") and not glass and rng.random() < 0.4 else "legs",
        leg=leg if not glass or leg != "hairpin" else "square",
        width=width,
        depth=width if top == "round" else float(rng.uniform(0.55, 0.7)),
        height=float(rng.uniform(0.38, 0.47)),
        thickness=0.012 if glass else float(rng.uniform(0.022, 0.04)),
        leg_size=float(rng.uniform(0.04, 0.06)),
        apron=0.0 if glass or top != "rectangle" else 0.06,
        shelf=float(rng.uniform(0.12, 0.17)) if shelf else 0.0,
        glass=glass,
        metal=_metal(rng),
        wood=wood,
        painted_frame=paint,
        planks=int(rng.choice((0, 4))),
        seed=int(rng.integers(1 << 31)),
    )


def _side(rng: np.random.Generator, wood: Wood, paint: Wood | None) -> Table:
    square = bool(rng.random() < 0.55)
    frame: Frame = "legs" if square else ("tripod", "legs", "pedestal")[int(rng.integers(3))]
    width = float(rng.uniform(0.42, 0.55) if square else rng.uniform(0.55, 0.7))
    leg: Leg = ("tapered", "turned", "square")[int(rng.integers(3))]
    return Table(
        style="side",
        top="rectangle" if square else "round",
        frame=frame,
        leg=leg,
        width=width,
        depth=width * float(rng.uniform(0.8, 1)) if square else width,
        height=float(rng.uniform(0.5, 0.62)),
        thickness=float(rng.uniform(0.018, 0.028)),
        leg_size=float(rng.uniform(0.034, 0.045)),
        apron=float(rng.uniform(0.1, 0.14)) if square else 0.0,
        shelf=float(rng.uniform(0.14, 0.2)) if frame == "legs" else 0.0,
        drawers=1 if square else 0,
        metal=_metal(rng),
        pull=("knob", "bar", "cup")[int(rng.integers(3))],
        wood=wood,
        painted_frame=paint,
        seed=int(rng.integers(1 << 31)),
    )


def _desk(rng: np.random.Generator, wood: Wood, paint: Wood | None) -> Table:
    leg: Leg = ("square", "tapered", "square")[int(rng.integers(3))]
    return Table(
        style="desk",
        frame="legs" if rng.random() < 0.6 else "sled",
        leg=leg,
        width=float(rng.uniform(1.15, 1.65)),
        depth=float(rng.uniform(0.6, 0.78)),
        height=float(rng.uniform(0.72, 0.76)),
        thickness=float(rng.uniform(0.02, 0.034)),
        leg_size=float(rng.uniform(0.045, 0.06)),
        apron=float(rng.uniform(0.05, 0.09)),
        drawers=int(rng.choice((1, 1, 2))),
        riser=float(rng.uniform(0.14, 0.3)) if rng.random() < 0.3 else 0.0,
        metal=_metal(rng),
        pull=("knob", "bar", "cup", "rail")[int(rng.integers(4))],
        wood=wood,
        painted_frame=paint,
        seed=int(rng.integers(1 << 31)),
    )


def _metal(rng: np.random.Generator) -> Metal:
    return ("black", "white", "brass", "chrome")[int(rng.choice(4, p=(0.5, 0.15, 0.2, 0.15)))]


_DRAWS = {"dining": _dining, "coffee": _coffee, "side": _side, "desk": _desk}


FAMILY = ZooFamily(
    random=table_random,
    home="floor",
    classes={"": "furniture"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
    surfaces=surfaces,
)


def _shrunk(
    name: str, half: tuple[float, float], height: float, margin: float = 0.02, clearance: float = math.inf
) -> LevelFace:
    """The face of a centred rectangle of these half widths, `margin` inside its border."""
    x, y = (max(h - margin, 0.01) for h in half)
    return LevelFace(name, (-x, -y, x, y), height, clearance)
