"""Backpacks: for school, for hiking, with a rolled top, and rucksacks with a buckled flap."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.assets.part_points import At, sided
from viewsphere.zoo.shapes.assembly import Piece, assemble
from viewsphere.zoo.shapes.paint import Color, linear, metal
from viewsphere.zoo.shapes.rods import rod, shifted, smooth
from viewsphere.zoo.shapes.sheets import sheet
from viewsphere.zoo.shapes.solids import (
    Float,
    Solid,
    both_sides,
    curve,
    join,
    lathe,
    loft,
    mirrored,
    moved,
    rounded_box,
    tube,
    turned,
)

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

Style = Literal["school", "hiking", "roll_top", "flap"]


@dataclass(frozen=True)
class Backpack:
    """Parameters of a backpack; metres, colours sRGB 0..1.

    height, width, depth: of the bag without pockets; fill: 0 flat to 1 stuffed; pockets: in front, 1 or 2; bottle: in the side
    pocket on its left; mat: a rolled mat below or on top; seed draws the folds.
    """

    style: Style = "school"
    height: float = 0.44
    width: float = 0.3
    depth: float = 0.17
    fill: float = 0.6
    pockets: int = 1
    side_pockets: bool = True
    bottle: bool = False
    mat: bool = False
    color: Color = (0.12, 0.25, 0.5)
    second: Color = (0.12, 0.25, 0.5)
    trim: Color = (0.07, 0.07, 0.08)
    accent: Color = (0.9, 0.45, 0.1)
    seed: int = 0


@dataclass(frozen=True)
class _Bag:
    """A stuffed bag's surface: half width and half depth (metres) by the share of its height, its folds, its exponent."""

    height: float
    across: tuple[tuple[float, float], ...]
    deep: tuple[tuple[float, float], ...]
    folds: Float
    exponent: float = 3.2
    at: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def point(self, angle: Float, share: Float, off: float = 0.0) -> Float:
        """Points (..., 3) at angles about z (-90 degrees: the front) and shares of the height, `off` outside."""
        a, t = np.broadcast_arrays(np.asarray(angle, np.float64), np.asarray(share, np.float64))
        c, s = np.cos(a), np.sin(a)
        reach = (np.abs(c) ** self.exponent + np.abs(s) ** self.exponent) ** (-1 / self.exponent)
        k = np.arange(1, len(self.folds) + 1)
        wave = (self.folds * np.sin(k * a[..., None] + 5 * self.folds * 100 + (3 + 2 * k) * t[..., None])).sum(axis=-1)
        edge = np.clip(np.minimum(t, 1 - t) * 6, 0, 1)
        grow = 1 + wave * edge
        x = (curve(t, self.across) * grow + off) * c * reach
        y = (curve(t, self.deep) * grow + off) * s * reach
        return np.stack([x, y, t * self.height], axis=-1) + self.at

    def solid(self, rings: int = 15, sides: int = 28) -> Solid:
        """The closed bag."""
        t = (1 - np.cos(np.linspace(0, np.pi, rings))) / 2
        a = np.linspace(0, 2 * np.pi, sides, endpoint=False)
        return loft(self.point(a, t[:, None]))


def backpack(parameters: Backpack | None = None) -> Mesh:
    """The backpack in metres, standing on z = 0, its pockets towards -Y, its straps towards +Y.

    Parts: body, back, strap_left, strap_right, handle, zip, pocket, and by style and equipment side_pocket, bottle, lid, belt,
    buckle, band, mat, patch.
    """
    p = parameters or Backpack()
    c = _coats(p)
    bag = _bag(p)
    pieces = [Piece("body", c["main"], bag.solid()), *_back(p, c), *_straps(p, c), *_handle(p, c)]
    pieces += [*_pockets(p, c), *_sides(p, c)]
    pieces += {"school": _school, "hiking": _hiking, "roll_top": _roll_top, "flap": _flap}[p.style](p, bag, c)
    low = min(float(q.solid.vertices[:, 2].min()) for q in pieces)
    return assemble([Piece(q.part, q.material, moved(q.solid, (0, 0, -low))) for q in pieces], crease_deg=45)


def _coats(p: Backpack) -> dict[str, Material]:
    """Cloth in its colours, webbing, buckles."""
    return {
        "main": Material("cloth", linear(p.color), roughness=0.85),
        "second": Material("second_cloth", linear(p.second), roughness=0.85),
        "trim": Material("webbing", linear(p.trim), roughness=0.75),
        "accent": Material("accent", linear(p.accent), roughness=0.6),
        "pad": Material("padding", linear((0.13, 0.13, 0.14)), roughness=0.95),
        "metal": metal("buckle", (0.6, 0.6, 0.61) if p.style != "flap" else (0.72, 0.58, 0.3), 0.35),
        "bottle": Material("bottle", linear((0.75, 0.8, 0.84)), metallic=0.4, roughness=0.25),
    }


def _bag(p: Backpack) -> _Bag:
    """The main compartment."""
    w, d = p.width / 2, p.depth / 2 * (0.75 + 0.35 * p.fill)
    folds = np.random.default_rng(p.seed).normal(0, 0.011, 5)
    top = {"school": 0.62, "hiking": 0.85, "roll_top": 0.92, "flap": 0.8}[p.style]
    shoulder = {"school": 0.8, "hiking": 0.95, "roll_top": 0.97, "flap": 0.94}[p.style]
    thin = {"school": 0.5, "hiking": 0.85, "roll_top": 0.3, "flap": 0.7}[p.style]
    across = ((0.0, 0.84 * w), (0.08, 0.97 * w), (0.4, w), (shoulder, 0.94 * w), (1.0, top * w))
    deep = ((0.0, 0.85 * d), (0.1, d), (0.35, (1.02 + 0.08 * p.fill) * d), (0.8, 0.86 * d), (1.0, thin * d))
    return _Bag(p.height, across, deep, folds)


def _pocket_bag(p: Backpack, at: tuple[float, float, float], size: tuple[float, float, float], seed: int) -> _Bag:
    """A smaller bag: size is half its width, half its depth, its height."""
    w, d, h = size
    folds = np.random.default_rng(p.seed + seed).normal(0, 0.01, 4)
    across = ((0.0, 0.86 * w), (0.12, w), (0.85, 0.97 * w), (1.0, 0.8 * w))
    return _Bag(h, across, ((0.0, 0.7 * d), (0.2, d), (0.75, 0.85 * d), (1.0, 0.45 * d)), folds, 3.6, at)


def _zip(bag: _Bag, angles: tuple[float, float], shares: tuple[float, float], c: dict[str, Material]) -> list[Piece]:
    """A zip that climbs a bag, crosses below its top and comes down again, with its slider."""
    a0, a1 = np.radians(angles)
    low, high = shares
    up = [(a0, s) for s in np.linspace(low, high - 0.05, 5)]
    over = [(a, high) for a in np.linspace(a0 + 0.12, a1 - 0.12, 11)]
    down = [(a1, s) for s in np.linspace(high - 0.05, low, 5)]
    uv = np.array([*up, *over, *down])
    line = bag.point(uv[:, 0], uv[:, 1], 0.003)
    tag = bag.point(np.array([a1 - 0.4]), np.array([high]), 0.012)[0]
    pull = moved(rounded_box((0.012, 0.006, 0.035), 0.003, 1), tag - (0, 0, 0.018))
    return [Piece("zip", c["trim"], tube(line, 0.0045, 5)), Piece("zip", c["metal"], pull)]


def _band(points: Float, width: float, thickness: float, side: tuple[float, float, float] = (1, 0, 0)) -> Solid:
    """A strap of this width along a line (N, 3), its width along `side`."""
    across = np.array((-0.5, -0.2, 0.2, 0.5)) * width
    return sheet(points[:, None] + across[:, None] * np.array(side), thickness)


def _strap_line(p: Backpack) -> tuple[Float, Float]:
    """The left shoulder strap's padded upper part and the webbing below it."""
    d = p.depth / 2
    h, sag = p.height, 0.06 + 0.035 * p.fill
    x = 0.2 * p.width
    top = [
        (x - 0.01, 0.6 * d, 0.95 * h),
        (x, d + 0.02, 0.97 * h),
        (x + 0.02, d + sag, 0.86 * h),
        (x + 0.045, d + sag + 0.012, 0.62 * h),
    ]
    top.append((x + 0.055, d + sag - 0.01, 0.4 * h))
    low = [top[-1], (x + 0.06, d + 0.04, 0.24 * h), (0.42 * p.width, 0.8 * d, 0.1 * h)]
    return smooth(top, 5), smooth(low, 4)


def _straps(p: Backpack, c: dict[str, Material]) -> list[Piece]:
    """Two padded straps, webbing and sliders."""
    upper, lower = _strap_line(p)
    wide = 0.062 if p.style != "flap" else 0.045
    pad = _band(upper, wide, 0.016 if p.style != "flap" else 0.008)
    web = _band(lower, 0.026, 0.004)
    slider = moved(rounded_box((0.036, 0.012, 0.03), 0.005, 1), lower[0])
    edge = _band(shifted(upper, 0, 0.007, 0.002), 0.016, 0.006)
    pieces: list[Piece] = []
    for side, place in (("left", None), ("right", mirrored)):
        for name, solid in (
            ("second" if p.style == "flap" else "trim", pad),
            ("trim", web),
            ("metal", slider),
            ("accent", edge),
        ):
            pieces.append(Piece(f"strap_{side}", c[name], place(solid) if place else solid))
    return pieces


def _back(p: Backpack, c: dict[str, Material]) -> list[Piece]:
    """Padding where the bag lies on a back."""
    d = p.depth / 2 * (0.75 + 0.35 * p.fill)
    pads = [
        moved(rounded_box((0.26 * p.width, 0.03, 0.62 * p.height), 0.014, 2), (s * 0.19 * p.width, d - 0.008, 0.45 * p.height))
        for s in (-1, 1)
    ]
    return [Piece("back", c["pad"], join(*pads))]


def _handle(p: Backpack, c: dict[str, Material]) -> list[Piece]:
    """A loop to carry it by."""
    z = p.height - 0.015
    y = 0.35 * p.depth / 2
    line = smooth(
        [(-0.05, y, z - 0.01), (-0.045, y, z + 0.035), (0, y, z + 0.055), (0.045, y, z + 0.035), (0.05, y, z - 0.01)], 4
    )
    return [Piece("handle", c["trim"], _band(line, 0.024, 0.006, (0, 1, 0)))]


def _pockets(p: Backpack, c: dict[str, Material]) -> list[Piece]:
    """Pockets in front with their zips, a patch on the lower one."""
    d = p.depth / 2 * (0.75 + 0.35 * p.fill)
    sizes = [(0.05, 0.46)] if p.pockets == 1 else [(0.05, 0.36), (0.45, 0.27)]
    pieces: list[Piece] = []
    for k, (foot, tall) in enumerate(sizes):
        w = (0.4 - 0.04 * k) * p.width
        thick = (0.045 + 0.02 * p.fill) * (1.0 - 0.25 * k)
        one = _pocket_bag(p, (0, -d - 0.15 * thick, foot * p.height), (w, thick, tall * p.height), k + 1)
        pieces.append(Piece("pocket", c["second"], one.solid(11, 24)))
        pieces += _zip(one, (-165, -15), (0.45, 0.82), c)
        if k == 0 and p.style != "flap":
            at = one.point(np.array([-np.pi / 2]), np.array([0.42]), 0.0)[0]
            pieces.append(Piece("patch", c["accent"], moved(rounded_box((0.075, 0.01, 0.036), 0.004, 2), at)))
    return pieces


def _sides(p: Backpack, c: dict[str, Material]) -> list[Piece]:
    """Pockets at the sides, a bottle in one."""
    if not p.side_pockets:
        return []
    x, tall = p.width / 2 - 0.008, 0.36 * p.height
    one = _pocket_bag(p, (x, 0, 0.03 * p.height), (0.03, 0.3 * p.depth, tall), 5)
    pieces = [Piece("side_pocket", c["trim"] if p.style != "flap" else c["second"], both_sides(one.solid(9, 18)))]
    if p.bottle:
        profile = [
            (0, 0),
            (0.03, 0),
            (0.033, 0.01),
            (0.033, 0.14),
            (0.018, 0.17),
            (0.018, 0.18),
            (0.022, 0.18),
            (0.022, 0.205),
            (0, 0.207),
        ]
        flask = moved(lathe(profile, 18), (x + 0.018, 0, 0.06 * p.height))
        pieces.append(Piece("bottle", c["bottle"], flask))
    return pieces


def _school(p: Backpack, bag: _Bag, c: dict[str, Material]) -> list[Piece]:
    """A zip over the top."""
    return _zip(bag, (-172, -8), (0.35, 0.9), c)


def _hiking(p: Backpack, bag: _Bag, c: dict[str, Material]) -> list[Piece]:
    """Lid, compression straps, hip belt, a mat on top or below."""
    w, d, h = p.width / 2, p.depth / 2 * (0.75 + 0.35 * p.fill), p.height
    lid = _Bag(
        0.2 * h,
        ((0, 0.98 * w), (0.4, 1.02 * w), (1, 0.78 * w)),
        ((0, 1.05 * d), (0.4, 1.08 * d), (1, 0.7 * d)),
        bag.folds,
        3.4,
        (0, -0.008, 0.86 * h),
    )
    pieces = [Piece("lid", c["second"], lid.solid(9, 26)), *_zip(lid, (-150, -30), (0.35, 0.6), c)]
    bands: list[Solid] = []
    buckles: list[Solid] = []
    for x in (-0.45 * w, 0.45 * w):
        line = np.array([(x, -1.1 * d - 0.01, 0.93 * h), (x, -1.12 * d - 0.02, 0.82 * h), (x, -1.15 * d - 0.02, 0.6 * h)])
        bands.append(_band(line, 0.022, 0.004))
        buckles.append(moved(rounded_box((0.034, 0.014, 0.045), 0.006, 1), line[1]))
    for t in (0.5, 0.68):
        a = np.radians(np.linspace(-60, 40, 9))
        bands.append(both_sides(_band(bag.point(a, np.full(9, t), 0.005), 0.02, 0.004, (0, 0, 1))))
    pieces += [Piece("band", c["trim"], join(*bands)), Piece("buckle", c["trim"], join(*buckles))]
    belt = smooth(
        [
            (0.6 * w, d + 0.01, 0.13 * h),
            (1.05 * w, d + 0.03, 0.14 * h),
            (1.3 * w, d + 0.1, 0.15 * h),
            (1.25 * w, d + 0.2, 0.15 * h),
        ],
        4,
    )
    wing = _band(belt, 0.085, 0.018, (0, 0, 1))
    web = _band(smooth([belt[-1], (1.0 * w, d + 0.25, 0.14 * h), (0.6 * w, d + 0.26, 0.12 * h)], 3), 0.03, 0.004, (0, 0, 1))
    pieces += [Piece("belt", c["trim"], both_sides(wing)), Piece("belt", c["accent"], both_sides(web))]
    if p.mat:
        z = 1.02 * h + 0.075
        pieces.append(Piece("mat", c["accent"], rod((-1.15 * w, 0, z), (1.15 * w, 0, z), 0.065, 22)))
        loops = [
            moved(turned(lathe([(0.066, -0.012), (0.07, -0.012), (0.07, 0.012), (0.066, 0.012)], 20), 1, np.pi / 2), (x, 0, z))
            for x in (-0.6 * w, 0.6 * w)
        ]
        pieces.append(Piece("band", c["trim"], join(*loops)))
    return pieces


def _roll_top(p: Backpack, bag: _Bag, c: dict[str, Material]) -> list[Piece]:
    """The opening rolled up and held by a strap with a buckle."""
    w, d, h = p.width / 2, p.depth / 2, p.height
    a = np.linspace(0.0, 4.2 * np.pi, 40)
    r = 0.012 + 0.02 * (1 - a / a[-1]) + 0.004
    profile = np.stack([r * np.cos(a), r * np.sin(a)], axis=1)
    points = np.array([[(x, y, z + h + 0.02) for y, z in profile] for x in np.linspace(-0.92 * w, 0.92 * w, 3)])
    roll = sheet(points, 0.004)
    core = rod((-0.9 * w, 0, h + 0.02), (0.9 * w, 0, h + 0.02), 0.022, 12)
    line = smooth(
        [
            (0, -1.12 * d - 0.01, 0.62 * h),
            (0, -0.95 * d, 0.85 * h),
            (0, -0.045, h + 0.03),
            (0, 0, h + 0.058),
            (0, 0.04, h + 0.02),
            (0, 0.5 * d, 0.92 * h),
        ],
        4,
    )
    buckle = moved(rounded_box((0.045, 0.016, 0.055), 0.006, 1), (0, -1.02 * d - 0.004, 0.76 * h))
    wraps = [
        _band(
            smooth([(s * 0.9 * w, 0, h + 0.03), (s * (w + 0.012), 0, h - 0.02), (s * (w + 0.004), 0, 0.75 * h)], 4),
            0.024,
            0.004,
            (0, 1, 0),
        )
        for s in (-1, 1)
    ]
    return [
        Piece("lid", c["main"], join(roll, core)),
        Piece("band", c["trim"], join(_band(line, 0.028, 0.004), *wraps)),
        Piece("buckle", c["metal"], buckle),
    ]


def _flap(p: Backpack, bag: _Bag, c: dict[str, Material]) -> list[Piece]:
    """A flap over the top that two straps with buckles hold down."""
    w, d, h = p.width / 2, p.depth / 2 * (0.75 + 0.35 * p.fill), p.height
    line = smooth(
        [
            (0, 0.8 * d, 0.93 * h),
            (0, 0.5 * d, 1.01 * h),
            (0, -0.4 * d, 1.03 * h),
            (0, -1.12 * d, 0.94 * h),
            (0, -1.22 * d, 0.74 * h),
            (0, -1.24 * d - 0.01, 0.58 * h),
        ],
        4,
    )
    x = np.linspace(-1, 1, 11)
    share = np.linspace(0, 1, len(line))
    points = line[:, None] + np.zeros((1, 11, 1))
    points[..., 0] = x * (1.0 * w * (1 - 0.2 * np.clip(share - 0.7, 0, 1) / 0.3))[:, None]
    points[..., 2] -= 0.03 * x**4
    points[..., 1] += (0.02 * x**4) * np.clip(share * 2 - 0.8, 0, 1)[:, None]
    pieces = [Piece("lid", c["second"], sheet(points, 0.008))]
    bands: list[Solid] = []
    buckles: list[Solid] = []
    for s in (-0.5 * w, 0.5 * w):
        down = [
            (s, -1.2 * d - 0.004, 0.84 * h),
            (s, -1.27 * d - 0.014, 0.62 * h),
            (s, -1.3 * d - 0.05, 0.5 * h),
            (s, -1.3 * d - 0.06, 0.3 * h),
        ]
        bands.append(_band(smooth(down, 4), 0.024, 0.006))
        buckles.append(moved(rounded_box((0.036, 0.014, 0.034), 0.004, 1), (s, -1.3 * d - 0.045, 0.52 * h)))
    return [*pieces, Piece("band", c["trim"], join(*bands)), Piece("buckle", c["metal"], join(*buckles))]


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
