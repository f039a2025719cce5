"""The pictures on televisions: drawn by code, (H, W, 4) uint8 sRGB."""

from __future__ import annotations

from typing import Literal

import numpy as np

from viewsphere.assets.mesh import Image
from viewsphere_zoo.townscape.textures import Float

Show = Literal["hills", "football", "news", "sunset", "cartoon"]
SIZE = (180, 320)


def broadcast(rng: np.random.Generator, show: Show) -> Image:
    """One frame of a show."""
    high, wide = SIZE
    x, y = np.meshgrid((np.arange(wide) + 0.5) / wide, (np.arange(high) + 0.5) / high)
    rgb = np.clip(_SHOWS[show](rng, x, y), 0, 1)
    pixels = np.full((*SIZE, 4), 255, np.uint8)
    pixels[..., :3] = (rgb * 255 + 0.5).astype(np.uint8)
    return Image(f"show_{show}", pixels)


def _mixed(low: tuple[float, float, float], high: tuple[float, float, float], share: Float) -> Float:
    return np.array(low) + (np.array(high) - np.array(low)) * np.clip(share, 0, 1)[..., None]


def _over(picture: Float, mask: Float, color: tuple[float, float, float]) -> Float:
    """The picture with this colour where the mask is above 0, its edge soft over one pixel."""
    share = np.clip(mask * SIZE[0], 0, 1)[..., None]
    return picture * (1 - share) + np.array(color) * share


def _disc(x: Float, y: Float, at: tuple[float, float], radius: float) -> Float:
    return radius - np.hypot((x - at[0]) * SIZE[1] / SIZE[0], y - at[1])


def _box(x: Float, y: Float, low: tuple[float, float], high: tuple[float, float]) -> Float:
    return np.minimum(np.minimum(x - low[0], high[0] - x), np.minimum(y - low[1], high[1] - y))


def _hills(rng: np.random.Generator, x: Float, y: Float) -> Float:
    """Blue hills behind each other under a morning sky."""
    picture = _mixed((0.25, 0.5, 0.85), (0.85, 0.9, 0.95), y * 1.6)
    for k in range(5):
        a, b = rng.uniform(0, 6, 2)
        ridge = 0.4 + 0.11 * k + 0.05 * np.sin(5 * x + a) + 0.025 * np.sin(13 * x + b)
        picture = _over(picture, y - ridge, (0.35 - 0.06 * k, 0.55 - 0.04 * k, 0.5 - 0.09 * k))
    return picture


def _football(rng: np.random.Generator, x: Float, y: Float) -> Float:
    """A pitch seen from the stand, players of two teams, the score."""
    stripes = np.sign(np.sin(30 * (x + 0.3 * y)))
    picture = _mixed((0.12, 0.5, 0.14), (0.17, 0.6, 0.18), 0.5 + 0.5 * stripes)
    picture = _over(picture, 0.2 - y, (0.3, 0.3, 0.38))
    for line in (
        0.004 - np.abs(y - 0.24),
        0.003 - np.abs(x - 0.5 - 0.2 * (y - 0.5)),
        0.004 - np.abs(np.hypot((x - 0.5) * 2, (y - 0.6) * 2) - 0.3),
    ):
        picture = _over(picture, np.where(y > 0.2, line, -1), (0.9, 0.95, 0.9))
    for k in range(14):
        px, py = rng.uniform(0.08, 0.92), rng.uniform(0.32, 0.95)
        kit = (0.85, 0.1, 0.12) if k % 2 else (0.95, 0.95, 0.98)
        picture = _over(picture, _box(x, y, (px - 0.009, py - 0.05), (px + 0.009, py)), kit)
        picture = _over(picture, _disc(x, y, (px, py - 0.06), 0.014), (0.6, 0.42, 0.3))
    return _over(picture, _box(x, y, (0.05, 0.05), (0.32, 0.12)), (0.08, 0.1, 0.3))


def _news(rng: np.random.Generator, x: Float, y: Float) -> Float:
    """A newsreader at a desk in front of a map, with a red band of text."""
    picture = _mixed((0.05, 0.1, 0.35), (0.15, 0.35, 0.7), 1 - np.hypot(x - 0.65, y - 0.4))
    for _ in range(7):
        at, r = rng.uniform((0.45, 0.1), (0.95, 0.55)), rng.uniform(0.03, 0.12)
        picture = _over(picture, _disc(x, y, (float(at[0]), float(at[1])), float(r)), (0.25, 0.5, 0.8))
    suit = (float(rng.uniform(0.1, 0.5)), 0.12, float(rng.uniform(0.1, 0.4)))
    picture = _over(picture, _disc(x, y, (0.3, 0.8), 0.3), suit)
    picture = _over(picture, np.minimum(_disc(x, y, (0.3, 0.62), 0.12), y - 0.5), (0.95, 0.95, 0.95))
    picture = _over(picture, _disc(x, y, (0.3, 0.34), 0.15), (0.25, 0.16, 0.1))
    picture = _over(picture, _disc(x, y, (0.3, 0.38), 0.125), (0.85, 0.64, 0.5))
    picture = _over(picture, _box(x, y, (0, 0.8), (1, 0.93)), (0.75, 0.08, 0.1))
    text = np.where(np.sin(150 * x) + np.sin(67 * x + 1) > 0.2, _box(x, y, (0.05, 0.84), (0.8, 0.89)), -1)
    return _over(picture, text, (1, 1, 1))


def _sunset(rng: np.random.Generator, x: Float, y: Float) -> Float:
    """A sunset over the sea, in a film's wide format."""
    picture = _mixed((0.25, 0.15, 0.4), (1.0, 0.6, 0.25), y * 1.9)
    picture = _over(picture, _disc(x, y, (float(rng.uniform(0.3, 0.7)), 0.5), 0.14), (1, 0.9, 0.5))
    sea = (
        _mixed((0.85, 0.45, 0.25), (0.1, 0.08, 0.2), (y - 0.56) * 2.5)
        * (1 + 0.2 * np.sin(90 * y + 8 * np.sin(9 * x)))[..., None]
    )
    picture = np.where((y > 0.56)[..., None], sea, picture)
    return np.where((np.abs(y - 0.5) > 0.4)[..., None], 0.0, picture)


def _cartoon(rng: np.random.Generator, x: Float, y: Float) -> Float:
    """A round yellow face in a meadow."""
    picture = _over(_mixed((0.4, 0.8, 1), (0.7, 0.95, 1), y), y - 0.72 - 0.04 * np.sin(7 * x), (0.35, 0.8, 0.3))
    cx = float(rng.uniform(0.35, 0.65))
    picture = _over(picture, _disc(x, y, (cx, 0.5), 0.3), (1, 0.85, 0.15))
    for side in (-1, 1):
        picture = _over(picture, _disc(x, y, (cx + 0.06 * side, 0.42), 0.06), (1, 1, 1))
        picture = _over(picture, _disc(x, y, (cx + 0.06 * side + 0.01, 0.43), 0.03), (0.05, 0.05, 0.1))
    return _over(picture, np.minimum(_disc(x, y, (cx, 0.55), 0.15), y - 0.58), (0.75, 0.12, 0.15))


_SHOWS = {"hills": _hills, "football": _football, "news": _news, "sunset": _sunset, "cartoon": _cartoon}
