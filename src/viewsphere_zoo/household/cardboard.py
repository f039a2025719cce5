"""Cardboard with prints and labels: arrows, a glass, words, hand holes, address labels."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from viewsphere.assets.mesh import Image
from viewsphere_zoo.household.canvas import Canvas, blank, disc, polygon, rect
from viewsphere_zoo.household.draws import pick
from viewsphere_zoo.household.lettering import body_text, fitted, write
from viewsphere_zoo.household.prints import INK, barcode
from viewsphere_zoo.shapes.paint import Color
from viewsphere_zoo.townscape.textures import noise, painted

Mark = Callable[[Canvas, float, float, float, Color], None]
"""Paints a sign about a point: its height in metres, its ink."""

WORDS = ("FRAGILE", "THIS SIDE UP", "HANDLE WITH CARE", "BOOKS", "KITCHEN", "OFFICE", "HOME GOODS", "KEEP DRY", "HEAVY", "TOYS")
SHOES = ("SHOES", "SIZE 42", "RUN", "SIZE 38", "BOOTS", "STEP")


def kraft(rng: np.random.Generator, color: Color) -> Image:
    """A tile of cardboard: fibres and faint flutes."""
    flutes = np.sin(np.arange(256) / 256 * 2 * np.pi * 32)[None, :]
    shade = 1 + 0.02 * noise(rng, 256, 1.0, 3.0) + 0.02 * noise(rng, 256, 12) + 0.008 * flutes
    return painted("kraft", color, shade)


def arrows(c: Canvas, x: float, y: float, size: float, ink: Color) -> None:
    """Two arrows that point up, on a line."""
    for dx in (-0.32 * size, 0.32 * size):
        c.paint(rect(c, (x + dx - 0.09 * size, y - 0.34 * size), (x + dx + 0.09 * size, y + 0.1 * size)), ink)
        head = [(x + dx - 0.25 * size, y + 0.08 * size), (x + dx + 0.25 * size, y + 0.08 * size), (x + dx, y + 0.5 * size)]
        c.paint(polygon(c, head), ink)
    c.paint(rect(c, (x - 0.6 * size, y - 0.5 * size), (x + 0.6 * size, y - 0.42 * size)), ink)


def glass(c: Canvas, x: float, y: float, size: float, ink: Color) -> None:
    """A wine glass."""
    c.paint(np.maximum(disc(c, x, y + 0.26 * size, 0.27 * size), c.y - (y + 0.45 * size)), ink)
    c.paint(rect(c, (x - 0.035 * size, y - 0.45 * size), (x + 0.035 * size, y + 0.05 * size)), ink)
    c.paint(rect(c, (x - 0.22 * size, y - 0.5 * size), (x + 0.22 * size, y - 0.44 * size)), ink)


def umbrella(c: Canvas, x: float, y: float, size: float, ink: Color) -> None:
    """An umbrella."""
    c.paint(np.maximum(disc(c, x, y, 0.48 * size), y - c.y), ink)
    c.paint(rect(c, (x - 0.03 * size, y - 0.48 * size), (x + 0.03 * size, y + 0.1 * size)), ink)
    c.paint(
        np.maximum(np.abs(disc(c, x + 0.09 * size, y - 0.45 * size, 0.09 * size)) - 0.03 * size, c.y - y + 0.45 * size), ink
    )


MARKS: tuple[Mark, ...] = (arrows, glass, umbrella)


def walls(
    size: tuple[float, float, float], color: Color, ink: Color, holes: bool, words: Sequence[str], rng: np.random.Generator
) -> Image:
    """The four sides of a box of this width, depth and height, from the front's left edge around to the right."""
    w, d, h = size
    c = blank(2 * (w + d), h, color)
    fibre = noise(rng, 512, 1.0, 3.0)
    c.shade(1 + 0.025 * fibre[: c.x.shape[0], : c.x.shape[1]])
    for start, width in ((0.0, w), (w, d), (w + d, w), (2 * w + d, d)):
        c.paint(np.abs(c.x - start) - 0.0012, np.asarray(color) * 0.8)
        field = c.window((start, 0), (start + width, h))
        _side(field, start, width, h, ink, holes and width == d and w != d, words, rng)
    return c.image("walls")


def _side(
    c: Canvas, x: float, w: float, h: float, ink: Color, hole: bool, words: Sequence[str], rng: np.random.Generator
) -> None:
    """Paint one side: a word, signs in a corner, small print, a hand hole."""
    if hole:
        half = min(0.045, 0.25 * w)
        c.paint(rect(c, (x + w / 2 - half, 0.74 * h), (x + w / 2 + half, 0.74 * h + 0.028), 0.013), (0.07, 0.06, 0.05))
    if rng.random() < 0.6:
        word = pick(rng, words)
        write(c, word, x + w / 2, (0.55 if h > 0.15 else 0.4) * h, fitted(word, min(0.16 * h, 0.045), 0.74 * w), ink, 0.2)
    size = min(0.22 * h, 0.16 * w, 0.06)
    for k in range(int(rng.integers(1, 4))):
        MARKS[k](c, x + w - (0.85 + 1.25 * k) * size, 0.06 * h + 0.6 * size, size, ink)
    if rng.random() < 0.5:
        body_text(c, (x + 0.06 * w, 0.07 * h), (x + 0.3 * w, 0.07 * h + 0.03), 4, ink, rng.uniform(0.5, 1, 4))


def address(width: float, height: float, rng: np.random.Generator) -> Image:
    """A label of a parcel service: sender, receiver, a large code."""
    c = blank(width, height, (0.95, 0.95, 0.94), 320)
    c.paint(np.abs(rect(c, (0.03 * width, 0.03 * height), (0.97 * width, 0.97 * height))) - 0.0006, INK)
    for y in (0.42, 0.74):
        c.paint(np.abs(c.y - y * height) - 0.0006, INK)
    body_text(c, (0.07 * width, 0.77 * height), (0.45 * width, 0.94 * height), 4, INK, rng.uniform(0.5, 1, 4))
    write(c, pick(rng, ("PRIO", "ECO", "24 H", "STD")), 0.74 * width, 0.855 * height, 0.1 * height, INK, 0.22)
    body_text(c, (0.2 * width, 0.46 * height), (0.8 * width, 0.71 * height), 4, INK, rng.uniform(0.6, 1, 4), 0.55)
    barcode(c, (0.08 * width, 0.05 * height), (0.92 * width, 0.4 * height), rng)
    return c.image("address")
