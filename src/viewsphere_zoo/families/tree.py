"""Trees: broad crowns, columns and conifers, with trunk, boughs and leaves as real geometry."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material, Mesh
from viewsphere.plugins.family import ZooFamily
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.paint import Color, linear
from viewsphere_zoo.shapes.solids import Float, Solid, join, moved, tube
from viewsphere_zoo.townscape import foliage
from viewsphere_zoo.townscape.surfaces import Tint, finished, waves

Habit = Literal["round", "column", "conifer", "birch"]


@dataclass(frozen=True)
class Tree:
    """Parameters of a tree; lengths in metres, colours sRGB 0..1.

    height: of the crown's top; crown: the crown's diameter; clear: height of its lower edge; masses: lumps that form the crown;
    count: tufts of leaves; cover: their area as a multiple of the crown's surface; seed draws where they are.
    """

    habit: Habit = "round"
    height: float = 7.5
    crown: float = 5.0
    clear: float = 2.2
    masses: int = 11
    cover: float = 2.0
    count: int = 1600
    leaves: Color = (0.3, 0.42, 0.15)
    bark: Color = (0.36, 0.29, 0.23)
    seed: int = 0


def tree(parameters: Tree | None = None) -> Mesh:
    """The tree in metres, its foot about the origin at z = 0. Parts: trunk, bough, crown, leaves."""
    p = parameters or Tree()
    rng = np.random.default_rng(p.seed)
    bark = Material("bark", linear(p.bark), roughness=0.95)
    lumps = _conifer(p, rng) if p.habit == "conifer" else _lumps(p, rng)
    wood, skin = _wood(p, lumps, rng), [moved(foliage.blob(rng, h, 2, 0.3), c) for c, h in lumps]
    core = [moved(foliage.blob(rng, 0.8 * h, 1, 0.2), c) for c, h in lumps]
    pieces = [
        Piece("trunk", bark, wood[0]),
        *([Piece("bough", bark, join(*wood[1:]))] if wood[1:] else []),
        Piece("crown", _green("crown", p.leaves, 0.42), join(*core)),
        Piece("leaves", _green("leaf", p.leaves, 1.0), _tufts(p, skin, lumps, rng)),
    ]
    return finished(pieces, (), _tints(p, rng), crease_deg=80)


def _tints(p: Tree, rng: np.random.Generator) -> dict[str, Tint]:
    """Vertex colours: lighter towards the top, slightly different for every tuft; bark is streaked (blotched on a birch)."""
    leaf, tone, bark = rng.spawn(3)

    def lit(points: Float) -> Float:
        height = np.clip((points[:, 2] - p.clear) / (p.height - p.clear), 0, 1)
        light = 0.6 + 0.26 * height + 0.16 * waves(leaf, points, 0.3)
        warm = 0.1 * waves(tone, points, 1.2)
        return np.stack([light * (1 + warm), light, light * (0.95 - warm)], axis=1)

    def streaked(points: Float) -> Float:
        if p.habit == "birch":
            return np.where(waves(bark, points, 0.5) > 0.55, 0.12, 0.9)
        return 0.8 + 0.2 * waves(bark, points * (1, 1, 0.2), 0.25)

    return {"crown": lit, "leaf": lit, "bark": streaked}


def tree_random(rng: np.random.Generator) -> Mesh:
    """A tree with parameters drawn to resemble trees in gardens and along streets."""
    return tree(draw(rng))


def draw(rng: np.random.Generator) -> Tree:
    """The parameters of a random tree."""
    habit: Habit = ("round", "column", "conifer", "birch")[int(rng.choice(4, p=(0.5, 0.14, 0.16, 0.2)))]
    height = float(
        rng.uniform(*{"round": (5.5, 9.0), "column": (5.5, 8.0), "conifer": (5.0, 9.0), "birch": (7.0, 10.0)}[habit])
    )
    slim = {"round": (0.62, 0.8), "column": (0.3, 0.38), "conifer": (0.42, 0.55), "birch": (0.4, 0.5)}[habit]
    greens = _GREENS[habit]
    color = np.array(greens[int(rng.integers(len(greens)))]) * rng.uniform(0.9, 1.1)
    r, g, b = color.tolist()
    return Tree(
        habit=habit,
        height=height,
        crown=min(height * float(rng.uniform(*slim)), 6.0),
        clear=float(rng.uniform(0.2, 0.6) if habit == "conifer" else rng.uniform(1.7, 2.6)),
        masses=int(rng.integers(9, 14)),
        cover=float(rng.uniform(1.7, 2.3)),
        count=int(rng.integers(1200, 1450)),
        leaves=(r, g, b),
        bark=(0.78, 0.76, 0.72)
        if habit == "birch"
        else ((0.36, 0.29, 0.23), (0.42, 0.38, 0.33), (0.3, 0.25, 0.21))[int(rng.integers(3))],
        seed=int(rng.integers(1 << 31)),
    )


_GREENS: dict[Habit, tuple[Color, ...]] = {
    "round": ((0.31, 0.42, 0.14), (0.26, 0.37, 0.15), (0.4, 0.46, 0.15), (0.45, 0.22, 0.2), (0.34, 0.44, 0.2)),
    "column": ((0.27, 0.38, 0.15), (0.36, 0.44, 0.16)),
    "conifer": ((0.17, 0.28, 0.17), (0.22, 0.32, 0.16), (0.24, 0.34, 0.28)),
    "birch": ((0.42, 0.5, 0.2), (0.38, 0.46, 0.17), (0.52, 0.5, 0.16)),
}


def _green(name: str, color: Color, share: float) -> Material:
    """Material of leaves, darker deep in the crown."""
    r, g, b, a = linear(color)
    return Material(
        name, (min(1.6 * r * share, 1), min(1.6 * g * share, 1), min(1.6 * b * share, 1), a), roughness=0.85, specular=0.5
    )


Lump = tuple[Float, Float]
"""Middle (3,) and half axes (3,) of an ellipsoid, metres."""


def _lumps(p: Tree, rng: np.random.Generator) -> list[Lump]:
    """Lumps spread evenly over an ellipsoid (golden spiral), one in its middle."""
    half = np.array([p.crown / 2 - 0.2, p.crown / 2 - 0.2, (p.height - p.clear) / 2 - 0.1])
    middle = np.array([0, 0, (p.height + p.clear) / 2])
    size = 0.47 if p.habit in ("round", "column") else 0.4
    lumps = [(middle, half * 0.62)]
    for k in range(p.masses):
        z = 1 - 2 * (k + 0.5) / p.masses
        a = 2.39996 * k + float(rng.uniform(-0.4, 0.4))
        direction = np.array([np.sqrt(1 - z * z) * np.cos(a), np.sqrt(1 - z * z) * np.sin(a), z])
        share = float(rng.uniform(0.85, 1.15)) * size
        radius = share * np.array([half[0], half[0], 0.5 * half[0] + 0.5 * half[2]])
        lumps.append((middle + direction * (half - 0.8 * radius), radius))
    return lumps


def _conifer(p: Tree, rng: np.random.Generator) -> list[Lump]:
    """Flat tiers that narrow towards the top."""
    lumps: list[Lump] = []
    tiers = 9
    for k in range(tiers):
        share = k / (tiers - 1)
        radius = (p.crown / 2 - 0.25) * (1 - share) ** 0.85 + 0.12
        thick = (p.height - p.clear) / tiers * 0.95
        z = p.clear + thick / 2 + share * (p.height - p.clear - 1.2 * thick)
        off = rng.normal(0, 0.05, 2)
        lumps.append((np.array([off[0], off[1], z]), np.array([radius, radius, 0.62 * thick])))
    return lumps


def _wood(p: Tree, lumps: list[Lump], rng: np.random.Generator) -> list[Solid]:
    """A trunk with flared foot, and a bough to each lump."""
    thick = 0.028 * p.height * (0.7 if p.habit == "birch" else 1.0)
    top = p.height - 0.35 * (p.height - p.clear) if p.habit != "conifer" else 0.9 * p.height
    stem = np.linspace(0.35, p.clear + 0.2, 8)
    z = np.concatenate([[0, 0.08], stem, [0.5 * (p.clear + top), top]])
    radius = thick * np.interp(z / z[-1], (0, 0.015, 0.05, 0.35, 0.7, 1), (1.7, 1.3, 1.05, 0.85, 0.55, 0.2))
    lean = 0.06 * rng.standard_normal((2, 2))
    sway = lean[0] * np.sin(z[:, None]) + lean[1] * (1 - np.cos(0.7 * z[:, None]))
    trunk = tube(np.column_stack([sway, z]), radius, 10)
    solids = [trunk]
    if p.habit == "conifer":
        return solids
    for middle, _ in lumps[1:]:
        if middle[2] > top:
            continue
        foot = np.array([0, 0, max(p.clear - 0.3, min(middle[2] - 0.9, top - 0.6))])
        bend = 0.5 * (foot + middle) + (0, 0, -0.12)
        solids.append(tube([foot, bend, middle], thick * np.array([0.42, 0.3, 0.12]), 5))
    return solids


def _tufts(p: Tree, skin: list[Solid], lumps: list[Lump], rng: np.random.Generator) -> Solid:
    """Leaves on the lumps, where no other lump covers them."""
    area = np.array([h[0] * (h[0] + h[2]) for _, h in lumps])
    at: list[Float] = []
    out: list[Float] = []
    for solid, (middle, half), share in zip(skin, lumps, area / area.sum(), strict=True):
        n = int(4 * p.count * share)
        face = solid.triangles[rng.integers(len(solid.triangles), size=n)]
        weight = rng.dirichlet((1, 1, 1), n)[..., None]
        points = (solid.vertices[face] * weight).sum(axis=1)
        at.append(points)
        out.append((points - middle) / half)
    points, normals = np.concatenate(at), np.concatenate(out)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    depth = np.min([np.linalg.norm((points - c) / h, axis=1) for c, h in lumps], axis=0)
    keep = rng.permutation(np.flatnonzero(depth > 0.82))[: p.count]
    surface = np.pi * p.crown * (0.5 * p.crown + 0.5 * (p.height - p.clear)) * (0.5 if p.habit == "conifer" else 1.0)
    size = np.sqrt(p.cover * surface / (0.33 * len(keep)))
    spread = size * (0.3 * rng.standard_normal((len(keep), 1)) - 0.1)
    return foliage.leaves(rng, points[keep] + spread * normals[keep], normals[keep], (0.7 * size, 1.3 * size))


FAMILY = ZooFamily(
    random=tree_random,
    home="garden",
    classes={"": "vegetation"},
    draw=draw,
)
