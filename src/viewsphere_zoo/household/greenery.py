"""House plants above the soil, by habit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from viewsphere.assets.mesh import Material
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.paint import Color, linear
from viewsphere_zoo.shapes.rods import smooth
from viewsphere_zoo.shapes.solids import Float, Solid, curve, flipped, grid, join, lathe, loft, moved, tube, turned

OVATE = ((0, 0.06), (0.1, 0.5), (0.35, 1.0), (0.6, 0.85), (0.9, 0.25), (1, 0.0))
HEART = ((0, 0.5), (0.06, 0.92), (0.2, 1.0), (0.5, 0.72), (0.85, 0.22), (1, 0.0))
STRAP = ((0, 0.5), (0.15, 0.9), (0.5, 1.0), (0.8, 0.6), (1, 0.0))
SWORD = ((0, 0.62), (0.3, 0.9), (0.6, 1.0), (0.85, 0.72), (0.96, 0.3), (1, 0.0))
FLESHY = ((0, 0.5), (0.3, 0.75), (0.65, 1.0), (0.85, 0.8), (0.96, 0.35), (1, 0.02))
TAPER = ((0, 1.0), (0.3, 0.85), (0.7, 0.5), (1, 0.03))
"""Outlines of leaves: shares of the half width over the length."""

Outline = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Bed:
    """The bed of a plant: the soil's radius and height; the plant's reach above the soil, metres; its green."""

    radius: float
    level: float
    reach: float
    green: Color


def _path(length: float, pitch: float, bend: float, rows: int) -> tuple[Float, Float]:
    """Points (N, 2) of a leaf's middle, outwards and up, and its angles; pitch and bend over the length in radians."""
    angle = pitch + bend * np.linspace(0, 1, rows)
    step = length / (rows - 1)
    middle = (angle[:-1] + angle[1:]) / 2
    out = np.concatenate([[0], np.cumsum(np.cos(middle))]) * step
    up = np.concatenate([[0], np.cumsum(np.sin(middle))]) * step
    return np.stack([out, up], axis=1), angle


def blade(
    length: float, width: float, pitch: float, bend: float, outline: Outline = OVATE, fold: float = 0.2, rows: int = 8
) -> Solid:
    """A thin leaf from the origin towards +y, folded along its middle; a sheet that faces up."""
    path, angle = _path(length, pitch, bend, rows)
    half = width / 2 * curve(np.linspace(0, 1, rows), outline)
    side = np.array((1.0, 0.0, -1.0))[None, :]
    lift = fold * np.abs(side) * half[:, None]
    y, z = path[:, :1] - np.sin(angle)[:, None] * lift, path[:, 1:] + np.cos(angle)[:, None] * lift
    return grid(np.stack([side * half[:, None], y, z], axis=-1))


def thick(
    length: float,
    width: float,
    depth: float,
    pitch: float,
    bend: float,
    outline: Outline = FLESHY,
    rows: int = 7,
    sides: int = 8,
) -> Solid:
    """A fleshy leaf from the origin towards +y, closed, hollow above where it is flat."""
    path, angle = _path(length, pitch, bend, rows)
    share = curve(np.linspace(0, 1, rows), outline)[:, None]
    a = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    across = width / 2 * share * np.sin(a)
    up = depth / 2 * share * (np.cos(a) * np.where(np.cos(a) > 0, 0.4, 1.0)) + 0.12 * width * share * np.sin(a) ** 2
    y = path[:, :1] - np.sin(angle)[:, None] * up
    z = path[:, 1:] + np.cos(angle)[:, None] * up
    return loft(np.stack([across, y, z], axis=-1))


def _at(solid: Solid, place: ArrayLike, yaw: float, roll: float = 0.0) -> Solid:
    return moved(turned(turned(solid, 1, roll), 2, yaw), place)


def _leaf(name: str, color: Color, gloss: float = 0.5) -> Material:
    return Material(name, linear(color), roughness=gloss, specular=0.6)


_BARK = Material("bark", linear((0.36, 0.28, 0.2)), roughness=0.9)


def ficus(rng: np.random.Generator, bed: Bed) -> list[Piece]:
    """A small tree: a trunk that forks, with glossy leaves all along its branches."""
    h = bed.reach
    trunk = smooth([(0.0, 0.0, bed.level - 0.01), (0.02 * h, 0.01 * h, bed.level + 0.2 * h), (0, 0, bed.level + 0.42 * h)], 4)
    stems, leaves = [tube(trunk, np.linspace(0.016, 0.011, len(trunk)) * max(h, 0.3) / 0.45, 8)], list[Solid]()
    count = int(rng.integers(5, 8))
    for k in range(count):
        yaw, lean = 2 * np.pi * k / count + rng.uniform(-0.3, 0.3), rng.uniform(0.25, 0.95)
        away = np.array((-np.sin(yaw) * np.sin(lean), np.cos(yaw) * np.sin(lean), np.cos(lean)))
        foot = trunk[int(rng.integers(len(trunk) - 4, len(trunk)))]
        branch = smooth([foot, foot + 0.22 * h * away + (0, 0, 0.03 * h), foot + h * away * rng.uniform(0.42, 0.52)], 4)
        stems.append(tube(branch, np.linspace(0.007, 0.003, len(branch)) * max(h, 0.3) / 0.45, 6))
        leaves += _along(rng, branch[2:], 11, (0.16 * h, 0.22 * h), 0.48, OVATE)
    return [Piece("stems", _BARK, join(*stems)), Piece("leaves", _leaf("leaf", bed.green, 0.3), join(*leaves))]


def _along(
    rng: np.random.Generator, branch: Float, count: int, size: tuple[float, float], slim: float, outline: Outline
) -> list[Solid]:
    """Leaves that alternate along a branch."""
    yaw = rng.uniform(0, 6.3)
    leaves: list[Solid] = []
    for k in range(count):
        at = branch[round(k / (count - 1) * (len(branch) - 1))] + rng.normal(0, 0.004, 3)
        long = float(rng.uniform(*size))
        one = blade(long, slim * long, rng.uniform(-0.1, 0.7), rng.uniform(-1.3, -0.5), outline, 0.25, 6)
        leaves.append(_at(one, at, yaw + 2.4 * k, rng.uniform(-0.3, 0.3)))
    return leaves


def rubber(rng: np.random.Generator, bed: Bed) -> list[Piece]:
    """One to three upright stems with large dark leaves."""
    stems, leaves = list[Solid](), list[Solid]()
    for k in range(int(rng.integers(1, 4))):
        x, y = rng.uniform(-0.35, 0.35, 2) * bed.radius
        lean, rise = np.array([1.0, 1.2, 1.8]), np.array([-0.01, 0.35 * bed.reach, bed.reach * (0.72 - 0.16 * k)])
        stem = smooth(np.stack([x * lean, y * lean, bed.level + rise], axis=1), 7)
        stems.append(tube(stem, 0.006, 7))
        leaves += _along(rng, stem[3:], 11, (0.26 * bed.reach, 0.36 * bed.reach), 0.52, OVATE)
        leaves.append(_at(blade(0.2 * bed.reach, 0.04 * bed.reach, 1.4, 0.1, OVATE), stem[-1], rng.uniform(0, 6.3)))
    return [
        Piece("stems", _leaf("stem", (0.38, 0.36, 0.2), 0.7), join(*stems)),
        Piece("leaves", _leaf("leaf", bed.green, 0.22), join(*leaves)),
    ]


def snake(rng: np.random.Generator, bed: Bed) -> list[Piece]:
    """Sword-shaped leaves that stand upright, banded, with pale edges."""
    cores, edges = list[Solid](), list[Solid]()
    count = int(rng.integers(8, 13))
    for k in range(count):
        away = bed.radius * 0.62 * np.sqrt((k + 0.3) / count)
        yaw = 2.4 * k + rng.uniform(-0.3, 0.3)
        long = bed.reach * float(rng.uniform(0.62, 1.0) if k > 2 else rng.uniform(0.9, 1.05))
        wide = float(rng.uniform(0.034, 0.048)) * max(bed.reach, 0.3) / 0.45
        pitch = np.pi / 2 - 0.3 * away / bed.radius - rng.uniform(0, 0.08)
        place = (-away * np.sin(yaw), away * np.cos(yaw), bed.level - 0.01)
        bend = float(rng.uniform(-0.08, 0.12))
        core, rim = (
            thick(long * s, wide * f, d, pitch, bend, SWORD, 9, 6) for s, f, d in ((0.985, 0.8, 0.0068), (1.0, 1.0, 0.0035))
        )
        cores.append(_at(core, place, yaw))
        edges.append(_at(rim, place, yaw))
    return [
        Piece("leaves", _leaf("leaf", bed.green, 0.4), join(*cores)),
        Piece("leaves", _leaf("edge", (0.78, 0.76, 0.42), 0.45), join(*edges)),
    ]


def fern(rng: np.random.Generator, bed: Bed) -> list[Piece]:
    """Arching fronds of many leaflets."""
    stalks, leaves = list[Solid](), list[Solid]()
    count, pairs = 30, 17
    for k in range(count):
        inner = (k + 0.5) / count
        long = bed.reach * float(rng.uniform(0.85, 1.15))
        path, angle = _path(long, 1.35 - 0.75 * inner, -rng.uniform(1.3, 1.9), pairs + 3)
        yaw = 2.4 * k
        place = (0.25 * bed.radius * -np.sin(yaw), 0.25 * bed.radius * np.cos(yaw), bed.level - 0.005)
        spine = np.column_stack([np.zeros(len(path)), path])
        stalks.append(_at(tube(spine[[0, 4, 8, 12, 16, -1]], 0.0011, 3), place, yaw))
        leaves.append(_at(_leaflets(spine[3:], angle[3:], 0.24 * long), place, yaw))
    return [
        Piece("stems", _leaf("stem", (0.33, 0.36, 0.16), 0.7), join(*stalks)),
        Piece("leaves", _leaf("leaf", bed.green, 0.55), join(*leaves)),
    ]


def _leaflets(spine: Float, angle: Float, length: float) -> Solid:
    """Pairs of rhombic leaflets of two triangles along a frond; shorter towards its tip."""
    n = len(spine)
    s = np.linspace(0, 1, n)
    size = length * curve(s, [(0, 0.55), (0.2, 0.95), (0.45, 1.0), (1, 0.12)])[:, None]
    along = np.column_stack([np.zeros(n), np.cos(angle), np.sin(angle)])
    solids: list[Solid] = []
    for side in (1.0, -1.0):
        out = np.array((side, 0, 0)) * 0.92 + 0.35 * along + np.array((0, 0, -0.18))
        wide = 0.3 * np.abs(spine[1, 1:] - spine[0, 1:]).max() * along * 3.2
        foot, tip = spine, spine + size * out
        near, far = spine + 0.45 * size * out - 0.5 * wide, spine + 0.4 * size * out + 0.5 * wide
        quads = np.stack([foot, near, tip, far], axis=1)
        start = 4 * np.arange(n)[:, None]
        one = Solid(quads.reshape(-1, 3), np.concatenate([np.add(start, (0, 1, 2)), np.add(start, (0, 2, 3))]))
        solids.append(one if side > 0 else flipped(one))
    return join(*solids)


def rosette(rng: np.random.Generator, bed: Bed) -> list[Piece]:
    """Succulents: one large rosette of fleshy leaves, or three small ones."""
    leaves: list[Solid] = []
    several = rng.random() < 0.4
    spots = [(0.52 * bed.radius * np.cos(a), 0.52 * bed.radius * np.sin(a)) for a in rng.uniform(0, 6.3) + 2.1 * np.arange(3)]
    for x, y in spots if several else [(0.0, 0.0)]:
        size = bed.radius * (0.62 if several else 1.15)
        count = 15 if several else 34
        for k in range(count):
            f = (k + 0.5) / count
            long = size * (0.95 - 0.6 * f)
            one = thick(long, 0.56 * long, 0.2 * long, 0.15 + 1.2 * f, 0.5, FLESHY, 5, 6)
            leaves.append(_at(one, (x, y, bed.level + 0.1 * size * f), 2.4 * k + rng.uniform(-0.1, 0.1)))
    return [Piece("leaves", _leaf("leaf", bed.green, 0.55), join(*leaves))]


def aloe(rng: np.random.Generator, bed: Bed) -> list[Piece]:
    """Thick tapering leaves in a tuft, with teeth."""
    leaves, teeth = list[Solid](), list[Solid]()
    count = int(rng.integers(13, 18))
    for k in range(count):
        f = (k + 0.5) / count
        long = bed.reach * float(rng.uniform(0.8, 1.05))
        wide = 0.13 * bed.reach
        yaw, place = 2.4 * k, (0, 0, bed.level - 0.01 + 0.02 * f)
        pitch, bend = 0.55 + 0.85 * f, rng.uniform(0.15, 0.6)
        leaves.append(_at(thick(long, wide, 0.45 * wide, pitch, bend, TAPER, 8, 8), place, yaw))
        path, angle = _path(long, pitch, bend, 8)
        half = wide / 2 * curve(np.linspace(0, 1, 8), TAPER)
        for i in range(1, 7):
            for s in (-1, 1):
                up = 0.12 * 2 * half[i]
                at = np.array((s * 0.93 * half[i], path[i, 0] - np.sin(angle[i]) * up, path[i, 1] + np.cos(angle[i]) * up))
                spike = turned(lathe([(0.0018, 0), (0.0, 0.006)], 4), 1, s * np.pi / 2)
                teeth.append(_at(moved(spike, at), place, yaw))
    return [
        Piece("leaves", _leaf("leaf", bed.green, 0.5), join(*leaves)),
        Piece("leaves", _leaf("teeth", (0.82, 0.84, 0.6), 0.6), join(*teeth)),
    ]


def cactus(rng: np.random.Generator, bed: Bed) -> list[Piece]:
    """A ribbed column with spines, one or two side shoots, at times a flower."""
    r = float(np.clip(0.24 * bed.reach, 0.02, 0.62 * bed.radius))
    bodies, spines = list[Solid](), list[Solid]()
    tops: list[Float] = []
    arms = [((0.0, 0.0), bed.reach, r)]
    if rng.random() < 0.6:
        arms += [
            ((0.75 * bed.radius * s, 0.1 * r), bed.reach * rng.uniform(0.4, 0.62), 0.55 * r)
            for s in (-1, 1)[: int(rng.integers(1, 3))]
        ]
    for (x, y), tall, wide in arms:
        body, thorns = _column(rng, tall, wide, 2)
        at = (x, y, bed.level - 0.005)
        bodies.append(moved(body, at))
        spines.append(moved(thorns, at))
        tops.append(np.array((x, y, bed.level - 0.005 + tall)))
    pieces = [
        Piece("stems", _leaf("leaf", bed.green, 0.65), join(*bodies)),
        Piece("spines", _leaf("spine", (0.9, 0.85, 0.68), 0.7), join(*spines)),
    ]
    if rng.random() < 0.55:
        petals = [
            _at(blade(0.7 * r, 0.26 * r, 0.5 + 0.5 * (k % 2), 0.5, OVATE, 0.3, 5), tops[0] - (0, 0, 0.06 * r), k * 0.52)
            for k in range(12)
        ]
        color: Color = ((0.88, 0.25, 0.5), (0.95, 0.7, 0.15), (0.85, 0.2, 0.15))[int(rng.integers(3))]
        pieces.append(Piece("flowers", _leaf("petal", color, 0.6), join(*petals)))
    return pieces


def _column(rng: np.random.Generator, tall: float, wide: float, step: int) -> tuple[Solid, Solid]:
    """One shoot with spines at every `step`th level, standing on the origin."""
    ribs = int(rng.integers(8, 11))
    t = np.linspace(0, 1, 13)
    z = tall * t
    r = wide * curve(t, [(0, 0.8), (0.2, 0.97), (0.55, 1.0), (0.85, 0.9), (0.96, 0.5), (1, 0.05)])
    a = np.linspace(0, 2 * np.pi, 4 * ribs, endpoint=False)
    around = 1 - 0.16 * (0.5 - 0.5 * np.cos(ribs * a))
    rings = np.stack(
        [r[:, None] * around * np.cos(a), r[:, None] * around * np.sin(a), np.broadcast_to(z[:, None], (13, len(a)))], axis=-1
    )
    thorn = lathe([(0.0007, 0), (0, 0.009)], 3)
    thorns: list[Solid] = []
    for k in range(ribs):
        for i in range(2, 12, step):
            place = np.array((r[i] * 0.98, 0, z[i]))
            for lean in (-0.6, 0.6):
                spike = turned(turned(thorn, 1, np.pi / 2), 2, lean)
                thorns.append(turned(moved(spike, place), 2, 2 * np.pi * k / ribs))
    return loft(rings), join(*thorns)


def hearts(rng: np.random.Generator, bed: Bed) -> list[Piece]:
    """Heart-shaped leaves on long stalks that lean outwards, some over the pot's edge."""
    stalks, leaves = list[Solid](), list[Solid]()
    count = int(rng.integers(20, 28))
    for k in range(count):
        f = (k + 0.5) / count
        yaw = 2.4 * k + rng.uniform(-0.2, 0.2)
        long = bed.reach * float(rng.uniform(0.55, 0.95)) * (0.75 + 0.3 * f)
        path, _ = _path(long, 0.75 + 0.75 * f, -rng.uniform(0.3, 0.9), 6)
        stem = np.column_stack([np.zeros(6), path])
        place = (-0.3 * bed.radius * np.sin(yaw), 0.3 * bed.radius * np.cos(yaw), bed.level - 0.005)
        stalks.append(_at(tube(stem, 0.0022, 5), place, yaw))
        size = bed.reach * float(rng.uniform(0.3, 0.42))
        one = blade(size, 0.8 * size, rng.uniform(-0.3, 0.2), rng.uniform(-0.9, -0.4), HEART, 0.16, 7)
        leaves.append(_at(moved(one, stem[-1] - (0, 0.08 * size, 0)), place, yaw))
    return [
        Piece("stems", _leaf("stem", (0.36, 0.46, 0.2), 0.6), join(*stalks)),
        Piece("leaves", _leaf("leaf", bed.green, 0.3), join(*leaves)),
    ]


def palm(rng: np.random.Generator, bed: Bed) -> list[Piece]:
    """A bare stem or two under tufts of long narrow leaves that arch."""
    stems, leaves = list[Solid](), list[Solid]()
    for k in range(int(rng.integers(1, 4))):
        x, y = rng.uniform(-0.4, 0.4, 2) * bed.radius
        tall = bed.reach * (0.52 - 0.16 * k)
        stem = smooth(
            [(x, y, bed.level - 0.01), (1.3 * x, 1.3 * y, bed.level + 0.6 * tall), (1.5 * x, 1.5 * y, bed.level + tall)], 4
        )
        stems.append(tube(stem, 0.009, 8))
        for i in range(26):
            f = (i + 0.5) / 26
            long = bed.reach * float(rng.uniform(0.42, 0.56))
            one = blade(long, 0.085 * long, 0.1 + 1.3 * f, -rng.uniform(0.7, 1.5) * (1.1 - 0.6 * f), STRAP, 0.4, 8)
            leaves.append(_at(one, stem[-1] - (0, 0, 0.05 * (1 - f) * tall), 2.4 * i))
    return [Piece("stems", _BARK, join(*stems)), Piece("leaves", _leaf("leaf", bed.green, 0.4), join(*leaves))]


HABITS: dict[str, Callable[[np.random.Generator, Bed], list[Piece]]] = {
    h.__name__: h for h in (ficus, rubber, snake, fern, rosette, aloe, cactus, hearts, palm)
}
"""All habits by name."""
