"""Pictures drawn as code: shapes by their distance functions, smooth at their edges, in metres from the lower left corner."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from viewsphere.assets.mesh import Image
from viewsphere_zoo.shapes.solids import Float


@dataclass(frozen=True, eq=False)
class Canvas:
    """A picture to paint on: rgb (H, W, 3), sRGB 0..1; x, y (H, W), metres; pixel: its side, metres."""

    rgb: Float
    x: Float
    y: Float
    pixel: float

    def paint(self, distance: Float, color: ArrayLike, strength: float = 1.0) -> None:
        """Colour where the signed distance (H, W) to a shape, metres, is negative; edges are a pixel wide."""
        near = distance < 0.5 * self.pixel
        share = strength * np.minimum(0.5 - distance[near] / self.pixel, 1)[:, None]
        self.rgb[near] = self.rgb[near] * (1 - share) + np.asarray(color, np.float64) * share

    def shade(self, factor: Float) -> None:
        """Multiply all colours by factors (H, W)."""
        self.rgb[:] = np.clip(self.rgb * factor[..., None], 0, 1)

    def window(self, low: tuple[float, float], high: tuple[float, float]) -> Canvas:
        """The pixels between two corners as a view of the same memory, so that painting there is quick."""
        rows = np.flatnonzero((self.y[:, 0] > low[1]) & (self.y[:, 0] < high[1]))
        columns = np.flatnonzero((self.x[0] > low[0]) & (self.x[0] < high[0]))
        if not len(rows) or not len(columns):
            return replace(self, rgb=self.rgb[:0, :0], x=self.x[:0, :0], y=self.y[:0, :0])
        at = (slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1))
        return replace(self, rgb=self.rgb[at], x=self.x[at], y=self.y[at])

    def image(self, name: str) -> Image:
        """The picture, opaque, (H, W, 4) uint8."""
        pixels = np.full((*self.rgb.shape[:2], 4), 255, np.uint8)
        pixels[..., :3] = np.clip(self.rgb * 255 + 0.5, 0, 255).astype(np.uint8)
        return Image(name, pixels)


def blank(width: float, height: float, color: ArrayLike, pixels: int = 512) -> Canvas:
    """An empty picture of this size in metres; pixels along its longer side."""
    pixel = max(width, height) / pixels
    columns, rows = max(round(width / pixel), 1), max(round(height / pixel), 1)
    x, y = np.meshgrid((np.arange(columns) + 0.5) * width / columns, (np.arange(rows)[::-1] + 0.5) * height / rows)
    return Canvas(np.broadcast_to(np.asarray(color, np.float64), (rows, columns, 3)).copy(), x, y, pixel)


def disc(c: Canvas, x: float, y: float, radius: float) -> Float:
    """A disc about (x, y)."""
    return np.hypot(c.x - x, c.y - y) - radius


def ellipse(c: Canvas, x: float, y: float, half: tuple[float, float], turn: float = 0.0) -> Float:
    """The approximate distance to an ellipse whose first half axis is turned by this angle, radians."""
    u, v = np.cos(turn) * (c.x - x) + np.sin(turn) * (c.y - y), np.cos(turn) * (c.y - y) - np.sin(turn) * (c.x - x)
    return (np.hypot(u / half[0], v / half[1]) - 1) * min(half)


def rect(c: Canvas, low: tuple[float, float], high: tuple[float, float], rounding: float = 0.0) -> Float:
    """A rectangle between two corners, with rounded corners."""
    dx = np.abs(c.x - (low[0] + high[0]) / 2) - (high[0] - low[0]) / 2 + rounding
    dy = np.abs(c.y - (low[1] + high[1]) / 2) - (high[1] - low[1]) / 2 + rounding
    return np.hypot(np.maximum(dx, 0), np.maximum(dy, 0)) + np.minimum(np.maximum(dx, dy), 0) - rounding


def line(c: Canvas, points: ArrayLike, width: float) -> Float:
    """A stroke with round ends along (N, 2) points."""
    p = np.asarray(points, np.float64)
    best = np.full(c.x.shape, np.inf)
    for (ax, ay), (bx, by) in pairwise(p.tolist()):
        dx, dy = bx - ax, by - ay
        share = np.clip(((c.x - ax) * dx + (c.y - ay) * dy) / max(dx * dx + dy * dy, 1e-18), 0, 1)
        best = np.minimum(best, np.hypot(c.x - ax - share * dx, c.y - ay - share * dy))
    return best - width / 2


def polygon(c: Canvas, corners: ArrayLike) -> Float:
    """A convex counter-clockwise polygon (N, 2)."""
    p = np.asarray(corners, np.float64)
    d = np.roll(p, -1, axis=0) - p
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    return np.max([dy * (c.x - x) - dx * (c.y - y) for (x, y), (dx, dy) in zip(p, d, strict=True)], axis=0)


def leaf(c: Canvas, x: float, y: float, length: float, width: float, turn: float) -> Float:
    """A lens from (x, y) along a direction, radians: the overlap of two discs."""
    r = (length * length / 4 + width * width / 4) / width
    ax, ay = x + np.cos(turn) * length / 2, y + np.sin(turn) * length / 2
    off = r - width / 2
    px, py = -np.sin(turn) * off, np.cos(turn) * off
    return np.maximum(disc(c, ax + px, ay + py, r), disc(c, ax - px, ay - py, r))


def heart(c: Canvas, x: float, y: float, size: float) -> Float:
    """A heart of this height about a point."""
    r = 0.27 * size
    lobes = np.minimum(disc(c, x - 0.93 * r, y + 0.2 * size, r), disc(c, x + 0.93 * r, y + 0.2 * size, r))
    tip = polygon(
        c, [(x, y - 0.5 * size), (x + 1.72 * r, y + 0.02 * size), (x, y + 0.36 * size), (x - 1.72 * r, y + 0.02 * size)]
    )
    return np.minimum(lobes, tip)
