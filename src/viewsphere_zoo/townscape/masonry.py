"""Walls with openings, windows and doors. A facade lies in y = 0 and faces -Y, its middle at x = 0, its foot at z = 0."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Material
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.solids import Float, Solid, join, lathe, moved, turned
from viewsphere_zoo.townscape.surfaces import cuboid

REVEAL = 0.13
"""Depth of frames behind the wall, metres."""

Bars = Literal["plain", "double", "cross", "sash", "georgian"]


@dataclass(frozen=True)
class Opening:
    """A hole in a facade: its middle x, foot z, width and height, metres."""

    x: float
    z: float
    width: float
    height: float
    kind: Literal["window", "door", "garage"] = "window"


@dataclass(frozen=True)
class Joinery:
    """Materials of windows and doors; shutters None for none."""

    frame: Material
    glass: Material
    curtain: Material
    sill: Material
    door: Material
    handle: Material
    garage: Material
    shutter: Material | None
    bars: Bars


def facade(
    width: float, height: float, openings: list[Opening], gable: float = 0.0, seam: float = 0.0, reveal: float = REVEAL
) -> Solid:
    """The wall with its reveals, `reveal` deep, and a gable of this height on top; no triangle crosses the level line at
    `seam`.
    """
    spans = [(o.x - o.width / 2, o.x + o.width / 2, o.z, o.z + o.height) for o in openings]
    x = np.unique(np.round([-width / 2, width / 2, *(v for s in spans for v in s[:2])], 6))
    z = np.unique(np.round([0.0, height, seam, *(v for s in spans for v in s[2:])], 6))
    middle = np.stack(np.meshgrid((x[1:] + x[:-1]) / 2, (z[1:] + z[:-1]) / 2, indexing="ij"), axis=-1)
    wall = np.ones(middle.shape[:2], bool)
    for a, b, low, high in spans:
        wall &= ~((middle[..., 0] > a) & (middle[..., 0] < b) & (middle[..., 1] > low) & (middle[..., 1] < high))
    i, k = np.nonzero(wall)
    corner = [(x[i + p], z[k + q]) for p, q in ((0, 0), (1, 0), (1, 1), (0, 1))]
    quads = np.stack([np.stack([u, 0 * u, v], axis=1) for u, v in corner], axis=1)
    reveals = [_reveal(*s, reveal) for s in spans] if reveal else []
    solid = _quads(np.concatenate([quads, *reveals]))
    if gable <= 0:
        return solid
    apex = np.array([[0.0, 0.0, height + gable]])
    edge = np.stack([x, 0 * x, np.full(len(x), height)], axis=1)
    n = np.arange(len(x) - 1)
    return join(solid, Solid(np.concatenate([apex, edge]), np.stack([0 * n, n + 1, n + 2], axis=1)))


def _quads(quads: Float) -> Solid:
    start = 4 * np.arange(len(quads))[:, None]
    return Solid(quads.reshape(-1, 3), np.concatenate([np.add(start, (0, 1, 2)), np.add(start, (0, 2, 3))]))


def _reveal(a: float, b: float, low: float, high: float, deep: float) -> Float:
    """The four sides of an opening, facing into it."""
    ring = [(a, low), (b, low), (b, high), (a, high)]
    sides = [(ring[k], ring[(k + 1) % 4]) for k in range(4)]
    return np.array([[(p[0], 0, p[1]), (q[0], 0, q[1]), (q[0], deep, q[1]), (p[0], deep, p[1])] for p, q in sides])


def filled(opening: Opening, j: Joinery, rng: np.random.Generator) -> list[Piece]:
    """The contents of an opening: window, door or garage door."""
    pieces = {"window": _window, "door": _door, "garage": _garage}[opening.kind](opening, j, rng)
    return [Piece(p.part, p.material, moved(p.solid, (opening.x, 0, opening.z))) for p in pieces]


def _border(w: float, h: float, thick: float, near: float, far: float) -> list[Solid]:
    """Four bars along the inside of a w x h opening."""
    return [
        cuboid((-w / 2, near, 0), (w / 2, far, thick)),
        cuboid((-w / 2, near, h - thick), (w / 2, far, h)),
        cuboid((-w / 2, near, thick), (-w / 2 + thick, far, h - thick)),
        cuboid((w / 2 - thick, near, thick), (w / 2, far, h - thick)),
    ]


def _window(o: Opening, j: Joinery, rng: np.random.Generator) -> list[Piece]:
    w, h = o.width, o.height
    bars = _border(w, h, 0.065, REVEAL - 0.075, REVEAL)
    upright = {"plain": [], "double": [0.0], "cross": [0.0], "sash": [], "georgian": [-w / 6, w / 6]}[j.bars]
    level = {"plain": [], "double": [], "cross": [0.62 * h], "sash": [0.5 * h], "georgian": [h / 3, 2 * h / 3]}[j.bars]
    thin = 0.014 if j.bars == "georgian" else 0.032
    bars += [cuboid((x - thin, REVEAL - 0.06, 0.05), (x + thin, REVEAL - 0.01, h - 0.05)) for x in upright]
    bars += [cuboid((-w / 2 + 0.05, REVEAL - 0.057, z - thin), (w / 2 - 0.05, REVEAL - 0.01, z + thin)) for z in level]
    pieces = [
        Piece("window_frame", j.frame, join(*bars)),
        Piece("window", j.glass, cuboid((-w / 2 - 0.01, REVEAL - 0.03, -0.01), (w / 2 + 0.01, REVEAL + 0.02, h + 0.01))),
        Piece("sill", j.sill, cuboid((-w / 2 - 0.06, -0.06, -0.06), (w / 2 + 0.06, REVEAL - 0.05, 0.004))),
    ]
    if rng.random() < 0.75:
        share = float(rng.uniform(0.14, 0.3)) * w
        drapes = [
            cuboid((s * w / 2 - share * (s > 0), REVEAL - 0.036, 0.02), (s * w / 2 + share * (s < 0), REVEAL, h - 0.02))
            for s in (-1, 1)
        ]
        pieces.append(Piece("curtain", j.curtain, join(*drapes)))
    if j.shutter is not None and w < 1.45:
        slats: list[Solid] = []
        for s in (-1, 1):
            middle = s * (0.75 * w + 0.02)
            slats.append(cuboid((middle - w / 4, -0.035, 0), (middle + w / 4, 0.01, h)))
            rows = np.arange(0.1, h - 0.15, 0.17)
            slats += [cuboid((middle - w / 4 + 0.05, -0.05, z), (middle + w / 4 - 0.05, 0, z + 0.1)) for z in rows]
        pieces.append(Piece("shutter", j.shutter, join(*slats)))
    return pieces


def _door(o: Opening, j: Joinery, rng: np.random.Generator) -> list[Piece]:
    w, h = o.width, o.height
    light = 0.38 if h > 2.25 else 0.0
    leaf = h - light - 0.05
    glazed = bool(rng.random() < 0.5)
    panels = [(0.14, 0.42), (0.5, 0.92)] if not glazed else [(0.14, 0.46)]
    raised = [
        cuboid((s * w / 4 - 0.17 * w, REVEAL - 0.075, a * leaf), (s * w / 4 + 0.17 * w, REVEAL, b * leaf))
        for a, b in panels
        for s in (-1, 1)
    ]
    panes = [cuboid((-0.3 * w, REVEAL - 0.073, 0.56 * leaf), (0.3 * w, REVEAL, 0.92 * leaf))] if glazed else []
    if light:
        panes.append(cuboid((-w / 2, REVEAL - 0.03, leaf + 0.05), (w / 2, REVEAL + 0.02, h + 0.01)))
    bars = [*_border(w, h, 0.06, REVEAL - 0.09, REVEAL), cuboid((-w / 2, REVEAL - 0.088, leaf), (w / 2, REVEAL, leaf + 0.05))]
    knob = lathe([(0, -0.01), (0.018, -0.008), (0.016, 0.0), (0.03, 0.02), (0.03, 0.035), (0.012, 0.05), (0, 0.05)], 10)
    handle = moved(turned(knob, 0, np.pi / 2), (0.36 * w, REVEAL - 0.065, 0.48 * leaf))
    pieces = [
        Piece(
            "door", j.door, join(cuboid((-w / 2 - 0.01, REVEAL - 0.06, -0.01), (w / 2 + 0.01, REVEAL + 0.02, leaf)), *raised)
        ),
        Piece("door_frame", j.frame, join(*bars)),
        Piece("door_handle", j.handle, handle),
        Piece("step", j.sill, cuboid((-w / 2 - 0.25, -0.75, -o.z), (w / 2 + 0.25, 0.02, -0.02))),
    ]
    return [*pieces, Piece("window", j.glass, join(*panes))] if panes else pieces


def _garage(o: Opening, j: Joinery, rng: np.random.Generator) -> list[Piece]:
    w, h = o.width, o.height
    rows = int(rng.integers(4, 7))
    each = h / rows
    leaf = [cuboid((-w / 2 - 0.01, REVEAL - 0.02, 0), (w / 2 + 0.01, REVEAL + 0.02, h + 0.01))]
    columns = int(rng.choice((1, 4)))
    wide = (w - 0.12) / columns
    for k in range(rows):
        for c in range(columns):
            a = -w / 2 + 0.06 + c * wide
            leaf.append(cuboid((a + 0.02, REVEAL - 0.05, k * each + 0.025), (a + wide - 0.02, REVEAL, (k + 1) * each - 0.025)))
    handle = cuboid((-0.1, REVEAL - 0.085, 0.42 * h), (0.1, REVEAL - 0.04, 0.42 * h + 0.025))
    return [
        Piece("garage_door", j.garage, join(*leaf)),
        Piece("door_frame", j.frame, join(*_border(w, h, 0.05, REVEAL - 0.08, REVEAL)[1:])),
        Piece("door_handle", j.handle, handle),
    ]
