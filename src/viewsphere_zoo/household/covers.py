"""Jackets of books, drawn as one picture: back, spine and front, side by side."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from viewsphere.assets.mesh import Image
from viewsphere_zoo.household.canvas import Canvas, blank, disc, leaf, line, polygon, rect
from viewsphere_zoo.household.lettering import body_text, fitted, write
from viewsphere_zoo.household.prints import INK, barcode
from viewsphere_zoo.shapes.paint import Color
from viewsphere_zoo.townscape.surfaces import waves

TITLES = (
    "THE LAST RIVER", "NIGHT TRAIN", "SALT AND STONE", "A QUIET SEA", "THE GARDEN", "WINTER LIGHT", "ATLAS OF TREES", "NORTH",
    "THE CLOCKMAKER", "OUR HOUSE", "GOOD BREAD", "PHYSICS", "THE FOX", "LETTERS HOME", "ISLANDS", "THE MAP", "COOKING",
    "ALGEBRA", "BLUE HOUR", "THE ORCHARD", "HISTORY OF ROME", "THE MOON", "SMALL BIRDS", "DUST",
)  # fmt: skip
AUTHORS = (
    "A. WALDEN",
    "M. ORTEGA",
    "J. LINDQVIST",
    "C. MOREAU",
    "T. OKAFOR",
    "E. HARTLEY",
    "S. NAKATA",
    "P. ROSSI",
    "L. BRANDT",
)

Art = Callable[[Canvas, float, float, float, float, tuple[Color, Color, Color], np.random.Generator], None]
"""Paints a picture into the field from (x, y) of this width and height."""


def _scene(
    c: Canvas, x: float, y: float, w: float, h: float, colors: tuple[Color, Color, Color], rng: np.random.Generator
) -> None:
    """A sun over hills."""
    c.paint(disc(c, x + rng.uniform(0.3, 0.7) * w, y + 0.62 * h, 0.16 * w), colors[2])
    for k in range(3):
        swell = 0.06 * h * np.sin((c.x - x) / w * rng.uniform(4, 9) + rng.uniform(0, 6))
        tone = np.asarray(colors[1]) * (1 - 0.25 * k)
        c.paint(c.y - (y + h * (0.5 - 0.14 * k) + swell), tone)


def _moon(
    c: Canvas, x: float, y: float, w: float, h: float, colors: tuple[Color, Color, Color], rng: np.random.Generator
) -> None:
    """A crescent among stars."""
    cx, cy, r = x + w / 2, y + 0.52 * h, 0.24 * w
    c.paint(np.maximum(disc(c, cx, cy, r), -disc(c, cx + 0.45 * r, cy + 0.2 * r, 0.85 * r)), colors[2])
    for _ in range(26):
        c.paint(disc(c, x + rng.uniform(0.06, 0.94) * w, y + rng.uniform(0.05, 0.95) * h, 0.008 * w), colors[2])


def _tree(
    c: Canvas, x: float, y: float, w: float, h: float, colors: tuple[Color, Color, Color], rng: np.random.Generator
) -> None:
    """A tree of single leaves."""
    foot = (x + w / 2, y + 0.1 * h)
    for a in np.linspace(0.5, 2.64, 7):
        tip = (foot[0] + 0.34 * w * np.cos(a), y + 0.36 * h + 0.3 * w * np.sin(a))
        c.paint(line(c, [foot, (foot[0], y + 0.36 * h), tip], 0.018 * w), colors[1])
        for _ in range(6):
            at = rng.normal(tip, 0.07 * w)
            c.paint(leaf(c, at[0], at[1], 0.11 * w, 0.05 * w, rng.uniform(0, 6.3)), colors[1 + int(rng.integers(2))])


def _circles(
    c: Canvas, x: float, y: float, w: float, h: float, colors: tuple[Color, Color, Color], rng: np.random.Generator
) -> None:
    """Discs that overlap."""
    for k in range(7):
        spot = x + rng.uniform(0.2, 0.8) * w, y + rng.uniform(0.2, 0.8) * h
        c.paint(disc(c, *spot, rng.uniform(0.06, 0.2) * w), colors[1 + k % 2], 0.75)


def _stripes(
    c: Canvas, x: float, y: float, w: float, h: float, colors: tuple[Color, Color, Color], rng: np.random.Generator
) -> None:
    """Slanting bands."""
    step, lean = rng.uniform(0.1, 0.22) * w, rng.uniform(-1, 1)
    inside = rect(c, (x, y), (x + w, y + h))
    for k in range(2):
        c.paint(
            np.maximum(np.abs((c.x + lean * c.y + k * step / 2) % step - step / 2) - step / (5 + 5 * k), inside), colors[1 + k]
        )


def _peaks(
    c: Canvas, x: float, y: float, w: float, h: float, colors: tuple[Color, Color, Color], rng: np.random.Generator
) -> None:
    """Triangles, one in front of the other."""
    for k in range(5):
        half, top, at = rng.uniform(0.2, 0.4) * w, rng.uniform(0.4, 0.9) * h, x + (0.15 + 0.17 * k) * w
        low, high = max(at - half, x), min(at + half, x + w)
        c.paint(polygon(c, [(low, y + 0.08 * h), (high, y + 0.08 * h), (at, y + top)]), colors[1 + k % 2], 0.85)


ARTS: dict[str, Art] = {
    "scene": _scene, "moon": _moon, "tree": _tree, "circles": _circles, "stripes": _stripes, "peaks": _peaks,
}  # fmt: skip


def jacket(
    size: tuple[float, float, float],
    title: str,
    author: str,
    art: str,
    colors: tuple[Color, Color, Color],
    rng: np.random.Generator,
) -> Image:
    """The jacket of a book of this width, height and thickness, metres; colours of ground, picture, letters."""
    w, h, t = size
    c = blank(2 * w + t, h, colors[0])
    front = w + t
    field = c.window((front + 0.06 * w, 0.12 * h), (front + 0.94 * w, 0.66 * h))
    if field.x.size:
        ARTS[art](field, front + 0.06 * w, 0.12 * h, 0.88 * w, 0.54 * h, colors, rng)
    _front(c, front, w, h, title, author, colors)
    _spine(c, w, t, h, title, author, colors)
    _back(c, w, h, colors, rng)
    grain = waves(rng, np.stack([c.x, c.y], axis=-1).reshape(-1, 2), 0.05).reshape(c.x.shape)
    c.shade(1 + 0.02 * grain)
    return c.image("jacket")


def _front(c: Canvas, x: float, w: float, h: float, title: str, author: str, colors: tuple[Color, Color, Color]) -> None:
    words = title.split()
    rows = (
        [title]
        if len(title) < 9 or len(words) == 1
        else [" ".join(words[: len(words) // 2]), " ".join(words[len(words) // 2 :])]
    )
    size = min(fitted(row, 0.1 * h, 0.84 * w) for row in rows)
    for k, row in enumerate(rows):
        write(c, row, x + w / 2, 0.9 * h - size * (0.5 + 1.4 * k), size, colors[2])
    write(c, author, x + w / 2, 0.06 * h, fitted(author, 0.035 * h, 0.6 * w), colors[2])


def _spine(c: Canvas, x: float, t: float, h: float, title: str, author: str, colors: tuple[Color, Color, Color]) -> None:
    """The title from the top down, between bars."""
    for low in (0.045, 0.93):
        c.paint(rect(c, (x, low * h), (x + t, (low + 0.025) * h)), colors[1])
    if t > 0.008:
        size = fitted(title, 0.55 * t, 0.6 * h)
        _downwards(c, title, x + t / 2, 0.58 * h, size, colors[2])
        _downwards(c, author, x + t / 2, 0.18 * h, fitted(author, 0.32 * t, 0.18 * h), colors[2])


def _downwards(c: Canvas, text: str, x: float, y: float, size: float, color: Color) -> None:
    """Write a word from top to bottom, rotated by a quarter turn clockwise, on the same pixels."""
    turned = Canvas(c.rgb, -c.y, c.x, c.pixel)
    side = Canvas(turned.rgb.transpose(1, 0, 2), turned.x.T, turned.y.T, c.pixel)
    flipped = Canvas(side.rgb[::-1], side.x[::-1], side.y[::-1], c.pixel)
    write(flipped, text, -y, x, size, color)


def _back(c: Canvas, w: float, h: float, colors: tuple[Color, Color, Color], rng: np.random.Generator) -> None:
    body_text(c, (0.12 * w, 0.45 * h), (0.88 * w, 0.85 * h), 13, colors[2], rng.uniform(0.7, 1.0, 13))
    barcode(c, (0.58 * w, 0.07 * h), (0.88 * w, 0.19 * h), rng)


def spread(width: float, height: float, rng: np.random.Generator) -> Image:
    """Two open pages of print, with a heading and a picture or two."""
    c = blank(2 * width, height, (0.94, 0.92, 0.86))
    c.shade(1 - 0.3 * np.exp(-np.abs(c.x - width) / (0.05 * width)))
    for k in range(2):
        x = k * width
        low, high = (x + 0.13 * width, 0.1 * height), (x + 0.87 * width, 0.88 * height)
        if rng.random() < 0.45:
            top = high[1] - 0.34 * height
            tone = rng.uniform(0.25, 0.75, 3)
            frame = c.window((low[0], top + 0.03 * height), high)
            frame.paint(rect(frame, (low[0], top + 0.03 * height), high), tone)
            _scene(frame, low[0], top, high[0] - low[0], 0.34 * height, ((0, 0, 0), (0.3, 0.42, 0.3), (0.95, 0.85, 0.5)), rng)
            high = (high[0], top)
        elif rng.random() < 0.6:
            word = str(TITLES[int(rng.integers(len(TITLES)))])
            write(c, word, x + width / 2, 0.84 * height, fitted(word, 0.035 * height, 0.6 * width), INK)
            high = (high[0], 0.78 * height)
        lines = int((high[1] - low[1]) / 0.0065)
        body_text(c, low, high, lines, (0.25, 0.24, 0.23), np.where(rng.random(lines) < 0.14, 0.5, 1.0), 0.42)
    return c.image("spread")


def leaves_of_paper(rng: np.random.Generator, color: Color = (0.91, 0.88, 0.8)) -> Image:
    """The edge of a block of pages: fine lines along it."""
    rows = rng.uniform(0.86, 1.0, (128, 1)) * (1 - 0.06 * (np.arange(128)[:, None] % 9 == 0))
    shade = rows * (1 + 0.015 * rng.standard_normal((128, 64)))
    pixels = np.full((128, 64, 4), 255, np.uint8)
    pixels[..., :3] = np.clip(np.asarray(color) * shade[..., None] * 255, 0, 255).astype(np.uint8)
    return Image("pages", pixels)
