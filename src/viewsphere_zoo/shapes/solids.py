"""Solids from curves: grids, lathes, lofts, tubes, rounded boxes. Triangles are counter-clockwise seen from outside.

A solid carries no normals; `assembly.assemble` computes them from the faces by crease angle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Float = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Solid:
    """Triangles in metres: vertices (V, 3) float64, triangles (T, 3) int64."""

    vertices: Float
    triangles: NDArray[np.int64]


def join(*solids: Solid) -> Solid:
    """Return the solids as a single solid."""
    starts = np.cumsum([0, *(len(s.vertices) for s in solids)])
    return Solid(
        np.concatenate([s.vertices for s in solids]),
        np.concatenate([s.triangles + start for s, start in zip(solids, starts, strict=False)]),
    )


def flipped(solid: Solid) -> Solid:
    """The same surface seen from the other side."""
    return Solid(solid.vertices, solid.triangles[:, ::-1])


def mirrored(solid: Solid) -> Solid:
    """The image in the plane x = 0, still facing outwards."""
    return flipped(Solid(solid.vertices * (-1.0, 1.0, 1.0), solid.triangles))


def both_sides(solid: Solid) -> Solid:
    """The solid and its image in the plane x = 0."""
    return join(solid, mirrored(solid))


def moved(solid: Solid, by: ArrayLike) -> Solid:
    """The solid translated, metres."""
    return Solid(solid.vertices + np.asarray(by, np.float64), solid.triangles)


def turned(solid: Solid, axis: int, angle: float) -> Solid:
    """The solid rotated about a coordinate axis (0 x, 1 y, 2 z) through the origin, right-handed, radians."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    rotation = np.eye(3)
    rotation[i, i], rotation[i, j], rotation[j, i], rotation[j, j] = c, -s, s, c
    return Solid(solid.vertices @ rotation.T, solid.triangles)


def grid(points: Float, wrap: bool = False) -> Solid:
    """The quads of a (M, N, 3) grid; outside is d/dM x d/dN. `wrap` joins the last column to the first."""
    m, n = points.shape[:2]
    index = np.arange(m * n).reshape(m, n)
    if wrap:
        index = np.concatenate([index, index[:, :1]], axis=1)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    triangles = np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    return Solid(points.reshape(-1, 3).astype(np.float64), triangles)


def fan(ring: Float) -> Solid:
    """A star-shaped face over a closed (N, 3) ring, counter-clockwise seen from outside."""
    n = len(ring)
    i = np.arange(n)
    center = np.full(n, n)
    return Solid(np.vstack([ring, ring.mean(axis=0)]), np.stack([i, (i + 1) % n, center], axis=1))


def lathe(profile: ArrayLike, segments: int = 32) -> Solid:
    """A (N, 2) profile of (radius, height) turned about z; outside lies to the right of the profile's direction."""
    radius, height = np.asarray(profile, np.float64).T
    angle = np.linspace(0, 2 * np.pi, segments, endpoint=False)
    x, y = radius[:, None] * np.cos(angle), radius[:, None] * np.sin(angle)
    points = np.stack([x, y, np.broadcast_to(height[:, None], x.shape)], axis=-1)
    return flipped(grid(points, wrap=True))


def loft(rings: Float, caps: tuple[bool, bool] = (True, True)) -> Solid:
    """Skin over (M, N, 3) closed rings, each counter-clockwise seen from where the last ring lies; flat caps."""
    solids = [flipped(grid(rings, wrap=True))]
    if caps[0]:
        solids.append(flipped(fan(rings[0])))
    if caps[1]:
        solids.append(fan(rings[-1]))
    return join(*solids)


def frames_along(path: Float) -> tuple[Float, Float]:
    """Two unit vectors (N, 3) across a path that turn as little as possible (parallel transport)."""
    tangent: Float = np.gradient(path, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    first = np.cross(tangent[0], np.eye(3)[np.argmin(np.abs(tangent[0]))])
    across = [first / np.linalg.norm(first)]
    for t in tangent[1:]:
        a = across[-1] - t * (across[-1] @ t)
        across.append(a / np.linalg.norm(a))
    u = np.array(across)
    return u, np.cross(tangent, u)


def tube(path: ArrayLike, radius: ArrayLike, sides: int = 10) -> Solid:
    """A closed tube along a (N, 3) path; radius in metres, one for all points or one for each."""
    line = np.asarray(path, np.float64)
    u, v = frames_along(line)
    r = np.broadcast_to(np.asarray(radius, np.float64), len(line))[:, None, None]
    angle = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    ring = u[:, None] * np.cos(angle)[:, None] + v[:, None] * np.sin(angle)[:, None]
    return loft(line[:, None] + r * ring)


def rounded_box(size: ArrayLike, radius: float, steps: int = 3) -> Solid:
    """A box about the origin with rounded edges, sharp edges for radius 0 and no steps; size (x, y, z) and radius in metres."""
    half = np.asarray(size, np.float64) / 2
    r = min(radius, 0.999 * float(half.min()))
    quarter = np.linspace(0, np.pi / 2, steps + 1)
    azimuth = np.concatenate([quarter + k * np.pi / 2 for k in range(4)])
    sx, sy = (np.repeat(s, steps + 1) for s in ([1, -1, -1, 1], [1, 1, -1, -1]))
    elevation = np.concatenate([quarter - np.pi / 2, quarter])
    sz = np.repeat([-1, 1], steps + 1)
    x = sx * (half[0] - r) + r * np.cos(elevation)[:, None] * np.cos(azimuth)
    y = sy * (half[1] - r) + r * np.cos(elevation)[:, None] * np.sin(azimuth)
    z = np.broadcast_to((sz * (half[2] - r) + r * np.sin(elevation))[:, None], x.shape)
    return loft(np.stack([x, y, z], axis=-1))


def superellipse(half_width: float, half_height: float, exponent: float, count: int) -> Float:
    """A closed counter-clockwise (count, 2) curve |x/a|^e + |y/b|^e = 1; exponent 2 is an ellipse."""
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    c, s = np.cos(angle), np.sin(angle)
    length = (np.abs(c) ** exponent + np.abs(s) ** exponent) ** (-1 / exponent)
    return np.stack([half_width * c * length, half_height * s * length], axis=1)


def curve(x: ArrayLike, knots: ArrayLike) -> Float:
    """Monotone cubic through (K, 2) knots with growing x, flat beyond the ends (Steffen 1990, A&A 239, 443)."""
    k = np.asarray(knots, np.float64)
    h, slope = np.diff(k[:, 0]), np.diff(k[:, 1]) / np.diff(k[:, 0])
    middle = (slope[:-1] * h[1:] + slope[1:] * h[:-1]) / (h[:-1] + h[1:])
    least = np.minimum(np.abs(slope[:-1]), np.abs(slope[1:]))
    sign = np.sign(slope[:-1]) + np.sign(slope[1:])
    inner = sign * np.minimum(least, 0.5 * np.abs(middle))
    d = np.concatenate([slope[:1], inner, slope[-1:]])
    at = np.clip(np.asarray(x, np.float64), k[0, 0], k[-1, 0])
    i = np.clip(np.searchsorted(k[:, 0], at, side="right") - 1, 0, len(h) - 1)
    t = at - k[i, 0]
    a = (d[i] + d[i + 1] - 2 * slope[i]) / h[i] ** 2
    b = (3 * slope[i] - 2 * d[i] - d[i + 1]) / h[i]
    return ((a * t + b) * t + d[i]) * t + k[i, 1]
