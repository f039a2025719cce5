"""Bowls: of porcelain, stoneware, wood and steel, deep or shallow, empty or with food in them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Image, Material, Mesh
from viewsphere.model.annotations.keypoints import At
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.household import charts, dishes, food
from viewsphere_zoo.household.canvas import blank
from viewsphere_zoo.household.draws import chance, pick, seed, uniform
from viewsphere_zoo.household.patterns import PATTERNS
from viewsphere_zoo.household.vessels import vessel
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.paint import Color, linear, metal
from viewsphere_zoo.shapes.solids import curve, lathe

KEYPOINTS = {"rim": At("rim", (0, 0, 1)), "base": At("body", (0, 0, -1))}
SKELETON = (("base", "rim"),)

Shape = Literal["round", "rice", "cone", "straight", "wide"]
Ware = Literal["porcelain", "stoneware", "wood", "steel"]
Content = Literal["none", "soup", "rings", "fruit", "salad"]

SHAPES: dict[Shape, tuple[tuple[float, float], ...]] = {
    "round": ((0, 0.4), (0.04, 0.46), (0.2, 0.72), (0.45, 0.9), (0.75, 0.98), (1, 1.0)),
    "rice": ((0, 0.42), (0.1, 0.4), (0.14, 0.44), (0.3, 0.7), (0.6, 0.88), (1, 1.0)),
    "cone": ((0, 0.36), (0.05, 0.42), (0.5, 0.74), (1, 1.0)),
    "straight": ((0, 0.72), (0.06, 0.84), (0.2, 0.95), (0.5, 1.0), (1, 1.0)),
    "wide": ((0, 0.5), (0.06, 0.56), (0.3, 0.74), (0.62, 0.84), (0.82, 0.89), (1, 1.0)),
}
"""Radii over the height, shares of the largest and of the whole."""


@dataclass(frozen=True)
class Bowl:
    """Parameters of a bowl; metres, colours sRGB 0..1. pattern: one of `PATTERNS`, on the outside, or none;
    bands: number of lines inside.
    """

    shape: Shape = "round"
    ware: Ware = "porcelain"
    height: float = 0.07
    radius: float = 0.08
    color: Color = (0.93, 0.92, 0.9)
    inside: Color = (0.94, 0.93, 0.91)
    rim: Color | None = None
    pattern: str = ""
    colors: tuple[Color, Color] = ((0.15, 0.3, 0.55), (0.8, 0.3, 0.2))
    bands: int = 0
    content: Content = "none"
    seed: int = 0


def bowl(parameters: Bowl | None = None) -> Mesh:
    """The bowl in metres, its axis on z. Parts: body, rim, inside, and content unless it is empty."""
    p = parameters or Bowl()
    wall = {"porcelain": 0.0035, "stoneware": 0.005, "wood": 0.007, "steel": 0.0014}[p.ware]
    h = np.array([k for k, _ in SHAPES[p.shape]])
    h = np.unique(np.concatenate([np.linspace(0, 1, 11), h]).round(4))
    shell = vessel(np.stack([p.radius * curve(h, SHAPES[p.shape]), p.height * h], axis=1), wall, 0.006, 0.002)
    coats = _coats(p)
    pieces = [
        Piece("body", coats["outside"], lathe(shell.wall, 44)),
        Piece("body", coats["foot"], lathe(shell.foot, 44)),
        Piece("rim", coats["rim"], lathe(shell.lip, 44)),
        Piece("inside", coats["inside"], lathe(shell.inside, 44)),
    ]
    images, pictures = _pictures(p)
    rng = np.random.default_rng(p.seed)
    if p.content != "none":
        level = (0.6 if p.content in ("fruit", "salad") else 0.72) * p.height
        filling = food.FILLINGS[p.content](rng, shell.radius_inside(level), level)
        pieces += [replace(q, solid=shell.holding(q.solid, wall / 2)) for q in filling]
    return charts.charted(assemble(pieces, crease_deg=50), pictures, images)


def _coats(p: Bowl) -> dict[str, Material]:
    """The materials of its surfaces."""
    if p.ware == "steel":
        steel = metal("steel", p.color, 0.28)
        return dict.fromkeys(("outside", "foot", "rim", "inside"), steel)
    gloss, coat = {"porcelain": (0.22, 0.8), "stoneware": (0.5, 0.2), "wood": (0.6, 0.0)}[p.ware]
    if p.ware == "wood":
        grain = charts.printed("wood", 0, gloss)
        return dict.fromkeys(("outside", "foot", "rim", "inside"), grain)

    def glaze(name: str, color: Color) -> Material:
        return Material(name, linear(color), roughness=gloss, clearcoat=coat, clearcoat_roughness=0.05)

    foot = glaze("glaze", p.color)
    return {
        "foot": foot,
        "rim": glaze("rim", p.rim) if p.rim else foot,
        "outside": charts.printed("print", 0, gloss, coat) if p.pattern else foot,
        "inside": charts.printed("well", int(bool(p.pattern)), gloss, coat) if p.bands else glaze("inside", p.inside),
    }


def _pictures(p: Bowl) -> tuple[list[Image], dict[str, charts.Chart]]:
    """The bowl's prints, and their mapping to its surface."""
    rng = np.random.default_rng(p.seed)
    r = p.radius
    if p.ware == "steel":
        return [], {}
    if p.ware == "wood":
        return [dishes.wood(rng, p.color)], {"wood": charts.flat((-r, -r), (r, r))}
    images: list[Image] = []
    pictures: dict[str, charts.Chart] = {}
    if p.pattern:
        canvas = blank(2 * np.pi * 0.9 * r, p.height, p.color)
        PATTERNS[p.pattern](canvas, p.colors, rng)
        images.append(canvas.image("print"))
        pictures["print"] = charts.wound(0, p.height)
    if p.bands:
        images.append(dishes.banded(r, p.inside, p.colors, p.bands))
        pictures["well"] = charts.flat((-r, -r), (r, r))
    return images, pictures


def bowl_random(rng: np.random.Generator) -> Mesh:
    """A bowl with all parameters drawn."""
    return bowl(draw(rng))


def draw(rng: np.random.Generator) -> Bowl:
    """The parameters of a random bowl."""
    ware: Ware = ("porcelain", "stoneware", "wood", "steel")[int(rng.choice(4, p=(0.46, 0.26, 0.14, 0.14)))]
    shape: Shape = ("round", "rice", "cone", "straight", "wide")[int(rng.choice(5, p=(0.34, 0.22, 0.18, 0.14, 0.12)))]
    if ware in ("wood", "steel"):
        shape = pick(rng, ("round", "cone", "wide") if ware == "steel" else ("round", "straight", "cone"))
    radius = uniform(rng, 0.058, 0.095) if ware in ("porcelain", "stoneware") else uniform(rng, 0.08, 0.13)
    color, first, second = pick(rng, dishes.GLAZES)
    color = {"wood": pick(rng, dishes.WOODS), "steel": (0.76, 0.76, 0.77)}.get(ware, color)
    bare = ware in ("wood", "steel")
    patterns = ("rings", "uprights", "dots", "checks", "zigzag", "sprigs", "dipped", "speckled", "diamonds")
    return Bowl(
        shape=shape,
        ware=ware,
        height=radius * (uniform(rng, 0.76, 0.95) if shape != "wide" else uniform(rng, 0.62, 0.72)),
        radius=radius,
        color=color,
        inside=color if chance(rng, 0.45) else ((0.93, 0.92, 0.89) if chance(rng, 0.6) else first),
        rim=first if chance(rng, 0.3) else None,
        pattern=pick(rng, patterns) if not bare and chance(rng, 0.6) else "",
        colors=(first, second),
        bands=int(rng.integers(1, 4)) if not bare and chance(rng, 0.35) else 0,
        content=("none", "soup", "rings", "fruit", "salad")[int(rng.choice(5, p=(0.52, 0.14, 0.12, 0.14, 0.08)))],
        seed=seed(rng),
    )


FAMILY = ZooFamily(
    random=bowl_random,
    home="table",
    classes={"": "household item"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
)
