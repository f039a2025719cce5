"""Shrubs: low rounded bushes, some of them in flower."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.paint import Color, linear
from viewsphere_zoo.shapes.solids import Float, Solid, join, moved
from viewsphere_zoo.townscape import foliage
from viewsphere_zoo.townscape.surfaces import finished, waves


@dataclass(frozen=True)
class Shrub:
    """Parameters of a shrub; metres, colours sRGB 0..1. tufts: leaves; flowers: how many, none if 0."""

    height: float = 0.7
    width: float = 1.1
    tufts: int = 300
    flowers: int = 60
    leaves: Color = (0.3, 0.41, 0.18)
    petals: Color = (0.85, 0.45, 0.62)
    seed: int = 0


def shrub(parameters: Shrub | None = None) -> Mesh:
    """The shrub in metres, standing on z = 0 about the origin. Parts: crown, leaves, and flowers if there are any."""
    p = parameters or Shrub()
    rng = np.random.default_rng(p.seed)
    half = np.array([p.width / 2, p.width / 2, 0.62 * p.height])
    lumps = [(np.array([0, 0, 0.36 * p.height]), half * 0.8)]
    for a in np.linspace(0, 2 * np.pi, 5, endpoint=False) + rng.uniform(0, 1):
        at = np.array([0.26 * p.width * np.cos(a), 0.26 * p.width * np.sin(a), float(rng.uniform(0.3, 0.5)) * p.height])
        lumps.append((at, half * float(rng.uniform(0.48, 0.62))))
    core = [_above(moved(foliage.blob(rng, 0.85 * h, 1, 0.2), c)) for c, h in lumps]
    green = Material("leaf", _scaled(p.leaves, 1.5), roughness=0.85, specular=0.5)
    dark = Material("crown", _scaled(p.leaves, 0.6), roughness=0.9)
    pieces = [Piece("crown", dark, join(*core)), Piece("leaves", green, _cover(p.tufts, lumps, (0.11, 0.2), rng))]
    if p.flowers:
        pieces.append(
            Piece("flowers", Material("petal", linear(p.petals), roughness=0.8), _cover(p.flowers, lumps, (0.05, 0.1), rng))
        )
    tone = rng.spawn(1)[0]

    def lit(points: Float) -> Float:
        light = 0.6 + 0.28 * np.clip(points[:, 2] / p.height, 0, 1) + 0.14 * waves(tone, points, 0.12)
        return np.stack([light, light, 0.95 * light], axis=1)

    return finished(pieces, (), {"leaf": lit, "crown": lit}, crease_deg=70)


def shrub_random(rng: np.random.Generator) -> Mesh:
    """A shrub with all parameters drawn."""
    return shrub(draw(rng))


def draw(rng: np.random.Generator) -> Shrub:
    """The parameters of a random shrub."""
    r, g, b = (np.array(_GREENS[int(rng.integers(len(_GREENS)))]) * rng.uniform(0.9, 1.1)).tolist()
    return Shrub(
        height=float(rng.uniform(0.45, 0.95)),
        width=float(rng.uniform(0.8, 1.4)),
        tufts=int(rng.integers(260, 330)),
        flowers=int(rng.integers(40, 90)) if rng.random() < 0.6 else 0,
        leaves=(r, g, b),
        petals=_PETALS[int(rng.integers(len(_PETALS)))],
        seed=int(rng.integers(1 << 31)),
    )


_GREENS = ((0.3, 0.41, 0.18), (0.24, 0.36, 0.17), (0.38, 0.45, 0.2), (0.4, 0.43, 0.32))
_PETALS: tuple[Color, ...] = ((0.86, 0.42, 0.6), (0.92, 0.9, 0.86), (0.9, 0.75, 0.2), (0.62, 0.45, 0.78), (0.82, 0.2, 0.18))


def _scaled(color: Color, share: float) -> tuple[float, float, float, float]:
    r, g, b, a = linear(color)
    return min(r * share, 1.0), min(g * share, 1.0), min(b * share, 1.0), a


def _above(solid: Solid) -> Solid:
    """The solid with everything below the ground pressed flat onto it."""
    return Solid(np.maximum(solid.vertices, (-np.inf, -np.inf, 0.0)), solid.triangles)


def _cover(count: int, lumps: list[tuple[Float, Float]], size: tuple[float, float], rng: np.random.Generator) -> Solid:
    """Leaves on the outside of the lumps, above the ground."""
    direction = rng.standard_normal((8 * count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    which = rng.integers(len(lumps), size=len(direction))
    middle, half = (np.array([lump[k] for lump in lumps]) for k in (0, 1))
    points = middle[which] + direction * half[which]
    depth = np.min([np.linalg.norm((points - c) / h, axis=1) for c, h in lumps], axis=0)
    keep = np.flatnonzero((depth > 0.93) & (points[:, 2] > 0.75 * size[1]))[:count]
    return foliage.leaves(rng, points[keep], direction[keep], size)


FAMILY = ZooFamily(
    random=shrub_random,
    home="garden",
    classes={"": "vegetation"},
    draw=draw,
)
