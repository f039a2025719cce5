"""Hedges: clipped, 2 m long pieces that join end to end along X."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere.assets.mesh import Mesh
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.paint import Color
from viewsphere_zoo.shapes.solids import Float, Solid, loft, superellipse
from viewsphere_zoo.townscape import foliage, textures
from viewsphere_zoo.townscape.surfaces import finished, waves
from viewsphere_zoo.townscape.textures import textured

LENGTH = 2.0
"""Length of one piece, metres; leaves reach a little further."""


@dataclass(frozen=True)
class Hedge:
    """Parameters of a hedge; metres, colour sRGB 0..1. rough: how far its sides are from flat; tufts: leaves that stick out."""

    height: float = 1.2
    width: float = 0.7
    rough: float = 0.03
    tufts: int = 150
    leaves: Color = (0.27, 0.36, 0.15)
    seed: int = 0


def hedge(parameters: Hedge | None = None) -> Mesh:
    """The hedge in metres, centred, standing on z = 0. Parts: hedge, leaves."""
    p = parameters or Hedge()
    rng = np.random.default_rng(p.seed)
    body, leaf = textured("leafage", 0, 1.0, 0.9), textured("leaf", 0, 3.0, 0.9)
    core = _body(p, rng)
    tone = rng.spawn(1)[0]

    def shaded(points: Float) -> Float:
        light = 0.72 + 0.2 * np.clip(points[:, 2] / p.height, 0, 1) + 0.08 * waves(tone, points, 0.5)
        return np.stack([light, light, 0.95 * light], axis=1)

    pieces = [Piece("hedge", body, core), Piece("leaves", leaf, _tufts(p, core, rng))]
    tints = {"leafage": shaded, "leaf": shaded}
    return finished(pieces, [textures.leafage(rng, p.leaves)], tints, crease_deg=14)


def hedge_random(rng: np.random.Generator) -> Mesh:
    """A hedge with all parameters drawn."""
    return hedge(draw(rng))


def draw(rng: np.random.Generator) -> Hedge:
    """The parameters of a random hedge."""
    r, g, b = (np.array(_GREENS[int(rng.integers(len(_GREENS)))]) * rng.uniform(0.9, 1.1)).tolist()
    return Hedge(
        height=float(rng.uniform(0.85, 1.5)),
        width=float(rng.uniform(0.55, 0.8)),
        rough=float(rng.uniform(0.02, 0.04)),
        tufts=int(rng.integers(110, 170)),
        leaves=(r, g, b),
        seed=int(rng.integers(1 << 31)),
    )


_GREENS = ((0.29, 0.38, 0.16), (0.24, 0.34, 0.15), (0.37, 0.43, 0.18), (0.25, 0.33, 0.2))


def _body(p: Hedge, rng: np.random.Generator) -> Solid:
    """A rounded block along x with uneven sides; its ends match those of the next piece to within the length of a leaf."""
    x = np.linspace(-LENGTH / 2, LENGTH / 2, 8)
    section = superellipse(p.width / 2, p.height / 2, 6.0, 14)
    rings = np.empty((len(x), len(section), 3))
    rings[..., 0], rings[..., 1], rings[..., 2] = x[:, None], section[:, 0], section[:, 1] + p.height / 2
    bumps = waves(rng, rings.reshape(-1, 3), 0.6).reshape(rings.shape[:2])
    fade = np.clip(rings[..., 2] / 0.3, 0, 1) * np.clip((LENGTH / 2 - np.abs(x)) / 0.2, 0, 1)[:, None]
    rings[..., 1:] *= (1 + 2 * p.rough * bumps * fade)[..., None]
    return loft(rings)


def _tufts(p: Hedge, core: Solid, rng: np.random.Generator) -> Solid:
    """Leaves on sides and top."""
    corners = core.vertices[core.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normal, axis=1)
    normal = normal / area[:, None]
    weight = area * (np.abs(normal[:, 0]) < 0.9) * (normal[:, 2] > -0.5) * (1 + (normal[:, 2] > 0.5))
    face = rng.choice(len(area), p.tufts, p=weight / weight.sum())
    points = (corners[face] * rng.dirichlet((1, 1, 1), p.tufts)[..., None]).sum(axis=1)
    points[:, 2] = np.maximum(points[:, 2], 0.12)
    return foliage.leaves(rng, points + 0.01 * normal[face], normal[face], (0.07, 0.13))


FAMILY = ZooFamily(
    random=hedge_random,
    home="garden",
    classes={"": "vegetation"},
    draw=draw,
)
