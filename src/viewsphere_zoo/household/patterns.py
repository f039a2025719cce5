"""Decorations: stripes, dots, checks, leaves, waves, words. Each paints a canvas whose left and right edges meet around a
vessel.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from viewsphere_zoo.household.canvas import Canvas, disc, heart, leaf, line, polygon, rect
from viewsphere_zoo.household.lettering import fitted, write
from viewsphere_zoo.shapes.paint import Color
from viewsphere_zoo.townscape.surfaces import waves

Pattern = Callable[[Canvas, Sequence[Color], np.random.Generator], None]

WORDS = ("HELLO", "COFFEE", "MORNING", "HOME", "TEA TIME", "LUCKY", "SMILE", "BOSS", "MUM", "DAD", "GOOD DAY", "HERO", "RELAX")


def extent(c: Canvas) -> tuple[float, float]:
    """Width and height of a canvas, metres."""
    return float(c.x[0, -1]) + c.pixel / 2, float(c.y[0, 0]) + c.pixel / 2


def rings(c: Canvas, colors: Sequence[Color], rng: np.random.Generator) -> None:
    """Bands around, of several widths."""
    _, h = extent(c)
    count = int(rng.integers(2, 6))
    for k, y in enumerate(np.linspace(0.15, 0.85, count) * h):
        c.paint(np.abs(c.y - y) - h * rng.uniform(0.2, 0.42) * 0.5 / count, colors[k % len(colors)])


def uprights(c: Canvas, colors: Sequence[Color], rng: np.random.Generator) -> None:
    """Stripes from the foot to the lip."""
    w, _ = extent(c)
    step = w / int(rng.integers(12, 28))
    share = rng.uniform(0.15, 0.32)
    for k, color in enumerate(colors[:2]):
        c.paint(np.abs((c.x + k * step / 2) % step - step / 2) - share * step / (1 + k), color)


def dots(c: Canvas, colors: Sequence[Color], rng: np.random.Generator) -> None:
    """Dots in shifted rows."""
    w, h = extent(c)
    step = w / int(rng.integers(9, 20))
    rows = max(int(h / step / 0.87), 1)
    for k in range(rows):
        x = (c.x + (k % 2) * step / 2) % step - step / 2
        c.paint(np.hypot(x, c.y - (k + 0.5) * h / rows) - rng.uniform(0.25, 0.3) * step, colors[k % len(colors)])


def checks(c: Canvas, colors: Sequence[Color], rng: np.random.Generator) -> None:
    """A tablecloth's checks: two sets of half-clear bands."""
    w, _ = extent(c)
    step = w / int(rng.integers(8, 18))
    for at in (c.x, c.y):
        c.paint(np.abs(at % step - step / 2) - step / 4, colors[0], 0.6)


def zigzag(c: Canvas, colors: Sequence[Color], rng: np.random.Generator) -> None:
    """Lines that go up and down."""
    w, h = extent(c)
    step = w / int(rng.integers(8, 16))
    rise = np.abs(c.x % step - step / 2)
    count = int(rng.integers(2, 5))
    for k in range(count):
        c.paint(np.abs(c.y - h * (0.2 + 0.55 * k / count) - rise) - 0.035 * h, colors[k % len(colors)])


def sprigs(c: Canvas, colors: Sequence[Color], rng: np.random.Generator) -> None:
    """Scattered twigs with leaves and berries."""
    w, h = extent(c)
    columns, rows = max(int(w / (0.4 * h)), 3), 2
    for k in range(columns * rows):
        x = (k % columns + 0.5 * (k // columns) + rng.uniform(0.2, 0.5)) * w / columns % w
        y = (k // columns + rng.uniform(0.4, 0.6)) * h / rows
        _sprig(c, min(max(x, 0.16 * h), w - 0.16 * h), y, 0.3 * h, rng.uniform(0.6, 2.5), colors)


def _sprig(c: Canvas, x: float, y: float, size: float, turn: float, colors: Sequence[Color]) -> None:
    part = c.window((x - size, y - size), (x + size, y + size))
    along = np.array((np.cos(turn), np.sin(turn)))
    foot = np.array((x, y)) - 0.5 * size * along
    part.paint(line(part, [foot, foot + size * along], 0.05 * size), colors[0])
    for k in range(5):
        at = foot + along * size * (0.2 + 0.17 * k)
        part.paint(leaf(part, at[0], at[1], 0.38 * size, 0.16 * size, turn + (0.8 if k % 2 else -0.8)), colors[0])
    tip = foot + 1.04 * size * along
    part.paint(disc(part, tip[0], tip[1], 0.1 * size), colors[-1])


def hills(c: Canvas, colors: Sequence[Color], rng: np.random.Generator) -> None:
    """Wavy layers, one in front of the other."""
    w, h = extent(c)
    for k, color in enumerate(colors):
        n, m = int(rng.integers(2, 5)), int(rng.integers(5, 9))
        a, b = rng.uniform(0, 6.3, 2)
        swell = np.sin(2 * np.pi * n * c.x / w + a) + 0.4 * np.sin(2 * np.pi * m * c.x / w + b)
        c.paint(c.y - h * (0.62 - 0.2 * k + 0.06 * swell), color)


def dipped(c: Canvas, colors: Sequence[Color], rng: np.random.Generator) -> None:
    """Another glaze from the lip down, with runs."""
    w, h = extent(c)
    edge = sum(rng.uniform(0.2, 1) * np.sin(2 * np.pi * n * c.x / w + rng.uniform(0, 6.3)) for n in range(3, 9))
    c.paint(h * rng.uniform(0.3, 0.65) + 0.012 * h * edge - c.y, colors[0])


def speckled(c: Canvas, colors: Sequence[Color], rng: np.random.Generator) -> None:
    """Stoneware's dark grains."""
    w, h = extent(c)
    size = 0.0007 + 0.0006 * rng.random()
    for _ in range(160):
        x, y, r = rng.uniform(0, w), rng.uniform(0, h), size * rng.uniform(0.5, 1.6)
        part = c.window((x - 2 * r - c.pixel, y - 2 * r - c.pixel), (x + 2 * r + c.pixel, y + 2 * r + c.pixel))
        part.paint(disc(part, x, y, r), (0.25, 0.2, 0.17), 0.8)
    c.shade(1 + 0.03 * waves(rng, np.stack([c.x, c.y], axis=-1).reshape(-1, 2), 0.02).reshape(c.x.shape))


def hearts(c: Canvas, colors: Sequence[Color], rng: np.random.Generator) -> None:
    """One large heart on either side."""
    w, h = extent(c)
    for k in range(2):
        c.paint(heart(c, w * (0.25 + 0.5 * k), 0.52 * h, 0.5 * h), colors[0])


def word(c: Canvas, colors: Sequence[Color], rng: np.random.Generator) -> None:
    """A word on either side, between two lines."""
    w, h = extent(c)
    text = WORDS[int(rng.integers(len(WORDS)))]
    size = fitted(text, 0.32 * h, 0.36 * w)
    for k in range(2):
        write(c, text, w * (0.25 + 0.5 * k), 0.52 * h, size, colors[0])
    for y in (0.52 * h - 0.85 * size, 0.52 * h + 0.85 * size):
        for k in range(2):
            x = w * (0.25 + 0.5 * k)
            c.paint(rect(c, (x - 0.14 * w, y - 0.01 * h), (x + 0.14 * w, y + 0.01 * h)), colors[-1])


def diamonds(c: Canvas, colors: Sequence[Color], rng: np.random.Generator) -> None:
    """A belt of lozenges between two lines."""
    w, h = extent(c)
    count = int(rng.integers(8, 18))
    step, y0 = w / count, h * rng.uniform(0.4, 0.7)
    x = np.abs(c.x % step - step / 2)
    c.paint((x + np.abs(c.y - y0) - 0.4 * step) * 0.7, colors[0])
    c.paint((x + np.abs(c.y - y0) - 0.18 * step) * 0.7, colors[-1])
    c.paint(np.abs(np.abs(c.y - y0) - 0.62 * step) - 0.06 * step, colors[0])


def flags(c: Canvas, colors: Sequence[Color], rng: np.random.Generator) -> None:
    """Triangles side by side, point down."""
    w, h = extent(c)
    count = int(rng.integers(10, 18))
    step = w / count
    for k in range(count):
        corners = [(k * step, 0.8 * h), ((k + 0.5) * step, 0.8 * h - 1.1 * step), ((k + 1) * step, 0.8 * h)]
        part = c.window((k * step - c.pixel, 0.8 * h - 1.2 * step), ((k + 1) * step + c.pixel, 0.82 * h))
        part.paint(polygon(part, corners), colors[k % len(colors)])


PATTERNS: dict[str, Pattern] = {
    p.__name__: p
    for p in (rings, uprights, dots, checks, zigzag, sprigs, hills, dipped, speckled, hearts, word, diamonds, flags)
}
"""All patterns by name."""
