"""The look of plates and bowls: glazes, woods, bands around, flowers on the rim."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from viewsphere.assets.mesh import Image
from viewsphere_zoo.household.canvas import Canvas, blank, disc, leaf
from viewsphere_zoo.shapes.paint import Color
from viewsphere_zoo.townscape.textures import noise, painted

GLAZES: tuple[tuple[Color, Color, Color], ...] = (
    ((0.93, 0.92, 0.9), (0.12, 0.24, 0.5), (0.75, 0.25, 0.2)),
    ((0.93, 0.92, 0.9), (0.12, 0.24, 0.5), (0.4, 0.55, 0.75)),
    ((0.94, 0.93, 0.9), (0.75, 0.58, 0.25), (0.4, 0.42, 0.4)),
    ((0.88, 0.84, 0.75), (0.4, 0.3, 0.22), (0.36, 0.45, 0.32)),
    ((0.55, 0.66, 0.68), (0.2, 0.3, 0.36), (0.92, 0.9, 0.84)),
    ((0.2, 0.3, 0.42), (0.88, 0.86, 0.8), (0.75, 0.5, 0.3)),
    ((0.32, 0.34, 0.35), (0.82, 0.8, 0.75), (0.6, 0.4, 0.25)),
    ((0.72, 0.42, 0.28), (0.93, 0.88, 0.78), (0.35, 0.18, 0.12)),
    ((0.5, 0.58, 0.4), (0.93, 0.92, 0.84), (0.3, 0.34, 0.2)),
    ((0.85, 0.68, 0.28), (0.94, 0.93, 0.88), (0.3, 0.22, 0.15)),
    ((0.62, 0.14, 0.13), (0.13, 0.12, 0.12), (0.93, 0.85, 0.6)),
    ((0.84, 0.68, 0.66), (0.55, 0.25, 0.28), (0.95, 0.93, 0.9)),
)
"""Ground, first and second colour of the decoration."""

WOODS: tuple[Color, ...] = ((0.62, 0.42, 0.25), (0.45, 0.28, 0.16), (0.74, 0.56, 0.36), (0.34, 0.2, 0.13))


def wood(rng: np.random.Generator, color: Color) -> Image:
    """Turned wood from above: grain across, with rings of growth."""
    size = 256
    grain, wide = noise(rng, size, 1.2, 14.0), noise(rng, size, 14.0, 3.0)
    rings = np.sin(24 * (np.arange(size)[:, None] / size + 0.1 * wide))
    return painted("wood", color, 1 + 0.07 * grain + 0.1 * rings + 0.05 * wide)


def banded(radius: float, ground: Color, colors: Sequence[Color], bands: int, flowers: int = 0, start: float = 0.97) -> Image:
    """A dish from above: rings near its edge, from a share of its radius inwards, with this number of flowers between them."""
    c = blank(2 * radius, 2 * radius, ground, 384)
    r = np.hypot(c.x - radius, c.y - radius)
    for k in range(bands):
        c.paint(
            np.abs(r - (start - 0.075 * k - 0.02) * radius) - (0.022, 0.006, 0.012)[k % 3] * radius, colors[k % len(colors)]
        )
    for k in range(flowers):
        a = 2 * np.pi * k / flowers
        _flower(c, radius * (1 + 0.8 * np.cos(a)), radius * (1 + 0.8 * np.sin(a)), 0.1 * radius, a, colors)
    return c.image("dish")


def _flower(c: Canvas, x: float, y: float, size: float, turn: float, colors: Sequence[Color]) -> None:
    part = c.window((x - 2 * size, y - 2 * size), (x + 2 * size, y + 2 * size))
    for side in (np.pi / 2, -np.pi / 2):
        part.paint(leaf(part, x, y, 1.9 * size, 0.5 * size, turn + side), colors[-1])
    for k in range(5):
        a = turn + 2 * np.pi * k / 5
        part.paint(disc(part, x + 0.5 * size * np.cos(a), y + 0.5 * size * np.sin(a), 0.36 * size), colors[0])
    part.paint(disc(part, x, y, 0.25 * size), (0.93, 0.78, 0.3))
