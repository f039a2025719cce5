"""The assembly of pieces (a solid, its part's name, its material) into one Mesh with normals by crease angle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import Material, Mesh
from viewsphere_zoo.shapes.solids import Float, Solid, join

WELD = 1e-5
"""Vertices nearer to each other than this are merged, metres."""


@dataclass(frozen=True, eq=False)
class Piece:
    """A solid of one part and one material."""

    part: str
    material: Material
    solid: Solid


def assemble(pieces: Sequence[Piece], crease_deg: float = 40.0) -> Mesh:
    """One Mesh; edges sharper than the crease angle, and edges between materials, stay sharp.

    Parts and materials are numbered in order of first use; degenerate triangles are left out.
    """
    parts = tuple(dict.fromkeys(p.part for p in pieces))
    materials = tuple(dict.fromkeys(p.material for p in pieces))
    whole = join(*(p.solid for p in pieces))
    counts = [len(p.solid.triangles) for p in pieces]
    part = np.repeat([parts.index(p.part) for p in pieces], counts)
    material = np.repeat([materials.index(p.material) for p in pieces], counts)
    vertices = whole.vertices.astype(np.float32)
    cell = _welded(vertices, whole.triangles, material)
    area = _doubled_areas(vertices.astype(np.float64), whole.triangles)
    a, b, c = cell.T
    keep = (a != b) & (b != c) & (c != a) & (np.linalg.norm(area, axis=1) > 1e-11)
    triangles, cell, area = whole.triangles[keep], cell[keep], area[keep]
    normals = _corner_normals(vertices.astype(np.float64), triangles, cell, area, np.cos(np.radians(crease_deg)))
    first, index = _merged_corners(cell, normals)
    return Mesh(
        vertices=vertices[triangles.ravel()[first]],
        triangles=index.reshape(-1, 3).astype(np.int32),
        normals=normals[first].astype(np.float32),
        triangle_material=material[keep].astype(np.int32),
        triangle_part=part[keep].astype(np.int32),
        materials=materials,
        parts=parts,
    )


def _welded(vertices: NDArray[np.float32], triangles: NDArray[np.int64], material: NDArray[np.int64]) -> NDArray[np.int64]:
    """For each corner (T, 3) a number that corners of one material at one place share."""
    x, y, z = (np.unique(np.round(column / WELD), return_inverse=True)[1] for column in vertices.T)
    key = ((x * (y.max() + 1) + y) * (z.max() + 1) + z)[triangles]
    _, place = np.unique(key, return_inverse=True)
    pair = place.reshape(-1, 3) * 256 + material[:, None]
    return np.unique(pair, return_inverse=True)[1].reshape(-1, 3)


def _doubled_areas(vertices: Float, triangles: NDArray[np.int64]) -> Float:
    """Face normals with length twice the area, (T, 3)."""
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    return np.cross(b - a, c - a)


def _corner_normals(
    vertices: Float, triangles: NDArray[np.int64], cell: NDArray[np.int64], area: Float, cosine: float
) -> Float:
    """Unit normals (3T, 3): the area-weighted mean of the faces around a corner that lie within the crease angle."""
    unit = area / np.linalg.norm(area, axis=1, keepdims=True)
    order = np.argsort(cell.ravel(), kind="stable")
    counts = np.bincount(cell.ravel())
    counts = counts[counts > 0]
    start = np.cumsum(counts) - counts
    size = np.repeat(counts, counts)
    left = np.repeat(np.arange(len(order)), size)
    right = np.arange(len(left)) - np.repeat(np.cumsum(size) - size, size) + np.repeat(np.repeat(start, counts), size)
    corner, face, other = order[left], order[left] // 3, order[right] // 3
    near = np.einsum("ij,ij->i", unit[face], unit[other]) > cosine
    weight = area[other] * near[:, None]
    total = np.stack([np.bincount(corner, weight[:, k], 3 * len(triangles)) for k in range(3)], axis=1)
    return total / np.linalg.norm(total, axis=1, keepdims=True)


def _merged_corners(cell: NDArray[np.int64], normals: Float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Corners of one place and normal become one vertex: index of the first such corner, and each corner's vertex."""
    q = np.round((normals + 1) * 500).astype(np.int64)
    key = ((cell.ravel() << 10 | q[:, 0]) << 10 | q[:, 1]) << 10 | q[:, 2]
    _, first, index = np.unique(key, return_index=True, return_inverse=True)
    return first, index.ravel()
