"""Geometry: the world-space triangles of a stage, the one source of every label."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from viewsphere.assets.mesh import Mesh
from viewsphere.model.shot import Placement
from viewsphere.truth.cutouts import Cutouts, mesh_cutouts, stack_cutouts

GROUND = 0
"""Object, part and category id of the ground: it has depth and normals but is background to every label."""

GROUND_REACH = 1000.0


@dataclass(frozen=True, eq=False)
class Geometry:
    """World-space triangles, objects in id order, the ground (if any) last.

    vertices (V, 3) float64 world metres; triangles (T, 3) int32; normals (V, 3) float32 world, unit; coordinates (V, 3)
    float32, each vertex in its object's axes (zero for the ground).

    triangle_normals (T, 3) float32 world, unit, by winding (zero for a degenerate triangle); triangle_side (T,) int8: 1 where
    the mean of the vertex normals agrees with the winding, -1 where it opposes it, 2 or -2 likewise where all three equal the
    triangle's own; triangle_object, triangle_part, triangle_category (T,) int32, 0 for the ground; triangle_cutout (T,) int32:
    -1 all surface, -2 never seen, else a row of `cutouts.corners`.

    Object i + 1 owns vertices [vertex_start[i], vertex_start[i + 1]) and triangles [triangle_start[i], triangle_start[i + 1]);
    both have one entry more than there are objects.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]
    normals: NDArray[np.float32]
    coordinates: NDArray[np.float32]
    triangle_normals: NDArray[np.float32]
    triangle_side: NDArray[np.int8]
    triangle_object: NDArray[np.int32]
    triangle_part: NDArray[np.int32]
    triangle_category: NDArray[np.int32]
    triangle_cutout: NDArray[np.int32]
    cutouts: Cutouts
    vertex_start: tuple[int, ...]
    triangle_start: tuple[int, ...]
    ground_z: float | None

    @property
    def object_count(self) -> int:
        """Number of objects, the ground not counted."""
        return len(self.vertex_start) - 1


def build_geometry(placements: Sequence[Placement], meshes: Sequence[Mesh], ground: bool, label_alpha: float) -> Geometry:
    """Place the meshes in the world and, if asked, lay the ground at their lowest point (z = 0 if there are none).

    `meshes[i]` is the normalised model of `placements[i]`, whose id is i + 1. The ground is two triangles that reach 1,000
    scene sizes to every side. A BLEND material is surface where alpha >= label_alpha, a MASK material where alpha >= its
    cutoff; transmission always counts as surface. Fully transparent triangles (no texel is surface) are kept but never
    seen. Raises ValueError when ids are not 1..N in order.
    """
    if [p.id for p in placements] != list(range(1, len(meshes) + 1)):
        raise ValueError(f"placements: expected ids 1..{len(meshes)} in order, got {[p.id for p in placements]}")
    world = [_moved(p.world_from_object, m.vertices, 1.0) for p, m in zip(placements, meshes, strict=True)]
    vertex_start = (0, *np.cumsum([len(m.vertices) for m in meshes], dtype=int).tolist())
    triangle_start = (0, *np.cumsum([len(m.triangles) for m in meshes], dtype=int).tolist())
    surfaces = [mesh_cutouts(m, label_alpha) for m in meshes]
    vertices = _joined(world, (0, 3), np.float64)
    triangles = _joined([m.triangles + s for m, s in zip(meshes, vertex_start, strict=False)], (0, 3), np.int32)
    ground_z = None
    if ground:
        corners = _ground_corners(vertices[np.unique(triangles)])
        ground_z = float(corners[0, 2])
        n = len(vertices)
        vertices = np.concatenate([vertices, corners])
        triangles = np.concatenate([triangles, np.array([[n, n + 1, n + 2], [n, n + 2, n + 3]], np.int32)])
    cutouts, rows = stack_cutouts(surfaces)
    up = np.tile(np.array([0, 0, 1], np.float32), (4 * ground, 1))
    moved = [_moved(p.world_from_object, m.normals, 0.0) for p, m in zip(placements, meshes, strict=True)]
    normals = _joined([*moved, up], (0, 3), np.float32)
    triangle_normals = _triangle_normals(vertices, triangles)
    pad = np.zeros(2 * ground, np.int32)
    objects = [np.full(len(m.triangles), p.id) for p, m in zip(placements, meshes, strict=True)]
    categories = [np.full(len(m.triangles), p.model.category_id) for p, m in zip(placements, meshes, strict=True)]
    return Geometry(
        vertices=vertices,
        triangles=triangles,
        normals=normals,
        coordinates=_joined([*(m.vertices for m in meshes), np.zeros_like(up)], (0, 3), np.float32),
        triangle_normals=triangle_normals,
        triangle_side=_triangle_side(triangle_normals, normals[triangles]),
        triangle_object=_joined([*objects, pad], (0,), np.int32),
        triangle_part=_joined([*(m.triangle_part + 1 for m in meshes), pad], (0,), np.int32),
        triangle_category=_joined([*categories, pad], (0,), np.int32),
        triangle_cutout=_joined([rows, pad - 1], (0,), np.int32),
        cutouts=cutouts,
        vertex_start=vertex_start,
        triangle_start=triangle_start,
        ground_z=ground_z,
    )


def _joined(arrays: Sequence[NDArray[Any]], empty: tuple[int, ...], dtype: type) -> NDArray[Any]:
    return np.ascontiguousarray(np.concatenate([np.zeros(empty, dtype), *arrays]), dtype)


def _moved(matrix: ArrayLike, points: NDArray[np.float32], w: float) -> NDArray[np.float64]:
    """Points (w = 1) or directions (w = 0) moved; written out, because BLAS rounds differently from processor to processor."""
    m = np.asarray(matrix, np.float64)
    x, y, z = points.astype(np.float64).T
    return np.stack([m[r, 0] * x + m[r, 1] * y + m[r, 2] * z + m[r, 3] * w for r in range(3)], axis=1)


def _ground_corners(used: NDArray[np.float64]) -> NDArray[np.float64]:
    """The ground's four corners, counter-clockwise seen from above."""
    low, high = (used.min(axis=0), used.max(axis=0)) if len(used) else (np.zeros(3), np.zeros(3))
    size = float(np.max(high - low)) or 1.0
    x, y = (low[:2] + high[:2]) / 2
    r = GROUND_REACH * size
    return np.array([[x - r, y - r, low[2]], [x + r, y - r, low[2]], [x + r, y + r, low[2]], [x - r, y + r, low[2]]])


def _triangle_normals(vertices: NDArray[np.float64], triangles: NDArray[np.int32]) -> NDArray[np.float32]:
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    largest = np.abs(normal).max(axis=1, initial=0.0)
    normal /= np.where(largest > 0, largest, 1)[:, None]  # keeps the squares of tiny triangles from vanishing
    length = np.sqrt((normal * normal).sum(axis=1))
    return (normal / np.where(length > 0, length, 1)[:, None]).astype(np.float32)


def _triangle_side(own: NDArray[np.float32], corners: NDArray[np.float32]) -> NDArray[np.int8]:
    mean = corners.sum(axis=1)
    side = np.where((mean * own).sum(axis=1) < 0, -1, 1)
    same = (corners == corners[:, :1]).all(axis=(1, 2))
    flat = same & (np.abs(corners[:, 0] - side[:, None] * own).max(axis=1, initial=0) < 1e-5)
    return np.where(flat, 2 * side, side).astype(np.int8)
