"""Potted plants: small trees, palms, ferns, snake plants, succulents, cacti, in pots of clay or glaze."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Image, Material, Mesh
from viewsphere.model.annotations.keypoints import At
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.household import charts
from viewsphere_zoo.household.canvas import blank
from viewsphere_zoo.household.draws import chance, pick, seed, uniform
from viewsphere_zoo.household.greenery import HABITS, Bed
from viewsphere_zoo.household.patterns import PATTERNS
from viewsphere_zoo.household.vessels import vessel
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.paint import Color, linear
from viewsphere_zoo.shapes.solids import Float, Solid, curve, lathe, moved
from viewsphere_zoo.townscape.surfaces import finished, waves

KEYPOINTS = {
    "pot_rim": At("pot", (0, 0, 1)),
    "pot_base": At("pot", (0, 0, -1)),
    "top": At("leaves|stems", (0, 0, 1)),
}
SKELETON = (("pot_base", "pot_rim"), ("pot_rim", "top"))

Pot = Literal["clay", "cylinder", "bowl", "tapered", "barrel"]
POTS: dict[Pot, tuple[tuple[float, float], ...]] = {
    "clay": ((0, 0.66), (0.02, 0.67), (0.74, 0.88), (0.75, 0.88), (0.76, 0.99), (0.98, 1.0), (1, 0.99)),
    "cylinder": ((0, 0.95), (0.04, 1.0), (1, 1.0)),
    "bowl": ((0, 0.5), (0.08, 0.66), (0.35, 0.9), (0.7, 1.0), (1, 0.96)),
    "tapered": ((0, 0.7), (0.03, 0.73), (1, 1.0)),
    "barrel": ((0, 0.7), (0.1, 0.8), (0.45, 1.0), (0.85, 0.9), (0.92, 0.9), (1, 0.95)),
}
"""Radii over the height, shares of the largest and of the whole."""


SPREAD = {
    **{"ficus": 1.05, "rubber": 0.8, "snake": 0.6, "fern": 2.25, "rosette": 2.55},
    **{"aloe": 1.4, "cactus": 0.85, "hearts": 2.05, "palm": 1.3},
}
"""Largest width of each habit, in multiples of its reach."""


@dataclass(frozen=True)
class Plant:
    """Parameters of a potted plant; metres, colours sRGB 0..1.

    habit: one of `HABITS`; reach: how far it grows above the soil; pattern: one of `PATTERNS` on the pot, or none;
    saucer: whether a saucer is under the pot.
    """

    habit: str = "ficus"
    reach: float = 0.4
    green: Color = (0.2, 0.4, 0.15)
    pot: Pot = "clay"
    radius: float = 0.08
    height: float = 0.14
    color: Color = (0.72, 0.4, 0.26)
    colors: tuple[Color, Color] = ((0.93, 0.9, 0.84), (0.35, 0.22, 0.16))
    pattern: str = ""
    matte: bool = True
    saucer: bool = True
    seed: int = 0

    @property
    def extent(self) -> tuple[float, float, float]:
        """Greatest width, depth and height of the whole model, metres."""
        wide = 1.05 * max(SPREAD[self.habit] * self.reach, 2.3 * self.radius)
        return wide, wide, self.height + 1.1 * self.reach


def plant(parameters: Plant | None = None) -> Mesh:
    """The plant in metres, its pot on the z axis.

    Parts: pot, soil, leaves; saucer, stems, spines and flowers if it has them.
    """
    p = parameters or Plant()
    rng = np.random.default_rng(p.seed)
    lift = 0.006 if p.saucer else 0.0
    h = np.unique(np.concatenate([np.linspace(0, 1, 9), [k for k, _ in POTS[p.pot]]]).round(4))
    shell = vessel(np.stack([p.radius * curve(h, POTS[p.pot]), p.height * h], axis=1), 0.006, 0.01, 0.003)
    glaze = Material("pot", linear(p.color), roughness=0.85 if p.matte else 0.3, clearcoat=0.0 if p.matte else 0.6)
    coat = charts.printed("print", 0, 0.8 if p.matte else 0.3, 0.0 if p.matte else 0.6) if p.pattern else glaze
    level = 0.88 * p.height
    r = shell.radius_inside(level) + 0.002
    pieces = [
        Piece("pot", coat, _raised(lathe(shell.wall, 28), lift)),
        *(Piece("pot", glaze, _raised(lathe(part, 28), lift)) for part in (shell.foot, shell.lip, shell.inside)),
        Piece("soil", Material("soil", linear((0.2, 0.14, 0.1)), roughness=1.0), _raised(_soil(rng, r, level), lift)),
    ]
    if p.saucer:
        foot = p.radius * POTS[p.pot][0][1]
        dish = [(0, 0), (1.1 * foot, 0), (1.3 * foot, 0.02), (1.26 * foot, 0.021), (1.08 * foot, 0.006), (0, 0.006)]
        pieces.append(Piece("saucer", glaze, lathe(dish, 28)))
    grown = HABITS[p.habit](rng, Bed(r, level + lift, p.reach, p.green))
    pieces += [replace(q, solid=_above(q.solid)) for q in grown]
    tone, (images, pictures) = rng.spawn(1)[0], _print(p, lift)

    def lit(points: Float) -> Float:
        rise = np.clip((points[:, 2] - level) / p.reach, 0, 1)
        light = 0.68 + 0.26 * rise + 0.1 * waves(tone, points, 0.08)
        return np.stack([light, light, 0.94 * light], axis=1)

    def banded(points: Float) -> Float:
        wave = np.sin(points[:, 2] * 210 + 2.5 * waves(tone, points, 0.03))
        return lit(points) * (0.8 + 0.25 * wave)[:, None]

    def crumbled(points: Float) -> Float:
        return 0.75 + 0.3 * waves(tone, points, 0.008)

    tints = {"leaf": banded if p.habit == "snake" else lit, "soil": crumbled}
    return charts.charted(finished(pieces, (), tints, crease_deg=60), pictures, images)


def _raised(solid: Solid, by: float) -> Solid:
    return moved(solid, (0, 0, by))


def _above(solid: Solid) -> Solid:
    """The solid, with all parts below the table raised onto it."""
    return Solid(np.maximum(solid.vertices, (-np.inf, -np.inf, 0.002)), solid.triangles)


def _soil(rng: np.random.Generator, radius: float, level: float) -> Solid:
    """The earth in the pot, uneven."""
    disc = lathe([(radius, level - 0.004), *((radius * s, level) for s in (0.9, 0.7, 0.5, 0.3, 0.12)), (0, level)], 30)
    bumps = 0.0035 * waves(rng, disc.vertices[:, :2], 0.02) * (np.hypot(*disc.vertices[:, :2].T) < 0.85 * radius)
    return Solid(disc.vertices + np.column_stack([0 * bumps, 0 * bumps, bumps]), disc.triangles)


def _print(p: Plant, lift: float) -> tuple[list[Image], dict[str, charts.Chart]]:
    if not p.pattern:
        return [], {}
    canvas = blank(2 * np.pi * p.radius, p.height, p.color)
    PATTERNS[p.pattern](canvas, p.colors, np.random.default_rng(p.seed))
    return [canvas.image("print")], {"print": charts.wound(lift, p.height + lift)}


def plant_random(rng: np.random.Generator) -> Mesh:
    """A potted plant with all parameters drawn."""
    return plant(draw(rng))


def draw(rng: np.random.Generator) -> Plant:
    """The parameters of a random potted plant."""
    habit = pick(rng, (*HABITS,))
    reach, wide, greens = _HABITS[habit]
    radius = uniform(rng, *wide)
    r, g, b = (np.array(pick(rng, greens)) * rng.uniform(0.9, 1.1)).tolist()
    clay = chance(rng, 0.35)
    color, first, second = pick(rng, _CLAYS if clay else _GLAZES)
    shape: Pot = "clay" if clay else pick(rng, ("cylinder", "bowl", "tapered", "barrel"))
    patterns = ("rings", "uprights", "dots", "zigzag", "diamonds", "dipped", "speckled", "hills")
    return Plant(
        habit=habit,
        reach=uniform(rng, *reach),
        green=(r, g, b),
        pot=shape,
        radius=radius,
        height=radius * (uniform(rng, 1.05, 1.3) if shape == "bowl" else uniform(rng, 1.45, 1.95)),
        color=color,
        colors=(first, second),
        pattern=pick(rng, patterns) if chance(rng, 0.25 if clay else 0.5) else "",
        matte=clay or chance(rng, 0.35),
        saucer=clay or chance(rng, 0.2),
        seed=seed(rng),
    )


Greens = tuple[Color, ...]
_FRESH: Greens = ((0.3, 0.52, 0.16), (0.24, 0.46, 0.16), (0.38, 0.56, 0.2))
_DEEP: Greens = ((0.14, 0.32, 0.13), (0.18, 0.38, 0.15), (0.12, 0.28, 0.16))
_GREY: Greens = ((0.5, 0.62, 0.5), (0.56, 0.66, 0.6), (0.45, 0.6, 0.4), (0.62, 0.55, 0.56))
_HABITS: dict[str, tuple[tuple[float, float], tuple[float, float], Greens]] = {
    "ficus": ((0.32, 0.55), (0.07, 0.11), _DEEP + _FRESH),
    "rubber": ((0.34, 0.6), (0.07, 0.11), (*_DEEP, (0.24, 0.18, 0.16))),
    "snake": ((0.26, 0.5), (0.06, 0.09), ((0.28, 0.42, 0.26), (0.22, 0.38, 0.22))),
    "fern": ((0.2, 0.3), (0.065, 0.095), _FRESH),
    "rosette": ((0.05, 0.08), (0.045, 0.07), _GREY),
    "aloe": ((0.18, 0.34), (0.05, 0.08), ((0.36, 0.52, 0.34), (0.42, 0.55, 0.4))),
    "cactus": ((0.12, 0.26), (0.045, 0.07), ((0.26, 0.44, 0.22), (0.32, 0.48, 0.3), (0.22, 0.4, 0.28))),
    "hearts": ((0.17, 0.3), (0.06, 0.09), _FRESH + _DEEP),
    "palm": ((0.42, 0.7), (0.07, 0.11), _FRESH + _DEEP),
}
"""Height above the soil, size of the pot, and greens."""

_CLAYS: tuple[tuple[Color, Color, Color], ...] = (
    ((0.72, 0.4, 0.26), (0.93, 0.88, 0.78), (0.4, 0.22, 0.14)),
    ((0.66, 0.36, 0.24), (0.9, 0.86, 0.78), (0.3, 0.18, 0.14)),
    ((0.78, 0.5, 0.34), (0.95, 0.92, 0.86), (0.5, 0.28, 0.18)),
)
_GLAZES: tuple[tuple[Color, Color, Color], ...] = (
    ((0.93, 0.92, 0.9), (0.2, 0.3, 0.45), (0.7, 0.5, 0.3)),
    ((0.2, 0.33, 0.4), (0.9, 0.88, 0.8), (0.75, 0.55, 0.3)),
    ((0.16, 0.16, 0.17), (0.85, 0.8, 0.7), (0.6, 0.6, 0.6)),
    ((0.86, 0.72, 0.3), (0.95, 0.94, 0.9), (0.3, 0.25, 0.2)),
    ((0.6, 0.68, 0.62), (0.93, 0.92, 0.86), (0.25, 0.35, 0.3)),
    ((0.82, 0.62, 0.56), (0.95, 0.92, 0.88), (0.5, 0.25, 0.25)),
    ((0.6, 0.6, 0.58), (0.9, 0.9, 0.88), (0.3, 0.3, 0.3)),
    ((0.45, 0.2, 0.18), (0.9, 0.8, 0.6), (0.2, 0.1, 0.1)),
)


FAMILY = ZooFamily(
    random=plant_random,
    home="table",
    classes={"": "household item"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
)
