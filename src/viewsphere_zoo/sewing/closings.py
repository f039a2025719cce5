"""The closures of a backpack: a zip, a lid with a hip belt below, a rolled top, a buckled flap."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from viewsphere.assets.mesh import Material
from viewsphere_zoo.sewing.cloth import Bag, band, zip_pieces
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.rods import rod, smooth
from viewsphere_zoo.shapes.sheets import sheet
from viewsphere_zoo.shapes.solids import Solid, both_sides, join, lathe, moved, rounded_box, turned

if TYPE_CHECKING:
    from viewsphere_zoo.sewing.design import Backpack


def school(p: Backpack, bag: Bag, c: dict[str, Material]) -> list[Piece]:
    """A zip over the top."""
    return zip_pieces(bag, (-172, -8), (0.35, 0.9), c)


def hiking(p: Backpack, bag: Bag, c: dict[str, Material]) -> list[Piece]:
    """Lid, compression straps, hip belt, a mat on top or below."""
    w, d, h = p.width / 2, p.depth / 2 * (0.75 + 0.35 * p.fill), p.height
    lid = Bag(
        0.2 * h,
        ((0, 0.98 * w), (0.4, 1.02 * w), (1, 0.78 * w)),
        ((0, 1.05 * d), (0.4, 1.08 * d), (1, 0.7 * d)),
        bag.folds,
        3.4,
        (0, -0.008, 0.86 * h),
    )
    pieces = [Piece("lid", c["second"], lid.solid(9, 26)), *zip_pieces(lid, (-150, -30), (0.35, 0.6), c)]
    bands: list[Solid] = []
    buckles: list[Solid] = []
    for x in (-0.45 * w, 0.45 * w):
        line = np.array([(x, -1.1 * d - 0.01, 0.93 * h), (x, -1.12 * d - 0.02, 0.82 * h), (x, -1.15 * d - 0.02, 0.6 * h)])
        bands.append(band(line, 0.022, 0.004))
        buckles.append(moved(rounded_box((0.034, 0.014, 0.045), 0.006, 1), line[1]))
    for t in (0.5, 0.68):
        a = np.radians(np.linspace(-60, 40, 9))
        bands.append(both_sides(band(bag.point(a, np.full(9, t), 0.005), 0.02, 0.004, (0, 0, 1))))
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
    wing = band(belt, 0.085, 0.018, (0, 0, 1))
    web = band(smooth([belt[-1], (1.0 * w, d + 0.25, 0.14 * h), (0.6 * w, d + 0.26, 0.12 * h)], 3), 0.03, 0.004, (0, 0, 1))
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


def roll_top(p: Backpack, bag: Bag, c: dict[str, Material]) -> list[Piece]:
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
        band(
            smooth([(s * 0.9 * w, 0, h + 0.03), (s * (w + 0.012), 0, h - 0.02), (s * (w + 0.004), 0, 0.75 * h)], 4),
            0.024,
            0.004,
            (0, 1, 0),
        )
        for s in (-1, 1)
    ]
    return [
        Piece("lid", c["main"], join(roll, core)),
        Piece("band", c["trim"], join(band(line, 0.028, 0.004), *wraps)),
        Piece("buckle", c["metal"], buckle),
    ]


def flap(p: Backpack, bag: Bag, c: dict[str, Material]) -> list[Piece]:
    """A flap over the top, held down by two straps with buckles."""
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
        bands.append(band(smooth(down, 4), 0.024, 0.006))
        buckles.append(moved(rounded_box((0.036, 0.014, 0.034), 0.004, 1), (s, -1.3 * d - 0.045, 0.52 * h)))
    return [*pieces, Piece("band", c["trim"], join(*bands)), Piece("buckle", c["metal"], join(*buckles))]


CLOSINGS = {"school": school, "hiking": hiking, "roll_top": roll_top, "flap": flap}
"""Maker of a style's closing, from the parameters, the main bag and the materials."""
