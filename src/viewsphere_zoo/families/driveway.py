"""Driveways and garden paths: 11 m of paving along Y between two rows of edging stones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Mesh
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.paint import Color
from viewsphere_zoo.shapes.solids import grid, join
from viewsphere_zoo.townscape import textures
from viewsphere_zoo.townscape.surfaces import cuboid, finished, waves
from viewsphere_zoo.townscape.textures import textured

LENGTH = 11.0
"""Length of every driveway and path, metres."""

TOP = 0.03
"""Height of the paving above its foot, metres."""

Surface = Literal["slabs", "bricks", "asphalt", "gravel"]


@dataclass(frozen=True)
class Driveway:
    """Parameters of a driveway; metres, colour sRGB 0..1. Below 1.5 m wide it is a garden path."""

    width: float = 2.9
    surface: Surface = "bricks"
    color: Color = (0.52, 0.4, 0.35)
    seed: int = 0


def driveway(parameters: Driveway | None = None) -> Mesh:
    """The driveway in metres, centred, 3 cm high. Parts: paving, edging."""
    p = parameters or Driveway()
    rng = np.random.default_rng(p.seed)
    half, top = p.width / 2 - 0.08, TOP
    x, y = np.meshgrid(np.linspace(-half, half, 5), np.linspace(-LENGTH / 2, LENGTH / 2, 13), indexing="ij")
    paving = grid(np.stack([x, y, np.full_like(x, top)], axis=-1))
    stones = [
        cuboid((s * p.width / 2 - 0.08 * (s > 0), -LENGTH / 2, 0), (s * p.width / 2 + 0.08 * (s < 0), LENGTH / 2, top + 0.012))
        for s in (-1, 1)
    ]
    ends = [
        cuboid((-half, s * LENGTH / 2 - 0.06 * (s > 0), 0), (half, s * LENGTH / 2 + 0.06 * (s < 0), top - 0.004))
        for s in (-1, 1)
    ]
    stone = textured("edging", 1, 0.9, 0.9)
    pieces = [Piece("paving", textured("paving", 0, 2.4, 0.9), paving), Piece("edging", stone, join(*stones, *ends))]
    tone = rng.spawn(1)[0]
    images = [
        _image(p, rng),
        textures.bricks(rng, "edging", (0.58, 0.57, 0.54), (0.34, 0.33, 0.31), (1, 1), (0.008, 0.008), 0.0, 0.0, 128),
    ]
    return finished(pieces, images, {"paving": lambda v: 0.92 + 0.08 * waves(tone, v, 1.6)})


def _image(p: Driveway, rng: np.random.Generator) -> textures.Image:
    if p.surface == "bricks":
        return textures.bricks(rng, "paving", p.color, (0.36, 0.34, 0.31), (12, 24), (0.03, 0.06), 0.1)
    if p.surface == "slabs":
        return textures.bricks(rng, "paving", p.color, (0.36, 0.35, 0.32), (4, 5), (0.012, 0.014), 0.05)
    if p.surface == "gravel":
        return textures.plaster(rng, "gravel", p.color, 0.28, 512)
    return textures.asphalt(rng, p.color)


def driveway_random(rng: np.random.Generator) -> Mesh:
    """A driveway or path with all parameters drawn."""
    return driveway(draw(rng))


def draw(rng: np.random.Generator) -> Driveway:
    """The parameters of a random driveway, or of a path."""
    surface: Surface = ("slabs", "bricks", "asphalt", "gravel")[int(rng.choice(4, p=(0.3, 0.4, 0.15, 0.15)))]
    colors: tuple[Color, ...] = {
        "slabs": ((0.6, 0.57, 0.52), (0.55, 0.54, 0.52)),
        "bricks": ((0.54, 0.36, 0.29), (0.5, 0.45, 0.41)),
        "asphalt": ((0.38, 0.375, 0.37), (0.44, 0.43, 0.42)),
        "gravel": ((0.66, 0.6, 0.5), (0.58, 0.56, 0.53)),
    }[surface]
    path = rng.random() < 0.4
    return Driveway(
        width=float(rng.uniform(1.0, 1.3) if path else rng.uniform(2.7, 3.1)),
        surface=surface,
        color=colors[int(rng.integers(2))],
        seed=int(rng.integers(1 << 31)),
    )


FAMILY = ZooFamily(
    random=driveway_random,
    home="place",
    classes={"": "pavement"},
    draw=draw,
)
