"""Fences: pickets, boards or iron railings, 2 m long pieces that join end to end along X."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.paint import Color, coated, linear
from viewsphere_zoo.shapes.solids import Solid, join, lathe, moved
from viewsphere_zoo.townscape.surfaces import cuboid, prism

LENGTH = 2.0
"""Length of one piece from post to post, metres."""

Style = Literal["pickets", "boards", "railing"]


@dataclass(frozen=True)
class Fence:
    """Parameters of a fence; metres, colour sRGB 0..1."""

    style: Style = "pickets"
    height: float = 1.0
    count: int = 15
    color: Color = (0.92, 0.92, 0.9)


def fence(parameters: Fence | None = None) -> Mesh:
    """The fence in metres, seen from its better side from -Y, standing on z = 0. Parts: post, rail, picket."""
    p = parameters or Fence()
    wood = Material("wood", linear(p.color), roughness=0.7)
    paint = coated("iron", p.color, "matte") if p.style == "railing" else wood
    thick = 0.03 if p.style == "railing" else 0.05
    post = cuboid((-thick, -thick, 0), (thick, thick, p.height + 0.06))
    knob = lathe([(thick * 1.3, 0), (thick * 1.4, 0.02), (thick, 0.06), (0, 0.075)], 8)
    posts = [moved(join(post, moved(knob, (0, 0, p.height + 0.05))), (x, 0, 0)) for x in (-LENGTH / 2, LENGTH / 2)]
    deep = 0.02 if p.style == "railing" else 0.022
    rails = [cuboid((-LENGTH / 2, -deep, z - 0.04), (LENGTH / 2, deep, z + 0.035)) for z in (0.22, 0.78 * p.height)]
    pieces = [
        Piece("post", paint, join(*posts)),
        Piece("rail", paint, join(*rails)),
        Piece("picket", paint, join(*_pickets(p))),
    ]
    return assemble(pieces)


def _pickets(p: Fence) -> list[Solid]:
    """The upright pieces between the posts."""
    pitch = LENGTH / p.count
    places = (np.arange(p.count) + 0.5) * pitch - LENGTH / 2
    if p.style == "railing":
        bar = join(
            lathe([(0, p.height + 0.02), (0.013, p.height - 0.05), (0.009, p.height - 0.06), (0.009, 0.08), (0, 0.08)][::-1], 6)
        )
        return [moved(bar, (x, 0, 0)) for x in places]
    half = 0.32 * pitch if p.style == "pickets" else 0.485 * pitch
    tip = 0.07 if p.style == "pickets" else 0.0
    outline = [(-half, 0.06), (half, 0.06), (half, p.height - tip), (0.0, p.height), (-half, p.height - tip)]
    pale = prism([(z, x) for x, z in outline][::-1], -0.042, -0.018, axis=1)
    return [moved(pale, (x, 0, 0)) for x in places]


def fence_random(rng: np.random.Generator) -> Mesh:
    """A fence with all parameters drawn."""
    return fence(draw(rng))


def draw(rng: np.random.Generator) -> Fence:
    """The parameters of a random fence."""
    style: Style = ("pickets", "boards", "railing")[int(rng.choice(3, p=(0.5, 0.25, 0.25)))]
    colors: tuple[Color, ...] = {
        "pickets": ((0.93, 0.93, 0.91), (0.5, 0.38, 0.27), (0.6, 0.66, 0.64)),
        "boards": ((0.45, 0.33, 0.23), (0.55, 0.42, 0.29), (0.35, 0.3, 0.26)),
        "railing": ((0.1, 0.1, 0.11), (0.1, 0.2, 0.15), (0.15, 0.16, 0.2)),
    }[style]
    return Fence(
        style=style,
        height=float(rng.uniform(0.85, 1.1) if style != "boards" else rng.uniform(1.2, 1.5)),
        count=int(rng.integers(13, 18)) if style != "boards" else int(rng.integers(11, 14)),
        color=colors[int(rng.integers(3))],
    )


FAMILY = ZooFamily(
    random=fence_random,
    home="garden",
    classes={"": "fence"},
    draw=draw,
)
