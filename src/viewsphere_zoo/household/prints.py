"""Labels of goods without real brands: a ground, a picture, words for the contents, small print and a barcode."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from viewsphere_zoo.household.canvas import Canvas, disc, ellipse, leaf, line, polygon, rect
from viewsphere_zoo.household.lettering import body_text, fitted, write
from viewsphere_zoo.household.patterns import extent
from viewsphere_zoo.shapes.paint import Color

INK: Color = (0.12, 0.11, 0.12)
PAPER: Color = (0.93, 0.92, 0.88)


@dataclass(frozen=True)
class Label:
    """The content of a label: its words, one of `PICTURES` and one of `GROUNDS`; colours of ground, decoration, letters."""

    title: str
    line: str
    picture: str
    ground: str
    colors: tuple[Color, Color, Color]


def wrapper(c: Canvas, label: Label, rng: np.random.Generator) -> None:
    """A label all around: its face in front and behind, small print and a barcode between."""
    w, h = extent(c)
    GROUNDS[label.ground](c, label.colors, rng)
    for k in range(2):
        face(c, label, 0.5 * w * k, rng)
    small(c, (0.23 * w, 0.12 * h), (0.32 * w, 0.88 * h), label.colors[2], rng)
    barcode(c, (0.7 * w, 0.12 * h), (0.78 * w, min(0.12 * h + 0.09 * w, 0.88 * h)), rng)


def face(c: Canvas, label: Label, x: float, rng: np.random.Generator) -> None:
    """Picture and words around a line x; shapes that leave the canvas at one side enter at the other."""
    w, h = extent(c)
    for at in (x, x + w):
        if at <= w:
            size = min(0.27 * h, 0.13 * w)
            if label.picture:
                part = c.window((at - 2 * size, 0.33 * h - 2 * size), (at + 2 * size, 0.33 * h + 2 * size))
                PICTURES[label.picture](part, at, 0.33 * h, size, rng.spawn(1)[0])
            title = fitted(label.title, 0.2 * h, 0.31 * w)
            write(c, label.title, at, (0.72 if label.picture else 0.56) * h, title, label.colors[2])
            if label.line:
                below = (0.72 if label.picture else 0.56) * h - title * 0.95
                write(c, label.line, at, below, fitted(label.line, 0.35 * title, 0.3 * w), label.colors[2], 0.14)


def small(c: Canvas, low: tuple[float, float], high: tuple[float, float], color: Color, rng: np.random.Generator) -> None:
    """Small print."""
    lines = max(int((high[1] - low[1]) / 0.0035), 4)
    body_text(c, low, high, lines, color, rng.uniform(0.6, 1.0, lines))


def barcode(c: Canvas, low: tuple[float, float], high: tuple[float, float], rng: np.random.Generator) -> None:
    """Bars on white."""
    part = c.window(low, high)
    part.paint(rect(part, low, high), (0.96, 0.96, 0.95))
    count = 34
    bars = rng.random(count) < 0.5
    inner = part.window(
        (low[0] + 0.08 * (high[0] - low[0]), low[1] + 0.2 * (high[1] - low[1])),
        (high[0] - 0.08 * (high[0] - low[0]), high[1] - 0.1 * (high[1] - low[1])),
    )
    if inner.x.size:
        k = ((inner.x - inner.x.min()) / max(float(np.ptp(inner.x)), 1e-9) * (count - 1)).astype(int)
        inner.paint(np.where(bars[k], -1.0, 1.0), INK)


def _plain(c: Canvas, colors: Sequence[Color], rng: np.random.Generator) -> None:
    c.rgb[:] = colors[0]


def _edged(c: Canvas, colors: Sequence[Color], rng: np.random.Generator) -> None:
    """Bands along the upper and lower edge, and a fine line."""
    _, h = extent(c)
    c.rgb[:] = colors[0]
    c.paint(0.4 * h - np.abs(c.y - h / 2), colors[1])
    c.paint(np.abs(np.abs(c.y - h / 2) - 0.37 * h) - 0.006 * h, colors[1])


def _wave(c: Canvas, colors: Sequence[Color], rng: np.random.Generator) -> None:
    """A swinging band."""
    w, h = extent(c)
    c.rgb[:] = colors[0]
    swing = h * (0.3 + 0.12 * np.sin(4 * np.pi * c.x / w + rng.uniform(0, 6.3)))
    c.paint(c.y - swing, colors[1])
    c.paint(np.abs(c.y - swing - 0.05 * h) - 0.012 * h, colors[1])


def _slant(c: Canvas, colors: Sequence[Color], rng: np.random.Generator) -> None:
    """Slanting stripes around a plain field."""
    w, h = extent(c)
    c.rgb[:] = colors[0]
    step = w / int(rng.integers(10, 18))
    stripes = np.abs((c.x + 0.6 * c.y) % step - step / 2) - step / 4
    c.paint(np.maximum(stripes, 0.3 * h - np.abs(c.y - 0.5 * h)), colors[1])


def _split(c: Canvas, colors: Sequence[Color], rng: np.random.Generator) -> None:
    """Two halves, one above the other."""
    _, h = extent(c)
    c.rgb[:] = colors[0]
    c.paint(c.y - 0.48 * h, colors[1])


def _halo(c: Canvas, colors: Sequence[Color], rng: np.random.Generator) -> None:
    """A large oval behind the words, twice."""
    w, h = extent(c)
    c.rgb[:] = colors[1]
    for x in (0.0, 0.5 * w, w):
        c.paint(ellipse(c, x, 0.55 * h, (0.21 * w, 0.42 * h)), colors[0])
        c.paint(np.abs(ellipse(c, x, 0.55 * h, (0.2 * w, 0.4 * h))) - 0.004 * w, colors[1])


def _fade(c: Canvas, colors: Sequence[Color], rng: np.random.Generator) -> None:
    """One colour into the other."""
    _, h = extent(c)
    share = np.clip(1.2 * c.y / h - 0.1, 0, 1)[..., None]
    c.rgb[:] = np.asarray(colors[0]) * share + np.asarray(colors[1]) * (1 - share)


GROUNDS: dict[str, Callable[[Canvas, Sequence[Color], np.random.Generator], None]] = {
    "plain": _plain, "edged": _edged, "wave": _wave, "slant": _slant, "split": _split, "halo": _halo, "fade": _fade,
}  # fmt: skip


def _ball(color: Color) -> Callable[[Canvas, float, float, float, np.random.Generator], None]:
    """A round fruit with light, a dimple and a leaf."""

    def draw(c: Canvas, x: float, y: float, size: float, rng: np.random.Generator) -> None:
        tone = np.asarray(color)
        for dx, s in ((-0.7, 0.7), (0.75, 0.65), (0.0, 1.0)):
            c.paint(disc(c, x + dx * size, y - 0.1 * (1 - s) * size, s * size), tone * (0.7 + 0.3 * s))
            c.paint(
                disc(c, x + (dx - 0.25 * s) * size, y + 0.3 * s * size, 0.25 * s * size), np.minimum(tone * 1.3 + 0.15, 1), 0.6
            )
        for turn in (0.5, 1.3, 2.4):
            c.paint(leaf(c, x, y + 0.85 * size, 0.8 * size, 0.25 * size, turn), (0.2, 0.45, 0.16))

    return draw


def _slice(color: Color) -> Callable[[Canvas, float, float, float, np.random.Generator], None]:
    """A fruit cut through: rind and segments."""

    def draw(c: Canvas, x: float, y: float, size: float, rng: np.random.Generator) -> None:
        tone = np.asarray(color)
        c.paint(disc(c, x, y, size), tone)
        c.paint(disc(c, x, y, 0.88 * size), (0.97, 0.95, 0.85))
        for k in range(8):
            a, b = k * np.pi / 4 + 0.08, (k + 1) * np.pi / 4 - 0.08
            m = (a + b) / 2
            at = [(0.1, m), (0.76, a), (0.8, m), (0.76, b)]
            c.paint(polygon(c, [(x + r * size * np.cos(t), y + r * size * np.sin(t)) for r, t in at]), 0.3 + 0.7 * tone)
        c.paint(leaf(c, x + 0.6 * size, y + 0.7 * size, 0.9 * size, 0.35 * size, 0.5), (0.25, 0.5, 0.2))

    return draw


def _peas(c: Canvas, x: float, y: float, size: float, rng: np.random.Generator, color: Color = (0.4, 0.62, 0.2)) -> None:
    """A heap of small balls."""
    for row, count in enumerate((6, 5, 4, 2)):
        for k in range(count):
            px, py = x + (k - (count - 1) / 2) * 0.42 * size, y - 0.6 * size + 0.36 * row * size
            c.paint(disc(c, px, py, 0.23 * size), np.asarray(color) * (0.8 + 0.25 * rng.random()))
            c.paint(disc(c, px - 0.07 * size, py + 0.08 * size, 0.06 * size), (0.95, 0.95, 0.85), 0.6)


def _beans(c: Canvas, x: float, y: float, size: float, rng: np.random.Generator) -> None:
    _peas(c, x, y, size, rng, (0.6, 0.2, 0.13))


def _corn(c: Canvas, x: float, y: float, size: float, rng: np.random.Generator) -> None:
    _peas(c, x, y, size, rng, (0.96, 0.76, 0.15))


def _fish(c: Canvas, x: float, y: float, size: float, rng: np.random.Generator) -> None:
    c.paint(leaf(c, x - 1.3 * size, y, 2.2 * size, 0.95 * size, 0.0), (0.3, 0.45, 0.6))
    c.paint(leaf(c, x - 1.2 * size, y - 0.12 * size, 2.0 * size, 0.5 * size, 0.0), (0.8, 0.85, 0.88))
    c.paint(
        polygon(c, [(x + 0.7 * size, y), (x + 1.3 * size, y - 0.55 * size), (x + 1.3 * size, y + 0.55 * size)]),
        (0.3, 0.45, 0.6),
    )
    c.paint(disc(c, x - 0.85 * size, y + 0.1 * size, 0.09 * size), INK)


def _grapes(c: Canvas, x: float, y: float, size: float, rng: np.random.Generator) -> None:
    for row, count in enumerate((1, 2, 3, 4)):
        for k in range(count):
            tone = np.array((0.4, 0.16, 0.36)) * (0.8 + 0.4 * rng.random())
            c.paint(disc(c, x + (k - (count - 1) / 2) * 0.42 * size, y - 0.8 * size + 0.38 * row * size, 0.25 * size), tone)
    c.paint(leaf(c, x, y + 0.5 * size, 0.8 * size, 0.4 * size, 0.6), (0.3, 0.45, 0.2))


def _house(c: Canvas, x: float, y: float, size: float, rng: np.random.Generator) -> None:
    """An engraving of a country house with towers."""
    for low, high in (((-1.1, -0.6), (1.1, 0.1)), ((-1.4, -0.6), (-0.9, 0.4)), ((0.9, -0.6), (1.4, 0.4))):
        c.paint(rect(c, (x + low[0] * size, y + low[1] * size), (x + high[0] * size, y + high[1] * size)), (0.35, 0.3, 0.26))
    for dx, half, rise, foot in ((0, 1.2, 0.5, 0.1), (-1.15, 0.32, 0.6, 0.4), (1.15, 0.32, 0.6, 0.4)):
        a, b = x + (dx - half) * size, x + (dx + half) * size
        c.paint(
            polygon(c, [(a, y + foot * size), (b, y + foot * size), (x + dx * size, y + (foot + rise) * size)]),
            (0.22, 0.2, 0.2),
        )
    for k in range(5):
        c.paint(rect(c, (x + (-0.9 + 0.4 * k) * size, y - 0.4 * size), (x + (-0.72 + 0.4 * k) * size, y - 0.1 * size)), PAPER)
    c.paint(rect(c, (x - 1.7 * size, y - 0.68 * size), (x + 1.7 * size, y - 0.6 * size)), (0.35, 0.3, 0.26))


def _peak(c: Canvas, x: float, y: float, size: float, rng: np.random.Generator) -> None:
    """Snowy mountains."""
    for dx, s, tone in ((-0.9, 0.75, 0.75), (0.9, 0.65, 0.85), (0.0, 1.1, 1.0)):
        top = y + 0.75 * s * size
        foot = y - 0.55 * size
        rise = top - foot
        color = np.array((0.22, 0.42, 0.62)) * tone
        c.paint(polygon(c, [(x + dx * size - rise, foot), (x + dx * size + rise, foot), (x + dx * size, top)]), color)
        snow = [
            (x + dx * size - 0.35 * rise, top - 0.35 * rise),
            (x + dx * size, top - 0.22 * rise),
            (x + dx * size + 0.35 * rise, top - 0.35 * rise),
            (x + dx * size, top),
        ]
        c.paint(polygon(c, snow[:2] + snow[3:]), (0.97, 0.98, 1.0))
        c.paint(polygon(c, [snow[1], snow[2], snow[3]]), (0.97, 0.98, 1.0))


def _drops(c: Canvas, x: float, y: float, size: float, rng: np.random.Generator) -> None:
    for dx, dy, s in ((0.0, 0.0, 1.0), (-0.9, -0.3, 0.55), (0.85, 0.25, 0.5)):
        r, px, py = 0.5 * s * size, x + dx * size, y + (dy - 0.2) * size
        c.paint(disc(c, px, py, r), (0.25, 0.6, 0.88))
        c.paint(
            polygon(c, [(px - 0.9 * r, py + 0.42 * r), (px + 0.9 * r, py + 0.42 * r), (px, py + 2.2 * r)]), (0.25, 0.6, 0.88)
        )
        c.paint(disc(c, px - 0.35 * r, py - 0.1 * r, 0.25 * r), (0.9, 0.97, 1.0), 0.8)


def _wheat(c: Canvas, x: float, y: float, size: float, rng: np.random.Generator) -> None:
    """Two ears of grain, crossed."""
    gold = (0.85, 0.63, 0.2)
    for lean in (-0.5, 0.5):
        along = np.array((np.sin(lean), np.cos(lean)))
        foot = np.array((x, y)) - along * size
        c.paint(line(c, [foot, foot + 2 * size * along], 0.07 * size), gold)
        for k in range(7):
            at = foot + along * size * (0.8 + 0.18 * k)
            for side in (-0.6, 0.6):
                c.paint(leaf(c, at[0], at[1], 0.42 * size, 0.17 * size, np.pi / 2 - lean + side), gold)


def _star(c: Canvas, x: float, y: float, size: float, rng: np.random.Generator) -> None:
    """A star in a ring."""
    c.paint(disc(c, x, y, 1.1 * size), (0.95, 0.93, 0.88))
    c.paint(disc(c, x, y, size), (0.75, 0.15, 0.15))
    for k in range(5):
        a = np.pi / 2 + 2 * np.pi * k / 5
        corners = [(0.85, a), (0.3, a + 2.2), (0.3, a - 2.2)]
        c.paint(polygon(c, [(x + r * size * np.cos(t), y + r * size * np.sin(t)) for r, t in corners]), (0.97, 0.9, 0.6))


def _cow(c: Canvas, x: float, y: float, size: float, rng: np.random.Generator) -> None:
    """A cow's black patches."""
    for dx, dy, a, b in ((-1.0, 0.2, 0.6, 0.4), (0.2, -0.3, 0.7, 0.35), (1.1, 0.3, 0.5, 0.45), (0.1, 0.6, 0.35, 0.22)):
        c.paint(ellipse(c, x + dx * size, y + dy * size, (a * size, b * size), rng.uniform(-0.6, 0.6)), INK)


PICTURES: dict[str, Callable[[Canvas, float, float, float, np.random.Generator], None]] = {
    "tomato": _ball((0.82, 0.14, 0.1)), "peach": _ball((0.95, 0.6, 0.28)), "cherry": _ball((0.6, 0.06, 0.14)),
    "olive": _ball((0.5, 0.55, 0.2)), "orange": _slice((0.96, 0.55, 0.1)), "lemon": _slice((0.95, 0.82, 0.2)),
    "lime": _slice((0.5, 0.7, 0.2)), "peas": _peas, "beans": _beans, "corn": _corn, "fish": _fish, "grapes": _grapes,
    "house": _house, "peak": _peak, "drops": _drops, "wheat": _wheat, "star": _star, "cow": _cow,
}  # fmt: skip
