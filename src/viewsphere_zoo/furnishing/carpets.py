"""Patterns of rugs, drawn by code: one picture for a whole rug, (H, W, 4) uint8 sRGB."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Image
from viewsphere_zoo.shapes.paint import Color
from viewsphere_zoo.townscape.textures import Float, noise, painted

Design = Literal["medallion", "stripes", "diamonds", "trellis", "shapes", "rings", "border"]
Colors = tuple[Color, Color, Color, Color]
SIZE = 512


def carpet(rng: np.random.Generator, design: Design, colors: Colors, ratio: float) -> Image:
    """The design in its ground colour and three others; ratio: length across the picture over its height, >= 1."""
    at = (np.arange(SIZE) + 0.5) / SIZE
    u, v = np.meshgrid((at - 0.5) * 2 * ratio, (at - 0.5) * 2)
    which = _DESIGNS[design](rng, u, v, ratio)
    rgb = np.asarray(colors)[np.clip(which, 0, 3).astype(np.int64)]
    tufts = 1 + 0.07 * noise(rng, SIZE, 0.8) + 0.035 * noise(rng, SIZE, 22)
    return painted(f"carpet_{design}", rgb, tufts)


def _framed(u: Float, v: Float, ratio: float, field: Float) -> Float:
    """The field within a broad border of crosses between two lines."""
    edge = np.minimum(ratio - np.abs(u), 1 - np.abs(v))
    along = np.where(ratio - np.abs(u) < 1 - np.abs(v), v, u)
    cell = (along * 5) % 1 - 0.5
    across = (edge - 0.17) / 0.2
    blossom = np.where(np.abs(cell) + np.abs(across) < 0.36, 3, np.where(np.abs(cell) + np.abs(across) < 0.5, 0, 1))
    which = np.where(edge > 0.3, field, blossom)
    for low, high, color in ((0.0, 0.04, 2), (0.04, 0.06, 3), (0.27, 0.285, 3), (0.285, 0.305, 2)):
        which = np.where((edge >= low) & (edge < high), color, which)
    return which


def _medallion(rng: np.random.Generator, u: Float, v: Float, ratio: float) -> Float:
    """A lobed medallion, quarter medallions in the corners, sprigs between them, a border."""
    lobes = int(rng.choice((8, 12, 16)))

    def rosette(x: Float, y: Float, size: float) -> Float:
        r, a = np.hypot(x / 1.25, y) / size, np.arctan2(y, x / 1.25)
        return r * (1 + 0.1 * np.cos(lobes * a))

    mid = rosette(u, v, 0.55)
    corner = rosette(np.abs(u) - ratio + 0.3, np.abs(v) - 0.7, 0.42)
    sprig = np.hypot((u * 4) % 1 - 0.5, (v * 4 + np.floor(u * 4) % 2 / 2) % 1 - 0.5)
    field = np.where(sprig < 0.12, 3, np.where(sprig < 0.2, 2, 0)).astype(np.float64)
    for shape in (mid, corner):
        for limit, color in ((1.0, 2), (0.93, 1), (0.62, 3), (0.55, 2), (0.28, 0), (0.18, 3)):
            field = np.where(shape < limit, color, field)
    return _framed(u, v, ratio, field)


def _stripes(rng: np.random.Generator, u: Float, _v: Float, ratio: float) -> Float:
    """Bands of different widths across the rug."""
    edges = np.cumsum(rng.uniform(0.06, 0.28, 60)) - ratio - 0.1
    kinds = rng.integers(0, 4, 61)
    return kinds[np.searchsorted(edges, u)].astype(np.float64)


def _diamonds(rng: np.random.Generator, u: Float, v: Float, ratio: float) -> Float:
    """Stepped diamonds in a row, in a border."""
    count = max(2, round(2 * ratio / 0.9))
    cell = (u / (2 * ratio) * count + 0.5 * (count % 2)) % 1 - 0.5
    steps = np.round(np.abs(cell) * 14) / 14 * 2.2 + np.round(np.abs(v) * 10) / 10
    return _framed(u, v, ratio, np.floor(np.clip(steps * 4.2, 0, 3.99)))


def _trellis(rng: np.random.Generator, u: Float, v: Float, ratio: float) -> Float:
    """A net of dark lines on a light ground, as Berber rugs have."""
    n = float(rng.uniform(1.6, 2.6))
    a, b = np.abs(((u + v) * n) % 1 - 0.5), np.abs(((u - v) * n) % 1 - 0.5)
    lines = np.where(np.minimum(a, b) < 0.055, 2, 0)
    return np.where(np.maximum(0.5 - a, 0.5 - b) < 0.1, 1, lines).astype(np.float64)


def _shapes(rng: np.random.Generator, u: Float, v: Float, ratio: float) -> Float:
    """Large overlapping discs and slanting fields."""
    which = np.zeros_like(u)
    for k in range(7):
        cx, cy, r = rng.uniform(-ratio, ratio), rng.uniform(-1, 1), rng.uniform(0.35, 0.8)
        turn = rng.uniform(0, np.pi)
        disc = np.hypot(u - cx, v - cy) < r
        half = (u - cx) * np.cos(turn) + (v - cy) * np.sin(turn) > 0
        which = np.where(disc & half if k % 2 else disc, 1 + k % 3, which)
    return which


def _rings(rng: np.random.Generator, u: Float, v: Float, ratio: float) -> Float:
    """Rings about the middle, as braided rugs have."""
    r = np.hypot(u / ratio, v) + 0.012 * np.sin(60 * np.arctan2(v, u))
    return rng.integers(0, 4, 40)[np.clip((r * 24).astype(np.int64), 0, 39)].astype(np.float64)


def _border(rng: np.random.Generator, u: Float, v: Float, ratio: float) -> Float:
    """A plain field with two lines along its border and a key pattern between them."""
    edge = np.minimum(ratio - np.abs(u), 1 - np.abs(v))
    along = np.where(ratio - np.abs(u) < 1 - np.abs(v), v, u)
    key = np.where(((along * 6) % 1 < 0.5) ^ (edge < 0.17), 1, 0)
    return np.where(edge < 0.06, 2, np.where(edge < 0.1, 0, np.where(edge < 0.24, key, np.where(edge < 0.28, 2, 0)))).astype(
        np.float64
    )


_DESIGNS: dict[Design, Callable[[np.random.Generator, Float, Float, float], Float]] = {
    "medallion": _medallion,
    "stripes": _stripes,
    "diamonds": _diamonds,
    "trellis": _trellis,
    "shapes": _shapes,
    "rings": _rings,
    "border": _border,
}
