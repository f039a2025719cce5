"""Cabinets: chests of drawers, wardrobes, sideboards, bedside cabinets, and kitchen units with worktop, sink and hob."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.model.annotations.keypoints import sided
from viewsphere.model.place import LevelFace
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.furnishing.carcass import BOARD, Carcass, Column, carcass, fronts
from viewsphere_zoo.furnishing.casework import Leg, Pull, block, four
from viewsphere_zoo.furnishing.coats import BLACK_STEEL, WHITE_STEEL, Timber, Wood, drawn_wood, furnished, grain
from viewsphere_zoo.furnishing.kitchen import HOB, SINK, hob, sink, worktop
from viewsphere_zoo.joinery.coats import BRASS, CHROME
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.paint import linear
from viewsphere_zoo.shapes.solids import join

KEYPOINTS = {
    **sided("top_front", "worktop|top", (1, -1, 1)),
    **sided("top_rear", "worktop|top", (1, 1, 1)),
    **sided("bottom_front", "side", (1, -1, -1)),
    **sided("bottom_rear", "side", (1, 1, -1)),
}
SKELETON = (
    ("top_front_left", "top_front_right"),
    ("top_rear_left", "top_rear_right"),
    ("top_front_left", "top_rear_left"),
    ("top_front_right", "top_rear_right"),
    ("top_front_left", "bottom_front_left"),
    ("top_front_right", "bottom_front_right"),
    ("top_rear_left", "bottom_rear_left"),
    ("top_rear_right", "bottom_rear_right"),
)

Style = Literal["chest", "wardrobe", "sideboard", "bedside", "kitchen", "wall"]
Base = Literal["legs", "plinth", "feet", "none"]
Metal = Literal["black", "white", "brass", "chrome"]
Stone = Literal["none", "marble", "slate", "white"]
METALS = {"black": BLACK_STEEL, "white": WHITE_STEEL, "brass": BRASS, "chrome": CHROME}
_STONES = {
    "marble": Material("marble", linear((0.86, 0.85, 0.82)), roughness=0.2, clearcoat=0.6, clearcoat_roughness=0.1),
    "slate": Material("slate", linear((0.16, 0.17, 0.18)), roughness=0.35, clearcoat=0.3, clearcoat_roughness=0.2),
    "white": Material("composite", linear((0.9, 0.9, 0.89)), roughness=0.3, clearcoat=0.3, clearcoat_roughness=0.2),
}


@dataclass(frozen=True)
class Cabinet:
    """Parameters of a cabinet; lengths in metres.

    columns: bays side by side, each from below (`carcass.Column`); base: its support, `foot` high; top: thickness of the
    top, and `overhang` of it on three sides; cornice: a moulding instead of a plain top; frame: width of the frame around a
    door's panel, 0 for flat; ajar, pulled: an open door, degrees, and an open drawer; basin, cooker: columns under a sink and a
    hob; gas: burners; stone: of a worktop; contrast: the top's wood, if it differs; seed: of the grain.
    """

    style: Style = "chest"
    width: float = 0.85
    depth: float = 0.45
    height: float = 0.95
    columns: tuple[Column, ...] = (((0.3, "drawer"), (0.3, "drawer"), (0.25, "drawer"), (0.2, "drawer")),)
    base: Base = "legs"
    leg: Leg = "tapered"
    foot: float = 0.12
    top: float = 0.024
    overhang: float = 0.012
    cornice: bool = False
    frame: float = 0.0
    pull: Pull = "knob"
    metal: Metal = "black"
    ajar: float = 0.0
    pulled: float = 0.0
    basin: int | None = None
    cooker: int | None = None
    gas: bool = False
    stone: Stone = "none"
    wood: Wood = field(default_factory=Wood)
    contrast: Wood | None = None
    seed: int = 0

    @property
    def box(self) -> Carcass:
        """The box of boards with its bays."""
        return Carcass(
            half=self.width / 2 - self.overhang,
            depth=self.depth,
            low=self.foot if self.base != "none" else 0.0,
            high=self.height - self.top,
            columns=self.columns,
            frame=self.frame,
            pull=self.pull,
            ajar=self.ajar,
            pulled=self.pulled,
            rails=self.style == "kitchen",
        )

    def middle(self, column: int) -> float:
        """x of the middle of a column."""
        half = self.box.half
        return -half + (column + 0.5) * 2 * half / len(self.columns)


def cabinet(parameters: Cabinet | None = None) -> Mesh:
    """The cabinet in metres: doors and drawers towards -Y, standing on z = 0 (wall units too), centred in x and y when shut.

    Parts: side, carcass, back, top or worktop; door, drawer, handle, leg, plinth, sink, tap, hob, burner, knob by style.
    """
    p = parameters or Cabinet()
    rng = np.random.default_rng(p.seed)
    images, timber = [grain(rng, p.wood)], p.wood.timber(0)
    over = timber
    if p.contrast:
        images.append(grain(rng, p.contrast, 6 if p.style == "kitchen" else 0))
        over = p.contrast.timber(1, "top_wood")
    pieces = [*carcass(p.box, timber), *fronts(p.box, timber, METALS[p.metal]), *_base(p, timber, over), *_top(p, over)]
    return furnished(pieces, images)


def _base(p: Cabinet, timber: Timber, over: Timber) -> list[Piece]:
    """Legs, a recessed plinth, or short feet."""
    x, y, z = p.box.half, p.depth / 2, p.foot
    if p.base == "legs":
        inset = 0.07 if p.leg in ("splayed", "hairpin") else 0.035
        coat = METALS[p.metal] if p.leg == "hairpin" else over.upright
        return [Piece("leg", coat, four(p.leg, (x - inset, y - inset), z, 0.045))]
    if p.base == "feet":
        feet = [
            block(
                (s * (x - 0.045) - 0.035, e * (y - 0.05) - 0.035, 0),
                (s * (x - 0.045) + 0.035, e * (y - 0.05) + 0.035, z),
                0.012,
            )
            for s in (-1, 1)
            for e in (-1, 1)
        ]
        rail = block((-x, -y + 0.006, z - 0.035), (x, -y + 0.024, z), 0.004)
        return [Piece("leg", timber.upright, join(*feet)), Piece("plinth", timber.along, rail)]
    if p.base == "plinth":
        back = 0.05 if p.style == "kitchen" else 0.012
        solids = [block((-x + 0.004, -y + back + BOARD, 0), (x - 0.004, -y + back + 2 * BOARD, z))]
        solids += [
            block((s * (x - 0.013) - 0.009, -y + back + BOARD, 0), (s * (x - 0.013) + 0.009, y - 0.01, z)) for s in (-1, 1)
        ]
        return [Piece("plinth", timber.along, join(*solids))]
    return []


def _top(p: Cabinet, over: Timber) -> list[Piece]:
    """The top or worktop with sink and hob, or a cornice."""
    a, y, z = p.width / 2, p.depth / 2, p.height
    low, high = (-a, -y - p.overhang, z - p.top), (a, y + (0.006 if p.style == "kitchen" else 0.0), z)
    if p.style == "kitchen":
        coat = over.along if p.stone == "none" else _STONES[p.stone]
        found = worktop(coat, low, high, None if p.basin is None else p.middle(p.basin))
        found += [] if p.basin is None else sink(p.middle(p.basin), z)
        return found + ([] if p.cooker is None else hob(p.middle(p.cooker), z, p.gas))
    steps = [block(low, high, 0.004)]
    if p.cornice:
        steps.append(block((-a - 0.02, -y - p.overhang - 0.02, z - 0.5 * p.top), (a + 0.02, y, z + 0.012), 0.006))
        steps.append(block((-a - 0.04, -y - p.overhang - 0.04, z + 0.01), (a + 0.04, y, z + 0.034), 0.008))
    return [Piece("top", over.along, join(*steps))]


def surfaces(parameters: Cabinet) -> tuple[LevelFace, ...]:
    """The top, cut where a sink or a hob is, and the floors of open bays."""
    p, margin = parameters, 0.02
    y = p.depth / 2
    height = p.height + (0.034 if p.cornice and p.style != "kitchen" else 0.0)
    blocked = [] if p.basin is None else [(p.middle(p.basin), SINK[0] / 2 + 0.05)]
    blocked += [] if p.cooker is None else [(p.middle(p.cooker), HOB[0] / 2 + 0.03)]
    edges = [-p.width / 2 + margin, *(e for m, h in sorted(blocked) for e in (m - h, m + h)), p.width / 2 - margin]
    name = "worktop" if p.style == "kitchen" else "top"
    free = [(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a > 0.12]
    found = [
        LevelFace(f"{name}_{k}" if len(free) > 1 else name, (a, -y + margin, b, y - margin), height)
        for k, (a, b) in enumerate(free, 1)
    ]
    for x0, x1, z0, z1, kind, number in p.box.bays:
        if kind == "open":
            rect = (x0 + margin, p.box.face + margin, x1 - margin, y - 0.03)
            floor = z0 + (BOARD / 2 if abs(z0 - BOARD / 2 - p.box.low) < 1e-9 else 0.0)
            found.append(LevelFace(f"bay_{number}", rect, floor, z1 - floor - BOARD / 2))
    return tuple(found)


def cabinet_random(rng: np.random.Generator) -> Mesh:
    """A cabinet with parameters drawn to resemble cabinets in real homes."""
    return cabinet(draw(rng))


def draw(rng: np.random.Generator) -> Cabinet:
    """The parameters of a random cabinet."""
    styles: tuple[Style, ...] = ("chest", "wardrobe", "sideboard", "bedside", "kitchen", "wall")
    style = styles[int(rng.choice(6, p=(0.24, 0.22, 0.2, 0.08, 0.2, 0.06)))]
    drawn = _DRAWS[style](rng)
    opened = rng.random() < 0.55
    has_door = any(kind in ("door", "pair") for column in drawn.columns for _, kind in column)
    bases = _BASES[style]
    base = bases[int(rng.integers(len(bases)))]
    feet = {"legs": rng.uniform(0.11, 0.2), "plinth": rng.uniform(0.06, 0.1), "feet": rng.uniform(0.06, 0.1), "none": 0.0}
    leg: Leg = ("tapered", "square", "splayed", "turned", "hairpin")[int(rng.integers(5))]
    pull: Pull = ("knob", "bar", "cup", "rail")[int(rng.integers(4))]
    return replace(
        drawn,
        base=base,
        leg=leg,
        foot=0.1 if style == "kitchen" else float(feet[base]),
        top=0.038 if style == "kitchen" else float(rng.uniform(0.018, 0.032)),
        overhang=0.0 if style == "wall" else float(rng.uniform(0.006, 0.02)),
        cornice=style == "wardrobe" and bool(rng.random() < 0.5),
        frame=float(rng.uniform(0.05, 0.075)) if rng.random() < 0.45 else 0.0,
        pull=pull,
        metal=("black", "white", "brass", "chrome")[int(rng.choice(4, p=(0.35, 0.1, 0.3, 0.25)))],
        ajar=float(rng.uniform(50, 115)) if opened and has_door else 0.0,
        pulled=float(rng.uniform(0.08, 0.2)) if opened else 0.0,
        gas=bool(rng.random() < 0.5),
        stone=("none", "marble", "slate", "white")[int(rng.integers(4))],
        wood=drawn_wood(rng, 0.45 if style not in ("kitchen", "wall") else 0.75),
        contrast=drawn_wood(rng, 0.0) if style == "kitchen" or rng.random() < 0.3 else None,
        seed=int(rng.integers(1 << 31)),
    )


def _chest(rng: np.random.Generator) -> Cabinet:
    rows = int(rng.integers(3, 6))
    column: Column = tuple((float(1.3 - 0.5 * k / rows), "drawer") for k in range(rows))
    count = 2 if rng.random() < 0.35 else 1
    width = float(rng.uniform(1.15, 1.5) if count == 2 else rng.uniform(0.6, 1.0))
    height = float(0.28 + 0.19 * rows + rng.uniform(-0.05, 0.05))
    return Cabinet(columns=(column,) * count, width=width, depth=float(rng.uniform(0.4, 0.5)), height=height)


def _wardrobe(rng: np.random.Generator) -> Cabinet:
    count = int(rng.choice((1, 2)))
    low: Column = ((0.24, "drawer"),) if rng.random() < 0.5 else ()
    column: Column = (*low, (1.7, "pair"))
    return Cabinet(
        style="wardrobe",
        columns=(column,) * count,
        width=count * float(rng.uniform(0.8, 1.0)),
        depth=float(rng.uniform(0.52, 0.62)),
        height=float(rng.uniform(1.8, 2.25)),
    )


def _sideboard(rng: np.random.Generator) -> Cabinet:
    door: Column = ((1.0, "door"),)
    pair: Column = ((0.7, "pair"), (0.3, "drawer"))
    drawers: Column = ((0.4, "drawer"), (0.33, "drawer"), (0.27, "drawer"))
    bays: Column = ((0.5, "open"), (0.5, "open"))
    layouts: tuple[tuple[Column, ...], ...] = (
        (door, drawers, door),
        (pair, pair),
        (door, bays, door),
        (drawers, ((1.0, "pair"),), bays),
        (pair, bays, pair),
    )
    columns = layouts[int(rng.integers(len(layouts)))]
    width = len(columns) * float(rng.uniform(0.44, 0.55)) + (0.3 if len(columns) == 2 else 0.0)
    depth, height = float(rng.uniform(0.38, 0.46)), float(rng.uniform(0.68, 0.9))
    return Cabinet("sideboard", width, depth, height, columns)


def _bedside(rng: np.random.Generator) -> Cabinet:
    layouts: tuple[Column, ...] = (
        ((0.5, "drawer"), (0.5, "drawer")),
        ((0.5, "open"), (0.5, "drawer")),
        ((0.65, "door"), (0.35, "drawer")),
    )
    width, depth, height = float(rng.uniform(0.4, 0.55)), float(rng.uniform(0.36, 0.42)), float(rng.uniform(0.5, 0.62))
    return Cabinet("bedside", width, depth, height, (layouts[int(rng.integers(3))],))


def _kitchen(rng: np.random.Generator) -> Cabinet:
    units: tuple[Column, ...] = (
        ((1.0, "pair"),),
        ((0.76, "pair"), (0.24, "drawer")),
        ((0.42, "drawer"), (0.34, "drawer"), (0.24, "drawer")),
    )
    count = int(rng.integers(2, 5))
    columns = [units[int(rng.integers(3))] for _ in range(count)]
    places = rng.permutation(count).tolist()
    columns[places[0]] = units[0]
    cooker = places[1] if count > 2 and rng.random() < 0.7 else None
    height = float(rng.uniform(0.87, 0.93))
    return Cabinet("kitchen", count * 0.6 + 0.04, 0.6, height, tuple(columns), basin=places[0], cooker=cooker)


def _wall(rng: np.random.Generator) -> Cabinet:
    count = int(rng.integers(2, 4))
    columns: list[Column] = [((1.0, "pair"),)] * count
    if rng.random() < 0.6:
        columns[int(rng.integers(count))] = ((0.5, "open"), (0.5, "open"))
    return Cabinet("wall", count * 0.5, 0.34, float(rng.uniform(0.6, 0.8)), tuple(columns))


_BASES: dict[Style, tuple[Base, ...]] = {
    "chest": ("legs", "feet"),
    "wardrobe": ("plinth", "feet"),
    "sideboard": ("legs", "legs", "plinth", "feet"),
    "bedside": ("legs", "feet"),
    "kitchen": ("plinth",),
    "wall": ("none",),
}
_DRAWS = {
    "chest": _chest,
    "wardrobe": _wardrobe,
    "sideboard": _sideboard,
    "bedside": _bedside,
    "kitchen": _kitchen,
    "wall": _wall,
}


FAMILY = ZooFamily(
    random=cabinet_random,
    home="floor",
    classes={"": "furniture"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
    surfaces=surfaces,
)
