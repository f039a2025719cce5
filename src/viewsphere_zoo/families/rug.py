"""Rugs: oriental, striped, geometric, braided and shaggy ones, with fringes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material, Mesh, Texture
from viewsphere.model.annotations.keypoints import sided
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.furnishing.carpets import Colors, Design, carpet
from viewsphere_zoo.joinery.members import hoop
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.paint import Color, linear
from viewsphere_zoo.shapes.rods import circle
from viewsphere_zoo.shapes.solids import Float, Solid, join, loft, tube

KEYPOINTS = {
    **sided("corner_front", "pile", (1, -1, 1)),
    **sided("corner_rear", "pile", (1, 1, 1)),
}
SKELETON = (
    ("corner_front_left", "corner_front_right"),
    ("corner_rear_left", "corner_rear_right"),
    ("corner_front_left", "corner_rear_left"),
    ("corner_front_right", "corner_rear_right"),
)

Outline = Literal["rectangle", "round", "oval"]


@dataclass(frozen=True)
class Rug:
    """Parameters of a rug; lengths in metres.

    width: along x, without fringes, at least the depth; thickness: of the pile; shag: how much tufts stand out of it; waves:
    how far it lifts off the floor in soft folds; fringe: length of the threads at both ends, 0 for none; seed: of design,
    tufts and folds.
    """

    outline: Outline = "rectangle"
    width: float = 2.3
    depth: float = 1.6
    thickness: float = 0.012
    shag: float = 0.0
    waves: float = 0.008
    fringe: float = 0.06
    design: Design = "medallion"
    colors: Colors = ((0.52, 0.1, 0.1), (0.1, 0.14, 0.3), (0.85, 0.74, 0.55), (0.72, 0.45, 0.22))
    seed: int = 0

    @property
    def extent(self) -> tuple[float, float, float]:
        """Greatest width, depth and height of the whole model, metres."""
        return self.width + 0.3, self.depth + 0.03, self.thickness + self.waves + 0.02


def rug(parameters: Rug | None = None) -> Mesh:
    """The rug in metres, lying on z = 0, centred, its fringes at -X and +X. Parts: pile; binding and fringe if it has them."""
    p = parameters or Rug()
    rng = np.random.default_rng(p.seed)
    image = carpet(rng, p.design, p.colors, p.width / p.depth)
    scale = (1 / p.width, 1 / p.depth)
    pattern = Texture(0, wrap_s="clamp", wrap_t="clamp", scale=scale, offset=(0.5, 0.5))
    wool = Material("wool", (1.0, 1.0, 1.0, 1.0), pattern, roughness=0.97)
    edging = Material("binding", linear(p.colors[1]), roughness=0.95)
    pieces = [Piece("pile", wool, _pile(p, rng))]
    if p.shag == 0:
        pieces.append(Piece("binding", edging, _binding(p)))
    if p.fringe and p.outline == "rectangle":
        cotton = Material("fringe", linear((0.86, 0.8, 0.68)), roughness=0.95)
        pieces.append(Piece("fringe", cotton, _fringe(p, rng)))
    mesh = assemble(pieces, 55)
    return replace(mesh, uv0=mesh.vertices[:, :2] * np.array((1, -1), np.float32), images=(image,))


def _folds(p: Rug, rng: np.random.Generator, plan: Float) -> Float:
    """Return the height of the rug over the floor at points (..., 2), metres: soft folds that end before its border, never
    below 0.
    """
    x, y = plan[..., 0], plan[..., 1]
    total = np.ones_like(x)
    for turn, phase in rng.uniform(0, np.pi, (2, 2)):
        total *= np.sin((x * np.cos(turn) + y * np.sin(turn)) * 5 + 2 * phase)
    inside = 1.15 - np.maximum(np.abs(x) / p.width, np.abs(y) / p.depth) * 2
    return p.waves * np.clip(total + 0.15, 0, 1) * np.clip(inside * 4, 0, 1)


def _ring(p: Rug, count: int) -> Float:
    """The border (N, 2), counter-clockwise."""
    if p.outline != "rectangle":
        return circle(1, count) * (p.width / 2, p.depth / 2)
    a = np.linspace(-1, 1, count // 4, endpoint=False)
    ones = np.ones_like(a)
    square = np.concatenate([np.stack(s, axis=1) for s in ((a, -ones), (ones, a), (-a, ones), (-ones, -a))])
    return square * (p.width / 2, p.depth / 2)


def _pile(p: Rug, rng: np.random.Generator) -> Solid:
    """The rug itself: its face over rings that shrink to the middle, its underside on the floor."""
    count, rings = (120, 24) if p.shag else (96, 14)
    ring = _ring(p, count)
    share = np.linspace(1, 0.02, rings)
    plan = np.concatenate([[ring], [ring], ring * share[:, None, None]])
    top = _folds(p, rng, plan) + p.thickness * np.array([0, 0.6, 0.9, *[1.0] * (rings - 1)])[:, None]
    top[0] = 0.0
    if p.shag:
        calm = np.clip(2.5 * share, 0, 1)[:, None]  # rings crowd in the middle, where tufts would run into each other
        top[2:] += p.shag * calm * rng.uniform(-0.6, 0.6, top[2:].shape)
        plan[2:] += 0.15 * p.shag * (calm * rng.uniform(-1, 1, top[2:].shape))[..., None]
        plan[1] += 0.9 * p.shag * rng.uniform(-1, 1, plan[1].shape)
    return loft(np.dstack([plan, top]))


def _binding(p: Rug) -> Solid:
    """A roll of thread around the border."""
    ring = _ring(p, 96)
    r = 0.5 * p.thickness
    path = np.column_stack([ring * (1 + 0.3 * r), np.full(len(ring), r)])
    return hoop(path, r, (0, 0, 1), 6)


def _fringe(p: Rug, rng: np.random.Generator) -> Solid:
    """Knotted threads at both ends."""
    threads = []
    count = round(p.depth / 0.026)
    for y in np.linspace(-p.depth / 2 + 0.008, p.depth / 2 - 0.008, count):
        for s in (-1, 1):
            sway, long = float(rng.normal(0, 0.006)), p.fringe * float(rng.uniform(0.9, 1.05))
            x = p.width / 2
            path = [
                (s * (x - 0.004), y, 0.5 * p.thickness),
                (s * (x + 0.4 * long), y + 0.3 * sway, 0.0035),
                (s * (x + long), y + sway, 0.0032),
            ]
            threads.append(tube(path, (0.0032, 0.0032, 0.004), 4))
    return join(*threads)


def rug_random(rng: np.random.Generator) -> Mesh:
    """A rug with parameters drawn to resemble rugs in real homes."""
    return rug(draw(rng))


_ORIENTAL: tuple[Colors, ...] = (
    ((0.52, 0.1, 0.1), (0.1, 0.14, 0.3), (0.85, 0.74, 0.55), (0.72, 0.45, 0.22)),
    ((0.1, 0.16, 0.34), (0.5, 0.12, 0.12), (0.86, 0.78, 0.62), (0.62, 0.5, 0.3)),
    ((0.84, 0.76, 0.62), (0.3, 0.38, 0.42), (0.55, 0.28, 0.2), (0.7, 0.56, 0.36)),
    ((0.16, 0.33, 0.3), (0.55, 0.2, 0.13), (0.88, 0.8, 0.64), (0.75, 0.52, 0.22)),
)
_MODERN: tuple[Colors, ...] = (
    ((0.9, 0.87, 0.8), (0.75, 0.5, 0.35), (0.16, 0.17, 0.19), (0.45, 0.52, 0.48)),
    ((0.82, 0.8, 0.77), (0.2, 0.3, 0.42), (0.35, 0.36, 0.38), (0.86, 0.65, 0.28)),
    ((0.86, 0.78, 0.68), (0.72, 0.34, 0.24), (0.24, 0.3, 0.3), (0.9, 0.72, 0.5)),
    ((0.72, 0.75, 0.74), (0.94, 0.93, 0.9), (0.25, 0.42, 0.45), (0.85, 0.55, 0.5)),
    ((0.93, 0.9, 0.84), (0.6, 0.62, 0.6), (0.2, 0.2, 0.22), (0.78, 0.72, 0.62)),
)


def draw(rng: np.random.Generator) -> Rug:
    """The parameters of a random rug."""
    designs: tuple[Design, ...] = ("medallion", "stripes", "diamonds", "trellis", "shapes", "rings", "border")
    design = designs[int(rng.choice(7, p=(0.3, 0.13, 0.16, 0.15, 0.13, 0.05, 0.08)))]
    outlines: tuple[Outline, ...] = ("round", "oval") if design == "rings" else ("rectangle",)
    outline = outlines[int(rng.integers(len(outlines)))]
    if design in ("shapes", "trellis") and rng.random() < 0.3:
        outline = "round"
    depth = float(rng.uniform(0.9, 1.9))
    width = depth * float(1.0 if outline == "round" else rng.uniform(1.3, 1.7) if rng.random() < 0.8 else rng.uniform(2.2, 2.8))
    shag = float(rng.uniform(0.012, 0.02)) if design in ("trellis", "shapes", "border") and rng.random() < 0.5 else 0.0
    palettes = _ORIENTAL if design in ("medallion", "diamonds") else _MODERN
    return Rug(
        outline=outline,
        width=min(width, 3.4),
        depth=depth,
        thickness=float(rng.uniform(0.022, 0.035) if shag else rng.uniform(0.009, 0.016)),
        shag=shag,
        waves=float(rng.uniform(0.004, 0.014)),
        fringe=0.0 if shag and rng.random() < 0.5 else float(rng.uniform(0.05, 0.11)),
        design=design,
        colors=_off(palettes[int(rng.integers(len(palettes)))], rng),
        seed=int(rng.integers(1 << 31)),
    )


def _off(colors: Colors, rng: np.random.Generator) -> Colors:
    """The colours of a rug a little faded or deepened."""
    shade = float(rng.uniform(0.85, 1.12))

    def one(color: Color) -> Color:
        r, g, b = np.clip(np.array(color) * shade + rng.normal(0, 0.015, 3), 0.03, 0.95).tolist()
        return r, g, b

    a, b, c, d = colors
    return one(a), one(b), one(c), one(d)


FAMILY = ZooFamily(
    random=rug_random,
    home="floor",
    classes={"": "floor"},
    keypoints=KEYPOINTS,
    skeleton=SKELETON,
    draw=draw,
)
