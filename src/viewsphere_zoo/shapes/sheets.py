"""Curved sheets and mouldings: bent, sawn or extruded solids."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from viewsphere_zoo.shapes.solids import Float, Solid, flipped, grid, join, loft


def _unit(vectors: Float) -> Float:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12)


def sheet(points: Float, thickness: float) -> Solid:
    """A closed sheet with the (M, N, 3) grid as its middle; its upper side is d/dM x d/dN."""
    normal = _unit(np.cross(np.gradient(points, axis=0), np.gradient(points, axis=1)))
    top, bottom = points + normal * thickness / 2, points - normal * thickness / 2

    def border(g: Float) -> Float:
        return np.concatenate([g[:-1, 0], g[-1, :-1], g[:0:-1, -1], g[0, :0:-1]])

    rim = grid(np.stack([border(bottom), border(top)]), wrap=True)
    return join(grid(top), flipped(grid(bottom)), flipped(rim))


def moulding(path: ArrayLike, profile: ArrayLike, side: ArrayLike) -> Solid:
    """A (K, 2) profile, counter-clockwise, swept along a (N, 3) path.

    The profile's first coordinate points towards `side`, (3,) or (N, 3), made perpendicular to the path; its second points
    towards side x path.
    """
    line = np.asarray(path, np.float64)
    ring = np.asarray(profile, np.float64)[::-1]
    tangent = _unit(np.gradient(line, axis=0))
    across = np.broadcast_to(np.asarray(side, np.float64), line.shape)
    across = _unit(across - tangent * np.einsum("ij,ij->i", across, tangent)[:, None])
    up = np.cross(across, tangent)
    return loft(line[:, None] + ring[:, :1] * across[:, None] + ring[:, 1:] * up[:, None])


def bar(width: float, height: float, center: tuple[float, float] = (0.0, 0.0), chamfer: float = 0.2) -> Float:
    """A rectangle (8, 2) with its corners off, counter-clockwise; chamfer is a fraction of the shorter side."""
    a, b = width / 2, height / 2
    c = chamfer * min(width, height)
    corners = [(a, c - b), (a, b - c), (a - c, b), (c - a, b), (-a, b - c), (-a, c - b), (c - a, -b), (a - c, -b)]
    return np.array(corners) + center
