"""Shapes that follow a curved surface: rounded panels, frames around openings, ribbons along a line.

A surface is a function from two arrays (u, v) of one shape (...) to points (..., 3); outside is d/du x d/dv.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from viewsphere_zoo.shapes.solids import Float, Solid, flipped, grid

Surface = Callable[[Float, Float], Float]


def normals(surface: Surface, u: Float, v: Float, step: float = 2e-3) -> Float:
    """Unit normals (..., 3) by central differences."""
    east, west, north, south = surface(np.stack([u + step, u - step, u, u]), np.stack([v, v, v + step, v - step]))
    n = np.cross(east - west, north - south)
    return n / np.linalg.norm(n, axis=-1, keepdims=True)


def raised(surface: Surface, uv: Float, offset: ArrayLike) -> Float:
    """Points (..., 3) at this height above the surface, metres; uv is (..., 2)."""
    u, v = uv[..., 0], uv[..., 1]
    return surface(u, v) + normals(surface, u, v) * np.asarray(offset, np.float64)[..., None]


def rounded_square(rounding: float, count: int, corner: int = 3) -> Float:
    """A counter-clockwise ring of the square [0, 1]^2 with rounded corners: (4 (count + 2 corner), 2)."""
    straight = np.linspace(rounding, 1 - rounding, count, endpoint=False)
    angle = np.linspace(-np.pi / 2, 0, 2 * corner, endpoint=False)
    side = np.concatenate(
        [
            np.stack([straight, np.zeros(count)], axis=1),
            np.stack([1 - rounding + rounding * np.cos(angle), rounding + rounding * np.sin(angle)], axis=1),
        ]
    )
    ring = [side]
    for _ in range(3):
        ring.append(np.stack([1 - ring[-1][:, 1], ring[-1][:, 0]], axis=1))
    return np.concatenate(ring)


def in_quad(corners: ArrayLike, square: Float) -> Float:
    """Bilinear map of the unit square to four corners (lower left, lower right, upper right, upper left)."""
    a, b, c, d = np.asarray(corners, np.float64)
    s, t = square[..., :1], square[..., 1:]
    return (a * (1 - s) + b * s) * (1 - t) + (d * (1 - s) + c * s) * t


def panel(
    surface: Surface,
    corners: ArrayLike,
    height: float = 0.004,
    rounding: float = 0.2,
    count: int = 8,
    depth: float = 0.012,
    rings: int = 3,
    corner: int = 3,
) -> Solid:
    """A rounded plate that follows the surface, `height` above it, with a skirt down to `depth` below."""
    square = rounded_square(rounding, count, corner)
    inward = np.linspace(1, 0, rings + 1)
    center = square.mean(axis=0)
    uv = in_quad(corners, center + (square - center) * inward[:, None, None])
    skirt = raised(surface, uv[:1], height - depth)
    bevel = min(0.3 * depth, 0.004)
    edge = raised(surface, uv[:1], height - bevel)
    points = np.concatenate([skirt, edge, raised(surface, _shrunk(uv, surface, bevel), height)])
    return _closed(points)


def _shrunk(uv: Float, surface: Surface, bevel: float) -> Float:
    """The rings with the outermost drawn in by about `bevel` metres, for a chamfered edge."""
    points = surface(uv[:2, :, 0], uv[:2, :, 1])
    gap = np.linalg.norm(points[1] - points[0], axis=-1, keepdims=True)
    share = np.clip(bevel / np.maximum(gap, 1e-9), 0, 0.4)
    return np.concatenate([uv[:1] + share * (uv[1:2] - uv[:1]), uv[1:]])


def _closed(rings: Float) -> Solid:
    """Skin over counter-clockwise rings that shrink inwards."""
    return flipped(grid(rings, wrap=True))


def frame(
    surface: Surface, cell: ArrayLike, hole: ArrayLike, rounding: float, count: int = 8, rings: int = 2
) -> tuple[Solid, Float]:
    """The surface between a cell's border and a rounded hole, and the hole's ring (N, 2) in (u, v).

    Corners are (4, 2) in (u, v); cells that share a border share its points if their counts agree.
    """
    inner = in_quad(hole, rounded_square(rounding, count))
    outer = in_quad(cell, _snapped(rounded_square(rounding, count)))
    share = np.linspace(0, 1, rings + 1)[:, None, None]
    uv = outer * (1 - share) + inner * share
    return _closed(surface(uv[..., 0], uv[..., 1])), inner


def _snapped(ring: Float) -> Float:
    """Ring points pushed out to the unit square's border."""
    d = ring - 0.5
    return 0.5 + 0.5 * d / np.abs(d).max(axis=1, keepdims=True)


def rim(surface: Surface, ring: Float, heights: tuple[float, float], width: float) -> Solid:
    """A band along a closed (N, 2) ring that falls from one height to another, `width` metres towards its middle."""
    center = ring.mean(axis=0)
    far = np.linalg.norm(surface(ring[:, 0], ring[:, 1]) - surface(*center[:, None]), axis=1)[:, None]
    inner = ring + (center - ring) * width / far
    return _closed(np.stack([raised(surface, ring, heights[0]), raised(surface, inner, heights[1])]))


def ribbon(surface: Surface, line: ArrayLike, width: float, height: float = 0.003) -> Solid:
    """A flat band of this width (metres) along a (N, 2) line in (u, v), `height` above the surface."""
    uv = np.asarray(line, np.float64)
    middle = surface(uv[:, 0], uv[:, 1])
    n = normals(surface, uv[:, 0], uv[:, 1])
    across = np.cross(n, np.gradient(middle, axis=0))
    across *= width / 2 / np.linalg.norm(across, axis=1, keepdims=True)
    return grid(np.stack([middle - across, middle + across], axis=1) + height * n[:, None])


def straight(start: ArrayLike, stop: ArrayLike, count: int = 12) -> Float:
    """A (count, 2) line."""
    share = np.linspace(0, 1, count)[:, None]
    return np.asarray(start, np.float64) * (1 - share) + np.asarray(stop, np.float64) * share
