"""The straps of a backpack, its back, and its pockets."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from viewsphere.assets.mesh import Material
from viewsphere_zoo.sewing.cloth import band, pocket_bag, zip_pieces
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.rods import shifted, smooth
from viewsphere_zoo.shapes.solids import Float, both_sides, join, lathe, mirrored, moved, rounded_box

if TYPE_CHECKING:
    from viewsphere_zoo.sewing.design import Backpack


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


def straps(p: Backpack, c: dict[str, Material]) -> list[Piece]:
    """Two padded straps, webbing and sliders."""
    upper, lower = _strap_line(p)
    wide = 0.062 if p.style != "flap" else 0.045
    pad = band(upper, wide, 0.016 if p.style != "flap" else 0.008)
    web = band(lower, 0.026, 0.004)
    slider = moved(rounded_box((0.036, 0.012, 0.03), 0.005, 1), lower[0])
    edge = band(shifted(upper, 0, 0.007, 0.002), 0.016, 0.006)
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


def back(p: Backpack, c: dict[str, Material]) -> list[Piece]:
    """Padding on the side of the bag against the wearer's back."""
    d = p.depth / 2 * (0.75 + 0.35 * p.fill)
    pads = [
        moved(rounded_box((0.26 * p.width, 0.03, 0.62 * p.height), 0.014, 2), (s * 0.19 * p.width, d - 0.008, 0.45 * p.height))
        for s in (-1, 1)
    ]
    return [Piece("back", c["pad"], join(*pads))]


def handle(p: Backpack, c: dict[str, Material]) -> list[Piece]:
    """A carrying loop."""
    z = p.height - 0.015
    y = 0.35 * p.depth / 2
    line = smooth(
        [(-0.05, y, z - 0.01), (-0.045, y, z + 0.035), (0, y, z + 0.055), (0.045, y, z + 0.035), (0.05, y, z - 0.01)], 4
    )
    return [Piece("handle", c["trim"], band(line, 0.024, 0.006, (0, 1, 0)))]


def pockets(p: Backpack, c: dict[str, Material]) -> list[Piece]:
    """Pockets in front with their zips, a patch on the lower one."""
    d = p.depth / 2 * (0.75 + 0.35 * p.fill)
    sizes = [(0.05, 0.46)] if p.pockets == 1 else [(0.05, 0.36), (0.45, 0.27)]
    pieces: list[Piece] = []
    for k, (foot, tall) in enumerate(sizes):
        w = (0.4 - 0.04 * k) * p.width
        thick = (0.045 + 0.02 * p.fill) * (1.0 - 0.25 * k)
        one = pocket_bag(p, (0, -d - 0.15 * thick, foot * p.height), (w, thick, tall * p.height), k + 1)
        pieces.append(Piece("pocket", c["second"], one.solid(11, 24)))
        pieces += zip_pieces(one, (-165, -15), (0.45, 0.82), c)
        if k == 0 and p.style != "flap":
            at = one.point(np.array([-np.pi / 2]), np.array([0.42]), 0.0)[0]
            pieces.append(Piece("patch", c["accent"], moved(rounded_box((0.075, 0.01, 0.036), 0.004, 2), at)))
    return pieces


def sides(p: Backpack, c: dict[str, Material]) -> list[Piece]:
    """Pockets at the sides, a bottle in one."""
    if not p.side_pockets:
        return []
    x, tall = p.width / 2 - 0.008, 0.36 * p.height
    one = pocket_bag(p, (x, 0, 0.03 * p.height), (0.03, 0.3 * p.depth, tall), 5)
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
