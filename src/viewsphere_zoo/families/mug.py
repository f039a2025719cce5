"""Mugs: glazed, enamelled or glass-smooth, straight, bellied or tapered, empty or filled."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Image, Material, Mesh
from viewsphere.model.annotations.keypoints import At
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.household import charts, vessels
from viewsphere_zoo.household.canvas import blank, ellipse, heart
from viewsphere_zoo.household.patterns import PATTERNS
from viewsphere_zoo.household.vessels import Vessel, vessel
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.paint import Color, linear, metal
from viewsphere_zoo.shapes.rods import bezier, shifted, swept
from viewsphere_zoo.shapes.solids import Float, Solid, curve, lathe, moved, rounded_box, superellipse, tube, turned

KEYPOINTS = {
    "rim": At("body", (0, 0, 1)),
    "base": At("body", (0, 0, -1)),
    "handle": At("handle", (1, 0, 0)),
}
SKELETON = (("base", "rim"), ("rim", "handle"))

Shape = Literal["straight", "tapered", "bellied", "flared", "barrel"]
Handle = Literal["bow", "ear", "square", "ring"]
Content = Literal["none", "coffee", "latte", "tea"]

SHAPES: dict[Shape, tuple[tuple[float, float], ...]] = {
    "straight": ((0, 0.97), (0.05, 1.0), (1, 1.0)),
    "tapered": ((0, 0.72), (0.06, 0.76), (1, 1.0)),
    "bellied": ((0, 0.66), (0.12, 0.86), (0.42, 1.0), (0.8, 0.9), (1, 0.94)),
    "flared": ((0, 0.6), (0.1, 0.74), (0.45, 0.82), (0.85, 0.93), (1, 1.0)),
    "barrel": ((0, 0.86), (0.5, 1.0), (1, 0.88)),
}
"""Radii over the height, shares of the largest and of the whole."""


@dataclass(frozen=True)
class Mug:
    """Parameters of a mug; metres, colours sRGB 0..1. pattern: one of `PATTERNS`, or none; tag: whether a tea bag's tag hangs
    over the lip; reach: how far the handle stands out.
    """

    shape: Shape = "straight"
    handle: Handle = "bow"
    height: float = 0.095
    radius: float = 0.041
    wall: float = 0.0038
    color: Color = (0.9, 0.89, 0.86)
    inside: Color = (0.94, 0.93, 0.9)
    rim: Color | None = None
    pattern: str = ""
    colors: tuple[Color, Color] = ((0.15, 0.3, 0.55), (0.8, 0.3, 0.2))
    matte: bool = False
    content: Content = "none"
    tag: bool = False
    spoon: bool = False
    reach: float = 0.036
    seed: int = 0


def mug(parameters: Mug | None = None) -> Mesh:
    """The mug in metres, its axis on z, its handle towards +X.

    Parts: body, rim, inside, handle; content, tag and spoon if it has them.
    """
    p = parameters or Mug()
    h = np.linspace(0, 1, 18)
    outer = np.stack([p.radius * curve(h, SHAPES[p.shape]), p.height * h], axis=1)
    shell = vessel(outer, p.wall, 0.006, 0.002)
    glaze, inside = _glazed("glaze", p.color, p.matte), _glazed("inside", p.inside, p.matte)
    coat = charts.printed("print", 0, 0.6 if p.matte else 0.25, 0.0 if p.matte else 0.7) if p.pattern else glaze
    rim = _glazed("rim", p.rim, p.matte) if p.rim else glaze
    pieces = [
        Piece("body", coat, lathe(shell.wall, 48)),
        Piece("body", glaze, lathe(shell.foot, 48)),
        Piece("rim", rim, lathe(shell.lip, 48)),
        Piece("inside", inside, lathe(shell.inside, 48)),
        Piece("handle", rim if p.rim else glaze, _handle(p, shell)),
    ]
    pictures: dict[str, charts.Chart] = {}
    images: list[Image] = []
    if p.pattern:
        pictures["print"] = charts.wound(0, p.height)
        images.append(_print(p))
    level = 0.8 * p.height
    if p.content != "none":
        r = shell.radius_inside(level) + 0.5 * p.wall
        pieces.append(Piece("content", charts.printed("drink", len(images), 0.12), vessels.disc(r, level)))
        pictures["drink"] = charts.flat((-r, -r), (r, r))
        images.append(_drink(p, r))
    if p.tag:
        pieces += _tag(p, float(outer[-1, 0]))
    if p.spoon:
        pieces.append(_spoon(p, float(outer[-1, 0]) - p.wall))
    return charts.charted(assemble(pieces, crease_deg=50), pictures, images)


def _glazed(name: str, color: Color, matte: bool) -> Material:
    if matte:
        return Material(name, linear(color), roughness=0.6)
    return Material(name, linear(color), roughness=0.25, clearcoat=0.7, clearcoat_roughness=0.05)


def _print(p: Mug) -> Image:
    canvas = blank(2 * np.pi * p.radius, p.height, p.color)
    PATTERNS[p.pattern](canvas, p.colors, np.random.default_rng(p.seed))
    return canvas.image("print")


def _handle(p: Mug, shell: Vessel) -> Solid:
    """A flattened bow in the plane y = 0; its ends are inside the wall."""
    at = curve(np.array([0.2, 0.82]), SHAPES[p.shape]) * p.radius - 0.6 * p.wall
    low, high = np.array((0, at[0], 0.2 * p.height)), np.array((0, at[1], 0.82 * p.height))
    path = _HANDLES[p.handle](low, high, p.radius + p.reach)
    half = {"bow": (0.0065, 0.0042), "ear": (0.0075, 0.0036), "square": (0.006, 0.0045), "ring": (0.0055, 0.005)}[p.handle]
    f = np.linspace(-1, 1, len(path)) ** 4
    section = superellipse(*half, 2.6, 14)
    bow = turned(swept(path, section[None] * (1 + 0.35 * f)[:, None, None]), 2, -np.pi / 2)
    x, y, z = bow.vertices.T
    least = np.interp(z, shell.inside[::-1, 1], shell.inside[::-1, 0]) + 0.3 * p.wall
    out = np.maximum(least / np.maximum(np.hypot(x, y), 1e-6), 1)
    return Solid(np.stack([x * out, y * out, z], axis=1), bow.triangles)


def _bow(low: Float, high: Float, out: float) -> Float:
    step = np.array((0, (out - low[1]) * 1.33, 0))
    return bezier(low, low + step, shifted(high, y=(out - high[1]) * 1.33), high, 22)


def _ear(low: Float, high: Float, out: float) -> Float:
    wide = (out - high[1]) * 1.7
    return bezier(low, shifted(low, 0, 0.5 * wide, 0.1 * wide), shifted(high, 0, wide, 0.45 * wide), high, 22)


def _square(low: Float, high: Float, out: float) -> Float:
    a, b = np.array((0, out, low[2])), np.array((0, out, high[2]))
    r = np.array((0, 0.009, 0)), np.array((0, 0, 0.009))
    corners = [bezier(a - r[0], a, a, a + r[1], 7), bezier(b - r[1], b, b, b - r[0], 7)]
    return np.concatenate([[low, (low + a - r[0]) / 2], *corners, [(high + b - r[0]) / 2, high]])


def _ring(low: Float, high: Float, out: float) -> Float:
    middle = (low + high) / 2
    r = (out - middle[1]) * 0.56
    a = np.linspace(-2.2, 2.2, 22)
    return np.stack([0 * a, out - r + r * np.cos(a), middle[2] + 1.1 * r * np.sin(a)], axis=1)


_HANDLES = {"bow": _bow, "ear": _ear, "square": _square, "ring": _ring}
_DRINKS: dict[Content, Color] = {"coffee": (0.17, 0.09, 0.05), "latte": (0.62, 0.42, 0.26), "tea": (0.56, 0.25, 0.07)}


def _drink(p: Mug, radius: float) -> Image:
    """The drink from above: paler towards its edge, with foam on a latte."""
    c = blank(2 * radius, 2 * radius, _DRINKS[p.content], 128)
    r = np.hypot(c.x - radius, c.y - radius)
    c.shade(1 + 0.5 * np.exp(-(((r / radius - 0.96) / 0.08) ** 2)))
    if p.content == "latte":
        c.paint(r - 0.86 * radius, (0.72, 0.54, 0.37), 0.7)
        c.paint(heart(c, radius, 1.05 * radius, 1.0 * radius), (0.94, 0.87, 0.76))
        c.paint(heart(c, radius, 1.05 * radius, 0.6 * radius), (0.7, 0.5, 0.33))
        c.paint(heart(c, radius, 1.05 * radius, 0.36 * radius), (0.94, 0.87, 0.76))
    elif p.content == "coffee":
        c.paint(np.abs(ellipse(c, radius, radius, (0.9 * radius, 0.9 * radius))) - 0.05 * radius, (0.42, 0.25, 0.13), 0.7)
    return c.image("drink")


def _tag(p: Mug, lip: float) -> list[Piece]:
    """The string of a tea bag over the lip towards the front, and its tag."""
    paper = Material("paper", linear(p.colors[1]), roughness=0.8)
    y = -p.radius - 0.0025
    ends = (
        (-(lip - p.wall - 0.004), 0.78 * p.height),
        (-(lip - p.wall / 2), p.height + 0.0035),
        (y, 0.9 * p.height),
        (y, 0.6 * p.height),
    )
    x = 0.2 * p.radius
    card = rounded_box((0.022, 0.0012, 0.026), 0.0005, 1)
    return [
        Piece("tag", Material("string", linear((0.92, 0.9, 0.85)), roughness=0.9), tube([(x, *e) for e in ends], 0.0007, 6)),
        Piece("tag", paper, moved(card, (x, y, 0.6 * p.height - 0.012))),
    ]


def _spoon(p: Mug, lip: float) -> Piece:
    """The handle of a spoon that leans on the lip, on the side away from the mug's own handle."""
    foot, rest = np.array((0, 0.5 * lip, 0.012)), np.array((0, -lip + 0.003, p.height + 0.0015))
    path = foot + np.array([0, 0.4, 0.8, 1.0, 1.12, 1.25, 1.34, 1.36])[:, None] * (rest - foot)
    half = np.array([1.8, 1.6, 1.6, 1.8, 2.4, 3.4, 3.2, 1.2])[:, None, None] * 1e-3
    section = half * superellipse(1.0, 1.0, 2.0, 10) + np.zeros((1, 1, 2))
    section[..., 1] *= 0.45
    return Piece("spoon", metal("steel", (0.72, 0.72, 0.73), 0.25), turned(swept(path, section), 2, -2.2))


def mug_random(rng: np.random.Generator) -> Mesh:
    """A mug with all parameters drawn."""
    return mug(draw(rng))


def draw(rng: np.random.Generator) -> Mug:
    """The parameters of a random mug."""
    shape: Shape = ("straight", "tapered", "bellied", "flared", "barrel")[int(rng.choice(5, p=(0.36, 0.2, 0.18, 0.12, 0.14)))]
    color, first, second = _GLAZES[int(rng.integers(len(_GLAZES)))]
    enamel = shape in ("straight", "tapered") and rng.random() < 0.2
    content: Content = ("none", "coffee", "latte", "tea")[int(rng.choice(4, p=(0.16, 0.38, 0.22, 0.24)))]
    names = [*PATTERNS]
    printed = rng.random() < (0.35 if enamel else 0.72)
    return Mug(
        shape=shape,
        handle=("bow", "ear", "square", "ring")[int(rng.choice(4, p=(0.4, 0.25, 0.2, 0.15)))],
        height=float(rng.uniform(0.08, 0.115)),
        radius=float(rng.uniform(0.037, 0.047)),
        wall=0.0022 if enamel else float(rng.uniform(0.0032, 0.0048)),
        color=color,
        inside=color if rng.random() < 0.4 else ((0.93, 0.92, 0.9) if rng.random() < 0.7 else first),
        rim=first if enamel or rng.random() < 0.12 else None,
        pattern=names[int(rng.integers(len(names)))] if printed else "",
        colors=(first, second),
        matte=bool(rng.random() < 0.25),
        content=content,
        tag=content == "tea" and bool(rng.random() < 0.7),
        spoon=content != "none" and bool(rng.random() < 0.45),
        reach=float(rng.uniform(0.03, 0.042)),
        seed=int(rng.integers(1 << 31)),
    )


_GLAZES: tuple[tuple[Color, Color, Color], ...] = (
    ((0.92, 0.91, 0.88), (0.12, 0.24, 0.48), (0.78, 0.24, 0.18)),
    ((0.93, 0.92, 0.9), (0.16, 0.16, 0.17), (0.85, 0.62, 0.15)),
    ((0.9, 0.86, 0.78), (0.36, 0.45, 0.32), (0.72, 0.4, 0.26)),
    ((0.16, 0.27, 0.44), (0.9, 0.88, 0.82), (0.88, 0.62, 0.24)),
    ((0.62, 0.13, 0.12), (0.94, 0.9, 0.85), (0.96, 0.75, 0.4)),
    ((0.86, 0.64, 0.16), (0.25, 0.2, 0.16), (0.94, 0.93, 0.9)),
    ((0.36, 0.55, 0.52), (0.94, 0.93, 0.88), (0.2, 0.3, 0.32)),
    ((0.13, 0.13, 0.14), (0.9, 0.88, 0.84), (0.7, 0.5, 0.25)),
    ((0.82, 0.55, 0.5), (0.5, 0.2, 0.24), (0.96, 0.93, 0.88)),
    ((0.7, 0.78, 0.84), (0.17, 0.28, 0.42), (0.92, 0.5, 0.35)),
    ((0.45, 0.33, 0.25), (0.85, 0.76, 0.62), (0.2, 0.14, 0.1)),
    ((0.4, 0.52, 0.28), (0.93, 0.92, 0.84), (0.9, 0.7, 0.2)),
)


FAMILY = ZooFamily(
    random=mug_random,
    home="table",
    classes={"": "household item"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
)
