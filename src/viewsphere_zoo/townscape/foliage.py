"""Leafy masses: rough blobs, and single leaves or twigs standing on them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from viewsphere_zoo.shapes.solids import Float, Solid
from viewsphere_zoo.townscape.surfaces import waves


def ball(level: int) -> Solid:
    """A unit sphere of 20 * 4^level triangles (an icosahedron, split)."""
    g = (1 + 5**0.5) / 2
    v = np.array([(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0)], np.float64)
    points = np.concatenate([v, np.roll(v, 1, axis=1), np.roll(v, 2, axis=1)])
    ends = (points[:, None] - points[None]) ** 2
    near = np.abs(ends.sum(axis=2) - 4) < 1e-9
    corner = [(i, j, k) for i in range(12) for j in range(i + 1, 12) for k in range(j + 1, 12)]
    faces = np.array([(i, j, k) for i, j, k in corner if near[i, j] and near[j, k] and near[i, k]])
    a, b, c = points[faces].transpose(1, 0, 2)
    inward = (np.cross(b - a, c - a) * a).sum(axis=1) < 0
    faces[inward] = faces[inward][:, ::-1]
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    for _ in range(level):
        points, faces = _split(points, faces)
    return Solid(points, faces.astype(np.int64))


def _split(points: Float, faces: NDArray[np.int64]) -> tuple[Float, NDArray[np.int64]]:
    """Each triangle split into four, with the new vertices on the sphere."""
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    unique, index = np.unique(edges, axis=0, return_inverse=True)
    middle = points[unique].mean(axis=1)
    middle /= np.linalg.norm(middle, axis=1, keepdims=True)
    p, q, r = len(points) + index.reshape(3, -1)
    a, b, c = faces.T
    quarters = ((a, p, r), (p, b, q), (r, q, c), (p, q, r))
    return np.concatenate([points, middle]), np.concatenate([np.stack(t, axis=1) for t in quarters])


def blob(rng: np.random.Generator, half: ArrayLike, level: int = 2, rough: float = 0.2) -> Solid:
    """A lumpy ellipsoid about the origin with these half axes (3,), metres; rough: deviation as a share of the radius."""
    sphere = ball(level)
    lumps = waves(rng, sphere.vertices, 1.5) + 0.6 * waves(rng, sphere.vertices, 0.7)
    return Solid(sphere.vertices * (1 + 0.6 * rough * lumps)[:, None] * np.asarray(half), sphere.triangles)


def leaves(rng: np.random.Generator, at: Float, normals: Float, size: tuple[float, float]) -> Solid:
    """Folded rhombic leaves of two triangles at points (N, 3), roughly across these outward normals (N, 3); length range."""
    n = len(at)
    out = normals + 0.55 * rng.standard_normal((n, 3))
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    along = np.cross(out, rng.standard_normal((n, 3)))
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    side = np.cross(out, along)
    length = rng.uniform(*size, (n, 1))
    tip, foot = at + 0.5 * length * along, at - 0.5 * length * along
    fold = 0.14 * length * out
    left, right = at - 0.33 * length * side + fold, at + 0.33 * length * side + fold
    vertices = np.stack([foot, right, tip, left], axis=1).reshape(-1, 3)
    start = 4 * np.arange(n)[:, None]
    triangles = np.concatenate([np.add(start, (0, 2, 3)), np.add(start, (0, 1, 2))])
    return Solid(vertices, triangles)
