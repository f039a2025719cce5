"""Bars, bent tubes, flat plates and many copies of one solid, for frames and machines."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from viewsphere_zoo.shapes.solids import Float, Solid, flipped, grid, loft, tube


def unit(vector: ArrayLike) -> Float:
    """The vector with length 1."""
    v = np.asarray(vector, np.float64)
    return v / np.linalg.norm(v)


def between(a: ArrayLike, b: ArrayLike, share: float) -> Float:
    """The point at this share of the way from a to b."""
    p, q = np.asarray(a, np.float64), np.asarray(b, np.float64)
    return p + share * (q - p)


def shifted(point: ArrayLike, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Float:
    """The point, or points (..., 3), moved by (x, y, z), metres."""
    return np.asarray(point, np.float64) + np.array((x, y, z))


def rod(a: ArrayLike, b: ArrayLike, radius: float | tuple[float, float], sides: int = 8) -> Solid:
    """A straight closed tube from a to b; the radius may differ at its ends, metres."""
    return tube(np.array([a, b], np.float64), radius, sides)


def pin(middle: ArrayLike, half: float, radius: float, sides: int = 12) -> Solid:
    """A closed rod along the world's x axis, `half` to either side of its middle."""
    return rod(shifted(middle, -half), shifted(middle, half), radius, sides)


def smooth(points: ArrayLike, per: int = 5) -> Float:
    """A curve through (N, 3) points with `per` steps between neighbours (uniform Catmull-Rom), ((N - 1) per + 1, 3)."""
    p = np.asarray(points, np.float64)
    p = np.concatenate([[2 * p[0] - p[1]], p, [2 * p[-1] - p[-2]]])
    t = np.linspace(0, 1, per, endpoint=False)[None, :, None]
    a, b, c, d = (p[i : len(p) - 3 + i, None] for i in range(4))
    curve = b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)))
    return np.concatenate([curve.reshape(-1, 3), p[-2:-1]])


def bezier(a: ArrayLike, b: ArrayLike, c: ArrayLike, d: ArrayLike, count: int) -> Float:
    """A cubic Bezier curve from a to d with the handles b and c, (count, 3)."""
    t = np.linspace(0, 1, count)[:, None]
    weights = ((1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3)
    return np.sum([w * np.asarray(p, np.float64) for w, p in zip(weights, (a, b, c, d), strict=True)], axis=0)


def basis(toward: ArrayLike, side: ArrayLike = (1.0, 0.0, 0.0)) -> Float:
    """A rotation (3, 3) that takes z to this direction and x as near to `side` as that allows."""
    w, s = unit(toward), np.asarray(side, np.float64)
    u = unit(s - w * (w @ s))
    return np.stack([u, np.cross(w, u), w], axis=1)


def aimed(solid: Solid, at: ArrayLike, toward: ArrayLike, side: ArrayLike = (1.0, 0.0, 0.0)) -> Solid:
    """The solid with its origin moved to `at`, its z axis along `toward` and its x axis as near to `side` as possible."""
    return Solid(solid.vertices @ basis(toward, side).T + np.asarray(at, np.float64), solid.triangles)


def copies(solid: Solid, rotations: Float, origins: Float) -> Solid:
    """One copy of the solid for each rotation (K, 3, 3) and then translation (K, 3)."""
    vertices = np.einsum("kij,vj->kvi", rotations, solid.vertices) + origins[:, None]
    start = np.arange(len(origins))[:, None, None] * len(solid.vertices)
    return Solid(vertices.reshape(-1, 3), (solid.triangles + start).reshape(-1, 3))


def turns(axis: int, angles: ArrayLike) -> Float:
    """Rotations (K, 3, 3) about a coordinate axis, right-handed, radians."""
    a = np.atleast_1d(np.asarray(angles, np.float64))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    r = np.tile(np.eye(3), (len(a), 1, 1))
    r[:, i, i], r[:, i, j], r[:, j, i], r[:, j, j] = np.cos(a), -np.sin(a), np.sin(a), np.cos(a)
    return r


def ring_of(solid: Solid, count: int, axis: int = 2, start: float = 0.0) -> Solid:
    """Copies of the solid spread evenly around a coordinate axis; the first is turned by `start` radians."""
    return copies(solid, turns(axis, start + np.arange(count) * 2 * np.pi / count), np.zeros((count, 3)))


def plate(outline: ArrayLike, thickness: float) -> Solid:
    """A flat plate about z = 0 over a star-shaped counter-clockwise (N, 2) outline."""
    xy = np.asarray(outline, np.float64)
    levels = [np.column_stack([xy, np.full(len(xy), z)]) for z in (-thickness / 2, thickness / 2)]
    return loft(np.array(levels))


def washer(inner: ArrayLike, outer: ArrayLike, thickness: float) -> Solid:
    """A flat ring about z = 0 between two counter-clockwise (N, 2) outlines with matching points."""
    a, b = np.asarray(inner, np.float64), np.asarray(outer, np.float64)
    corners = ((b, -0.5), (b, 0.5), (a, 0.5), (a, -0.5), (b, -0.5))
    rings = np.array([np.column_stack([xy, np.full(len(xy), z * thickness)]) for xy, z in corners])
    return flipped(grid(rings, wrap=True))


def across(solid: Solid) -> Solid:
    """A flat solid about z = 0 put upright into x = 0: its x becomes y, its y becomes z, its z becomes x."""
    return Solid(solid.vertices[:, (2, 0, 1)], solid.triangles)


def circle(radius: float, count: int, phase: float = 0.0) -> Float:
    """A counter-clockwise (count, 2) circle about the origin."""
    a = phase + np.linspace(0, 2 * np.pi, count, endpoint=False)
    return radius * np.stack([np.cos(a), np.sin(a)], axis=1)


def split(solid: Solid, inside: Callable[[Float], NDArray[np.bool_]]) -> tuple[Solid, Solid]:
    """The solid's triangles whose centroids (T, 3) are `inside`, and the others: one surface in two materials."""
    chosen = inside(solid.vertices[solid.triangles].mean(axis=1))
    return Solid(solid.vertices, solid.triangles[chosen]), Solid(solid.vertices, solid.triangles[~chosen])


def swept(path: ArrayLike, sections: Float) -> Solid:
    """A closed solid over (N, K, 2) sections along a (N, 3) path in a plane x = const.

    Sections are (x, y) with x along the world's x axis and y across the path, counter-clockwise seen from the path's end.
    """
    line = np.asarray(path, np.float64)
    tangent = np.gradient(line, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    up = np.cross(tangent, (1.0, 0.0, 0.0))
    points = line[:, None] + sections[..., :1] * np.array((1.0, 0.0, 0.0)) + sections[..., 1:] * up[:, None]
    return loft(points)
