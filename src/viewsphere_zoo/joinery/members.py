"""Long members: bars of rounded section, turned spindles, bent tubes and closed hoops."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from viewsphere_zoo.shapes.rods import aimed
from viewsphere_zoo.shapes.solids import Float, Solid, flipped, grid, lathe, loft, tube

Point = tuple[float, float, float]


def bar(path: ArrayLike, size: ArrayLike, rounding: float, across: ArrayLike, steps: int = 3) -> Solid:
    """A bar with rounded edges and ends along a (N, 3) path.

    size: width along `across` and thickness, metres, (2,) or one pair a point; across: about the direction of the width.
    """
    line = np.asarray(path, np.float64)
    half = np.broadcast_to(np.asarray(size, np.float64) / 2, (len(line), 2))
    chamfer = min(rounding, 0.4 * float(half.min()))
    start, stop = (d / np.linalg.norm(d) for d in (line[1] - line[0], line[-2] - line[-1]))
    turn = np.linspace(0, np.pi / 2, steps + 1)[:, None]
    along, less = chamfer * (1 - np.cos(turn)), chamfer * (1 - np.sin(turn))
    line = np.concatenate([line[0] + along * start, line[1:-1], line[-1] + along[::-1] * stop])
    half = np.concatenate([half[0] - less, half[1:-1], half[-1] - less[::-1]])
    tangent: Float = np.gradient(line, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    wide = np.asarray(across, np.float64) - tangent * (tangent @ np.asarray(across, np.float64))[:, None]
    wide /= np.linalg.norm(wide, axis=1, keepdims=True)
    section = _sections(half, rounding, steps)
    deep = np.cross(tangent, wide)
    return loft(line[:, None] + section[..., :1] * wide[:, None] + section[..., 1:] * deep[:, None])


def _sections(half: Float, rounding: float, steps: int) -> Float:
    """Rounded rectangles (N, 4 (steps + 1), 2), counter-clockwise."""
    r = np.minimum(rounding, 0.999 * half.min(axis=1))[:, None]
    quarter = np.linspace(0, np.pi / 2, steps + 1)
    angle = np.concatenate([quarter + k * np.pi / 2 for k in range(4)])
    sx, sy = (np.repeat(s, steps + 1) for s in ([1, -1, -1, 1], [1, 1, -1, -1]))
    x = sx * (half[:, :1] - r) + r * np.cos(angle)
    y = sy * (half[:, 1:] - r) + r * np.sin(angle)
    return np.stack([x, y], axis=-1)


def line(start: ArrayLike, stop: ArrayLike, count: int = 2) -> Float:
    """A straight (count, 3) path."""
    share = np.linspace(0, 1, count)[:, None]
    return np.asarray(start, np.float64) * (1 - share) + np.asarray(stop, np.float64) * share


def spindle(start: ArrayLike, stop: ArrayLike, profile: Sequence[tuple[float, float]], segments: int = 18) -> Solid:
    """A turned member between two points; profile: (fraction of the way, radius in metres), growing."""
    a, b = np.asarray(start, np.float64), np.asarray(stop, np.float64)
    length = float(np.linalg.norm(b - a))
    turned = [(0.0, profile[0][0] * length), *((r, f * length) for f, r in profile), (0.0, profile[-1][0] * length)]
    return aimed(lathe(turned, segments), a, b - a, np.eye(3)[np.argmin(np.abs(b - a))])


def bend(points: ArrayLike, radius: float, steps: int = 6, closed: bool = False) -> Float:
    """A path through these points, two or three coordinates each, whose corners are rounded (parabolas)."""
    p = np.asarray(points, np.float64)
    before, after = np.roll(p, 1, axis=0), np.roll(p, -1, axis=0)
    t = np.linspace(0, 1, steps + 1)[:, None]
    turns: list[Float] = []
    for k in range(len(p)):
        if not closed and k in (0, len(p) - 1):
            turns.append(p[k : k + 1])
            continue
        arms = before[k] - p[k], after[k] - p[k]
        a, b = (p[k] + d * min(radius / float(np.linalg.norm(d)), 0.48) for d in arms)
        turns.append((1 - t) ** 2 * a + 2 * t * (1 - t) * p[k] + t**2 * b)
    return np.concatenate(turns)


def dense(path: Float, spacing: float, closed: bool = False) -> Float:
    """The path with further points such that neighbours are at most `spacing` apart."""
    ends = np.roll(path, -1, axis=0) if closed else np.vstack([path[1:], path[-1:]])
    pieces = [
        a + (b - a) * np.arange(n)[:, None] / n
        for a, b in zip(path, ends, strict=True)
        for n in [max(1, int(np.ceil(float(np.linalg.norm(b - a)) / spacing)))]
    ]
    return np.concatenate(pieces)


def pipe(points: ArrayLike, radius: float, turn: float = 0.06, sides: int = 12) -> Solid:
    """A bent metal tube through these points; turn: where its corners begin to bend, metres before them."""
    return tube(bend(points, turn), radius, sides)


def hoop(path: Float, radius: float, across: ArrayLike = (0.0, 0.0, 1.0), sides: int = 8) -> Solid:
    """A round tube along a closed (N, 3) path; across: a direction that no part of the path takes."""
    tangent = np.roll(path, -1, axis=0) - np.roll(path, 1, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    u = np.asarray(across, np.float64) - tangent * (tangent @ np.asarray(across, np.float64))[:, None]
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    angle = np.linspace(0, 2 * np.pi, sides, endpoint=False)[:, None]
    rings = u[:, None] * np.cos(angle) + np.cross(tangent, u)[:, None] * np.sin(angle)
    rings = path[:, None] + radius * rings
    return flipped(grid(np.concatenate([rings, rings[:1]]), wrap=True))
