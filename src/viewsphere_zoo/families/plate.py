"""Plates: with a rim, coupe or deep, of porcelain or stoneware, plain, banded or with flowers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.model.annotations.keypoints import At
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.household import charts, dishes, food
from viewsphere_zoo.household.draws import chance, pick, seed, uniform
from viewsphere_zoo.household.vessels import vessel
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.paint import Color, linear
from viewsphere_zoo.shapes.rods import smooth
from viewsphere_zoo.shapes.solids import Float, lathe

KEYPOINTS = {
    "rim_front": At("rim", (0, -1, 0)),
    "rim_rear": At("rim", (0, 1, 0)),
    "base": At("body", (0, 0, -1)),
}
SKELETON = (("base", "rim_front"), ("base", "rim_rear"))

Shape = Literal["rim", "coupe", "deep"]
Content = Literal["none", "cookies", "breakfast"]
SHAPES: dict[Shape, tuple[tuple[float, float], ...]] = {
    "rim": ((0.56, 0), (0.6, 0.1), (0.66, 0.3), (0.72, 0.55), (0.78, 0.66), (0.9, 0.84), (1.0, 1.0)),
    "coupe": ((0.5, 0), (0.56, 0.1), (0.72, 0.24), (0.86, 0.5), (0.95, 0.78), (1.0, 1.0)),
    "deep": ((0.48, 0), (0.53, 0.08), (0.62, 0.34), (0.68, 0.66), (0.73, 0.78), (0.86, 0.88), (1.0, 1.0)),
}
"""The underside from its foot to the lip: shares of radius and height."""


ROUND = 48
"""Sides of a turned body."""


@dataclass(frozen=True)
class Plate:
    """Parameters of a plate; metres, colours sRGB 0..1. bands, flowers: around its rim; matte: stoneware."""

    shape: Shape = "rim"
    radius: float = 0.13
    height: float = 0.022
    color: Color = (0.93, 0.92, 0.9)
    rim: Color | None = None
    colors: tuple[Color, Color] = ((0.12, 0.24, 0.5), (0.75, 0.25, 0.2))
    bands: int = 2
    flowers: int = 0
    matte: bool = False
    content: Content = "none"
    seed: int = 0


def plate(parameters: Plate | None = None) -> Mesh:
    """The plate in metres, its axis on z. Parts: body (the underside), rim, well (the face), and content."""
    p = parameters or Plate()
    outline: Float = np.array(SHAPES[p.shape]) * (p.radius, p.height)
    outer = smooth(np.column_stack([outline, np.zeros(len(outline))]), 3)[:, :2]
    shell = vessel(outer, 0.0045 if p.matte else 0.0035, 0.006 if p.matte else 0.005, 0.002)
    gloss, coat = (0.55, 0.15) if p.matte else (0.2, 0.9)

    def glaze(name: str, color: Color) -> Material:
        return Material(name, linear(color), roughness=gloss, clearcoat=coat, clearcoat_roughness=0.04)

    under = glaze("glaze", p.color)
    face = charts.printed("face", 0, gloss, coat) if p.bands or p.flowers else under
    pieces = [
        Piece("body", under, lathe(np.concatenate([shell.foot, shell.wall[1:]]), ROUND)),
        Piece("rim", glaze("rim", p.rim) if p.rim else under, lathe(shell.lip, ROUND)),
        Piece("well", face, lathe(shell.inside, ROUND)),
    ]
    if p.content != "none":
        foot = 0.9 * p.radius * SHAPES[p.shape][0][0]
        pieces += food.FILLINGS[p.content](np.random.default_rng(p.seed), foot, 0.006 if p.matte else 0.005)
    mesh = assemble(pieces, crease_deg=50)
    if face is under:
        return mesh
    r = p.radius
    image = dishes.banded(r, p.color, p.colors, p.bands, p.flowers)
    return charts.charted(mesh, {"face": charts.flat((-r, -r), (r, r))}, [image])


def plate_random(rng: np.random.Generator) -> Mesh:
    """A plate with all parameters drawn."""
    return plate(draw(rng))


def draw(rng: np.random.Generator) -> Plate:
    """The parameters of a random plate."""
    shape: Shape = ("rim", "coupe", "deep")[int(rng.choice(3, p=(0.6, 0.2, 0.2)))]
    color, first, second = pick(rng, dishes.GLAZES)
    radius = uniform(rng, 0.09, 0.15)
    share = {"rim": (0.15, 0.21), "coupe": (0.17, 0.23), "deep": (0.26, 0.32)}[shape]
    decorated = shape in ("rim", "deep") and chance(rng, 0.4)
    return Plate(
        shape=shape,
        radius=radius,
        height=radius * uniform(rng, *share),
        color=color,
        rim=first if chance(rng, 0.3) else None,
        colors=(first, second),
        bands=int(rng.integers(1, 4)) if decorated or shape == "coupe" or chance(rng, 0.6) else 0,
        flowers=int(rng.integers(8, 15)) if decorated else 0,
        matte=chance(rng, 0.3),
        content=("none", "cookies", "breakfast")[int(rng.choice(3, p=(0.72, 0.16, 0.12)))],
        seed=seed(rng),
    )


FAMILY = ZooFamily(
    random=plate_random,
    home="table",
    classes={"": "household item"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
)
