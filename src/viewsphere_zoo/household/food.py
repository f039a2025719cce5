"""The food in bowls and on plates."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from viewsphere.assets.mesh import Material
from viewsphere_zoo.household.draws import pick
from viewsphere_zoo.household.vessels import disc
from viewsphere_zoo.shapes.assembly import Piece
from viewsphere_zoo.shapes.paint import Color, linear
from viewsphere_zoo.shapes.rods import copies, turns
from viewsphere_zoo.shapes.solids import Float, Solid, join, lathe, moved, tube, turned
from viewsphere_zoo.townscape.foliage import blob, leaves

Filling = Callable[[np.random.Generator, float, float], list[Piece]]
"""Draws the pieces of a filling, given the generator, the vessel's inner radius at the filling's level, and that level,
metres.
"""


def _matter(name: str, color: Color, roughness: float = 0.5) -> Material:
    return Material(name, linear(color), roughness=roughness)


def _spread(rng: np.random.Generator, count: int, radius: float) -> Float:
    """Points (count, 2) spread evenly over a disc in a sunflower pattern, slightly jittered."""
    k = np.arange(count) + 0.5
    r, a = radius * np.sqrt(k / count), k * np.pi * (3 - 5**0.5) + rng.uniform(0, 6.3)
    return np.stack([r * np.cos(a), r * np.sin(a)], axis=1) + rng.normal(0, 0.06 * radius, (count, 2))


def soup(rng: np.random.Generator, radius: float, level: float) -> list[Piece]:
    """A soup with herbs or croutons."""
    color: Color = pick(rng, ((0.78, 0.28, 0.1), (0.86, 0.6, 0.2), (0.5, 0.55, 0.22), (0.8, 0.7, 0.5)))
    spots = _spread(rng, 26, 0.75 * radius)
    at = np.column_stack([spots, np.full(len(spots), level + 0.001)])
    herbs = leaves(rng, at, np.tile((0.0, 0.0, 1.0), (len(at), 1)), (0.008, 0.014))
    return [
        Piece("content", _matter("soup", color, 0.25), disc(radius + 0.001, level, 48)),
        Piece("content", _matter("herbs", (0.2, 0.42, 0.14)), herbs),
    ]


def rings(rng: np.random.Generator, radius: float, level: float) -> list[Piece]:
    """Breakfast cereal in milk."""
    a = np.linspace(0, 2 * np.pi, 6)
    ring = lathe(np.stack([0.0058 + 0.0026 * np.cos(a), 0.0026 * np.sin(a)], axis=1), 9)
    color: Color = pick(rng, ((0.82, 0.6, 0.3), (0.75, 0.5, 0.25), (0.45, 0.26, 0.13)))
    count = min(int(2600 * radius**1.5), 26)
    spots = _spread(rng, count, radius - 0.012)
    tilt = turns(0, rng.normal(0, 0.25, count)) @ turns(1, rng.normal(0, 0.25, count))
    heap = copies(ring, tilt, np.column_stack([spots, np.full(count, level + 0.0015)]))
    return [
        Piece("content", _matter("milk", (0.93, 0.92, 0.88), 0.3), disc(radius + 0.001, level, 48)),
        Piece("content", _matter("cereal", color, 0.8), heap),
    ]


def fruit(rng: np.random.Generator, radius: float, level: float) -> list[Piece]:
    """Oranges, apples or lemons in a heap."""
    size = min(0.42 * radius, 0.038)
    kinds: list[tuple[str, Color]] = [
        ("orange", (0.93, 0.48, 0.08)),
        ("apple", (0.7, 0.1, 0.1)),
        ("green_apple", (0.55, 0.68, 0.2)),
        ("lemon", (0.93, 0.8, 0.2)),
    ]
    chosen = rng.choice(len(kinds), 2, replace=False)
    count = 5 if radius > 0.05 else 3
    ring = 1.08 * size / np.sin(np.pi / count)
    ring = min(ring, radius - 0.8 * size)
    places = [(ring * np.cos(a), ring * np.sin(a), level) for a in 2 * np.pi * np.arange(count) / count + rng.uniform(0, 6.3)]
    places += [(0.0, 0.0, level + 0.85 * size)]
    pieces = []
    for k, at in enumerate(places):
        name, color = kinds[chosen[k % 2]]
        pieces.append(
            Piece("content", _matter(name, color, 0.4), moved(_fruit(size * float(rng.uniform(0.92, 1.05)), rng), at))
        )
    return pieces


def _fruit(size: float, rng: np.random.Generator) -> Solid:
    """A round fruit with a dimple and a stalk."""
    t = np.linspace(-np.pi / 2, np.pi / 2, 10)
    r, z = np.cos(t), np.sin(t) - 0.22 * np.exp(-(((t - np.pi / 2) / 0.45) ** 2))
    stalk = lathe([(0, 0.6), (0.05, 0.6), (0.05, 0.98), (0, 0.98)], 6)
    body = join(lathe(np.stack([r, z], axis=1), 16), stalk)
    return turned(turned(Solid(size * body.vertices, body.triangles), 0, rng.uniform(-0.7, 0.7)), 2, rng.uniform(0, 6.3))


def salad(rng: np.random.Generator, radius: float, level: float) -> list[Piece]:
    """Leaves with slices of tomato and cucumber."""
    heap = moved(blob(rng, (0.85 * radius, 0.85 * radius, 0.02), 1, 0.25), (0, 0, level))
    points = np.column_stack([_spread(rng, 110, 0.66 * radius), rng.uniform(level + 0.008, level + 0.026, 110)])
    out = np.column_stack([points[:, :2] / radius, np.full(110, 0.9)])
    greens = leaves(rng, points, out / np.linalg.norm(out, axis=1, keepdims=True), (0.4 * radius, 0.6 * radius))
    pieces = [
        Piece("content", _matter("greens", (0.3, 0.5, 0.14)), greens),
        Piece("content", _matter("heap", (0.22, 0.4, 0.1)), heap),
    ]
    for name, color, r in (("tomato", (0.8, 0.16, 0.1), 0.017), ("cucumber", (0.75, 0.85, 0.55), 0.014)):
        slice_ = lathe([(0, -0.003), (0.9 * r, -0.003), (r, 0), (0.9 * r, 0.003), (0, 0.003)], 14)
        spots = _spread(rng, 5, 0.55 * radius)
        tilt = turns(0, rng.normal(0, 0.5, 5)) @ turns(1, rng.normal(0, 0.5, 5))
        pieces.append(
            Piece(
                "content", _matter(name, color, 0.35), copies(slice_, tilt, np.column_stack([spots, np.full(5, level + 0.024)]))
            )
        )
    return pieces


def cookies(rng: np.random.Generator, radius: float, level: float) -> list[Piece]:
    """A heap of cookies with chips of chocolate."""
    r = 0.028
    edge = lathe([(0, 0), (0.85 * r, 0), (r, 0.004), (0.9 * r, 0.009), (0.5 * r, 0.011), (0, 0.0115)], 12)
    chip = lathe([(0.0042, -0.001), (0.0036, 0.002), (0, 0.0032)], 6)
    count = 5
    a = 2 * np.pi * np.arange(count) / count + rng.uniform(0, 6.3)
    places = np.concatenate([0.72 * radius * np.column_stack([np.cos(a), np.sin(a)]), rng.normal(0, 0.12 * radius, (2, 2))])
    heights = level + 0.0118 * np.array([0] * count + [1, 2])
    at = np.column_stack([places, heights])
    spots = np.concatenate([_spread(rng, 7, 0.7 * r) + xy for xy in places])
    chips = np.column_stack([spots, np.repeat(heights + 0.0095, 7)])
    tone: Color = pick(rng, ((0.74, 0.52, 0.28), (0.66, 0.43, 0.22), (0.4, 0.24, 0.13)))
    flat = np.tile(np.eye(3), (len(at), 1, 1))
    return [
        Piece("content", _matter("cookie", tone, 0.85), copies(edge, flat, at)),
        Piece("content", _matter("chips", (0.2, 0.11, 0.07), 0.4), copies(chip, np.tile(np.eye(3), (len(chips), 1, 1)), chips)),
    ]


def breakfast(rng: np.random.Generator, radius: float, level: float) -> list[Piece]:
    """Two fried eggs, sausages and peas."""
    egg = lathe([(0.031, 0), (0.03, 0.003), (0.02, 0.0048), (0, 0.005)], 22)
    wobble = 1 + 0.08 * np.sin(3 * np.arctan2(egg.vertices[:, 1], egg.vertices[:, 0]) + rng.uniform(0, 6.3))
    white = Solid(egg.vertices * np.column_stack([wobble, wobble, np.ones(len(wobble))]), egg.triangles)
    t = np.linspace(0, np.pi / 2, 6)
    yolk = lathe(np.stack([0.0125 * np.cos(t), 0.003 + 0.009 * np.sin(t)], axis=1), 16)
    places = [(-0.42 * radius, 0.35 * radius, level), (0.42 * radius, 0.4 * radius, level)]
    bend = np.linspace(-0.8, 0.8, 9)
    arc = np.column_stack([0.05 * np.sin(bend), 0.05 * (np.cos(bend) - 1), np.full(9, 0.0095)])
    link = tube(arc, 0.0095 * np.sqrt(np.clip(1.03 - np.linspace(-1, 1, 9) ** 8, 0.1, 1)), 10)
    links = [moved(link, (0, y * radius, level)) for y in (-0.15, -0.45)]
    t = np.linspace(-np.pi / 2, np.pi / 2, 4)
    pea = lathe(0.004 * np.stack([np.cos(t), 1 + np.sin(t)], axis=1), 6)
    spots = np.column_stack([np.add(_spread(rng, 16, 0.22 * radius), (0.2 * radius, -0.78 * radius)), np.full(16, level)])
    return [
        Piece("content", _matter("egg_white", (0.95, 0.94, 0.9), 0.35), join(*(moved(white, at) for at in places))),
        Piece("content", _matter("yolk", (0.95, 0.65, 0.1), 0.25), join(*(moved(yolk, at) for at in places))),
        Piece("content", _matter("sausage", (0.5, 0.22, 0.11), 0.4), join(*links)),
        Piece("content", _matter("peas", (0.36, 0.58, 0.2), 0.45), copies(pea, np.tile(np.eye(3), (16, 1, 1)), spots)),
    ]


FILLINGS: dict[str, Filling] = {
    "soup": soup,
    "rings": rings,
    "fruit": fruit,
    "salad": salad,
    "cookies": cookies,
    "breakfast": breakfast,
}
"""All fillings by name."""
