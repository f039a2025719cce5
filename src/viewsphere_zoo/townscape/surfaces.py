"""Textured, weathered surfaces from assembled triangles: uv in metres and vertex colours."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from viewsphere.assets.mesh import Image, Mesh
from viewsphere_zoo.shapes.assembly import Piece, assemble
from viewsphere_zoo.shapes.solids import Float, Solid

LEVEL = 0.985
"""Greatest z of the unit normal before a surface takes its uv from above."""

Tint = Callable[[Float], Float]
"""Maps points (N, 3) to factors (N,) or (N, 3) of the base colour, linear, 0..1."""


def finished(
    pieces: Sequence[Piece], images: Sequence[Image] = (), tints: dict[str, Tint] | None = None, crease_deg: float = 40.0
) -> Mesh:
    """The pieces as one Mesh with uv in metres; materials named in `tints` get vertex colours."""
    mesh = assemble(pieces, crease_deg)
    if images:
        mesh = replace(mesh, uv0=planar_uv(mesh), images=tuple(images))
    return replace(mesh, colors=_colors(mesh, tints)) if tints else mesh


def planar_uv(mesh: Mesh) -> np.ndarray[tuple[int, ...], np.dtype[np.float32]]:
    """The uv in metres across and down each vertex' tangent plane, (V, 2) float32: level surfaces (x, -y), others along their
    contour.
    """
    p, n = mesh.vertices.astype(np.float64), mesh.normals.astype(np.float64)
    level = np.abs(n[:, 2]) > LEVEL
    across = np.stack([-n[:, 1], n[:, 0], np.zeros(len(n))], axis=1)
    across[level] = (1, 0, 0)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    up = np.cross(n, across)
    up[level] = (0, 1, 0)
    return np.stack([(p * across).sum(axis=1), -(p * up).sum(axis=1)], axis=1).astype(np.float32)


def mapped(mesh: Mesh, material: str, uv: Tint) -> Mesh:
    """The mesh with another uv0 on one material; `uv` maps points (N, 3) to metres (N, 2)."""
    index = [m.name for m in mesh.materials].index(material)
    own = np.unique(mesh.triangles[mesh.triangle_material == index])
    uv0 = planar_uv(mesh) if mesh.uv0 is None else mesh.uv0.copy()
    uv0[own] = uv(mesh.vertices[own].astype(np.float64))
    return replace(mesh, uv0=uv0)


def _colors(mesh: Mesh, tints: dict[str, Tint]) -> np.ndarray[tuple[int, ...], np.dtype[np.float32]]:
    colors = np.ones((len(mesh.vertices), 4), np.float32)
    for i, material in enumerate(mesh.materials):
        if material.name in tints:
            own = np.unique(mesh.triangles[mesh.triangle_material == i])
            factors = np.asarray(tints[material.name](mesh.vertices[own].astype(np.float64)))
            colors[own, :3] = np.clip(factors if factors.ndim == 2 else factors[:, None], 0, 1)
    return colors


def waves(rng: np.random.Generator, points: Float, length: ArrayLike, count: int = 7) -> Float:
    """Smooth noise (N,), about -1..1, at points (N, D): a sum of waves of about this length (metres) in random directions."""
    size = points.shape[1]
    direction = rng.standard_normal((count, size))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    pace = 2 * np.pi / np.asarray(length) * rng.uniform(0.6, 1.6, (count, 1))
    phase = rng.uniform(0, 2 * np.pi, count)
    return np.sin(points @ (direction * pace).T + phase).sum(axis=1) / np.sqrt(2 * count)


def cuboid(low: ArrayLike, high: ArrayLike) -> Solid:
    """A box between two corners with sharp edges."""
    a, b = np.asarray(low, np.float64), np.asarray(high, np.float64)
    corner = np.array([(i & 1, i >> 1 & 1, i >> 2) for i in range(8)])
    quads = np.array([(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)])
    return Solid(a + corner * (b - a), np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]))


def prism(profile: ArrayLike, low: float, high: float, axis: int = 2) -> Solid:
    """A convex (N, 2) profile, counter-clockwise in the plane of the two axes after `axis` (1: z, x), extruded along `axis`."""
    ring = np.asarray(profile, np.float64)
    n, i = len(ring), np.arange(len(ring))
    points = np.empty((2 * n, 3))
    points[:, (axis + 1) % 3], points[:, (axis + 2) % 3] = np.tile(ring, (2, 1)).T
    points[:n, axis], points[n:, axis] = low, high
    j = (i + 1) % n
    sides = np.concatenate([np.stack([i, j, j + n], axis=1), np.stack([i, j + n, i + n], axis=1)])
    k = i[1:-1]
    caps = [np.stack([0 * k, k + 1, k], axis=1), np.stack([0 * k, k, k + 1], axis=1) + n]
    return Solid(points, np.concatenate([sides, *caps]))
