"""Wheelie bins: the two-wheeled refuse bins of the kerbside (EN 840-1 sizes)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.model.annotations.keypoints import sided
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.paint import Color, coated, linear
from viewsphere_zoo.shapes.solids import Solid, both_sides, join, lathe, loft, moved, rounded_box, superellipse, tube, turned

KEYPOINTS = {
    **sided("wheel", "wheel", (1, 0, 0)),
    **sided("handle", "handle", (1, 1, 0)),
    **sided("lid_front", "lid", (1, -1, 1)),
    **sided("lid_rear", "lid", (1, 1, 1)),
}


@dataclass(frozen=True)
class WheelieBin:
    """Parameters of a bin; metres, colours sRGB 0..1. ajar: how far the lid is open, degrees."""

    width: float = 0.58
    depth: float = 0.62
    height: float = 1.07
    ajar: float = 0.0
    color: Color = (0.2, 0.22, 0.21)
    lid: Color = (0.1, 0.3, 0.16)


def wheelie_bin(parameters: WheelieBin | None = None) -> Mesh:
    """The bin in metres: front towards -Y, wheels and handle behind, on z = 0. Parts: body, lid, rim, handle, wheel_*."""
    p = parameters or WheelieBin()
    body, cover = coated("body", p.color, "matte"), coated("lid", p.lid, "matte")
    rubber = Material("rubber", linear((0.08, 0.08, 0.085)), roughness=0.9)
    top = p.height - 0.09
    z = np.array([0.04, 0.06, 0.3, 0.32, top])
    share = np.array([0.72, 0.76, 0.84, 0.87, 1.0])
    rings = np.empty((len(z), 20, 3))
    rings[..., :2] = superellipse(p.width / 2 - 0.03, p.depth / 2 - 0.05, 7.0, 20) * share[:, None, None]
    rings[..., 2] = z[:, None]
    rim = moved(rounded_box((p.width - 0.02, p.depth - 0.06, 0.05), 0.02, 1), (0, 0, top))
    hinge = p.depth / 2 - 0.03
    handle = tube([(-0.2, hinge + 0.05, top), (0.2, hinge + 0.05, top)], 0.014, 8)
    arms = [moved(rounded_box((0.03, 0.1, 0.06), 0.01, 1), (x, hinge + 0.01, top)) for x in (-0.2, 0.0, 0.2)]
    ribs = [moved(rounded_box((0.03, 0.02, 0.5), 0.008, 1), (x, -p.depth / 2 * 0.84, 0.55)) for x in (-0.14, 0.14)]
    wheel = turned(
        lathe([(0, -0.025), (0.08, -0.025), (0.1, -0.018), (0.1, 0.018), (0.08, 0.025), (0, 0.025)], 14), 1, np.pi / 2
    )
    wheels = moved(wheel, (0.4 * p.width, 0.36 * p.depth, 0.1))
    axle = tube([(-0.4 * p.width, 0.36 * p.depth, 0.1), (0.4 * p.width, 0.36 * p.depth, 0.1)], 0.012, 6)
    feet = [moved(rounded_box((0.1, 0.08, 0.06), 0.015, 1), (s * 0.15, -0.25 * p.depth, 0.03)) for s in (-1, 1)]
    return assemble(
        [
            Piece("body", body, join(loft(rings), *ribs, *feet)),
            Piece("rim", body, rim),
            Piece("lid", cover, _lid(p, top, hinge)),
            Piece("handle", body, join(handle, *arms)),
            Piece("wheel", rubber, join(both_sides(wheels), axle)),
        ],
        crease_deg=35,
    )


def _lid(p: WheelieBin, top: float, hinge: float) -> Solid:
    """A shallow dome that turns about the rear edge."""
    z, share = np.array([0.0, 0.03, 0.055, 0.065]), np.array([1.0, 1.0, 0.93, 0.7])
    rings = np.empty((4, 20, 3))
    rings[..., :2] = superellipse(p.width / 2, p.depth / 2 - 0.02, 7.0, 20) * share[:, None, None]
    rings[..., 1] -= hinge
    rings[..., 2] = z[:, None]
    return moved(turned(loft(rings), 0, -np.radians(p.ajar)), (0, hinge, top + 0.027))


def wheelie_bin_random(rng: np.random.Generator) -> Mesh:
    """A bin with all parameters drawn."""
    return wheelie_bin(draw(rng))


def draw(rng: np.random.Generator) -> WheelieBin:
    """The parameters of a random bin."""
    lids: tuple[Color, ...] = ((0.1, 0.3, 0.16), (0.12, 0.2, 0.45), (0.75, 0.6, 0.08), (0.35, 0.2, 0.12), (0.12, 0.12, 0.13))
    lid = lids[int(rng.integers(5))]
    return WheelieBin(
        width=float(rng.uniform(0.48, 0.6)),
        depth=float(rng.uniform(0.56, 0.72)),
        height=float(rng.uniform(0.95, 1.1)),
        ajar=float(rng.uniform(4, 14)) if rng.random() < 0.3 else 0.0,
        color=lid if rng.random() < 0.4 else (0.17, 0.18, 0.18),
        lid=lid,
    )


FAMILY = ZooFamily(
    random=wheelie_bin_random,
    home="street",
    classes={"": "street furniture"},
    keypoints=KEYPOINTS,
    draw=draw,
)
