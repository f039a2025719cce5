"""Models small enough for the page: triangles clustered on a grid, each with one colour."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import Mesh
from viewsphere.codecs.srgb import encoded
from viewsphere.report.unknown import numbers

Float = NDArray[np.float64]

BISECTIONS = 12
"""Halvings in the search for a grid's cell, by ratio: the size is then within 0.2 % of the finest that fits."""


@dataclass(frozen=True, eq=False)
class _SmallMesh:
    """vertices (V, 3) float64 metres, object axes; triangles (T, 3), and edges (E, 2) for parts thinner than the grid;
    colours (T, 3) and (E, 3) uint8 sRGB.
    """

    vertices: Float
    triangles: NDArray[np.int64]
    colors: NDArray[np.uint8]
    edges: NDArray[np.int64]
    edge_colors: NDArray[np.uint8]


def read_small(glb: Path, most: int, node: str | None = None) -> _SmallMesh:
    """An exported model, reduced to at most `most` triangles and edges together; of a deforming model, the shape of one node.

    Raises ModelError like any reader of model files.
    """
    from viewsphere.assets.load import load_model

    mesh = load_model(glb, node=node)[0]
    vertices = mesh.vertices.astype(np.float64)[:, (0, 2, 1)] * (1, -1, 1)  # the file has +y up and the front at +z
    return simplified(vertices, mesh.triangles.astype(np.int64), _triangle_colors(mesh), most)


def simplified(vertices: Float, triangles: NDArray[np.int64], colors: NDArray[np.uint8], most: int) -> _SmallMesh:
    """At most `most` triangles and edges: unchanged if there are no more, else vertices that share a grid cell become one.

    The merged vertex lies where the sum of squared distances to the planes of the cell's triangles is least (Lindstrom,
    Out-of-core simplification of large polygonal models, SIGGRAPH 2000), clamped to the cell. The grid is the finest that meets
    `most`.
    """
    if len(triangles) <= most:
        return _SmallMesh(vertices, triangles, colors, np.zeros((0, 2), np.int64), np.zeros((0, 3), np.uint8))
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    extent = float((high - low).max())
    coarse, fine = extent / 4, extent / 4096
    for _ in range(BISECTIONS):
        cell = float(np.sqrt(coarse * fine))
        kept, edges = _faces(_cells(vertices, low, cell)[0], triangles)[:2]
        coarse, fine = (cell, fine) if len(kept) + len(edges) <= most else (coarse, cell)
    cluster, corners = _cells(vertices, low, coarse)
    kept, edges, of_edge = _faces(cluster, triangles)
    points = _representatives(vertices, triangles, cluster, low + corners * coarse, coarse)
    return _SmallMesh(points, cluster[triangles[kept]], colors[kept], edges, colors[of_edge])


def _cells(vertices: Float, low: Float, cell: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The cluster of each vertex, and each cluster's place on the grid."""
    place = np.floor((vertices - low) / cell).astype(np.int64)
    side = place.max(axis=0) + 1
    code = (place[:, 0] * side[1] + place[:, 1]) * side[2] + place[:, 2]
    _, first, cluster = np.unique(code, return_index=True, return_inverse=True)
    return cluster.reshape(-1), place[first]


def _faces(
    cluster: NDArray[np.int64], triangles: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Triangles that stay (their corners lie in three clusters); edges (E, 2) of triangles that thinned to a line, where no
    triangle that stays has that edge; and the triangle of each edge.
    """
    corner = np.sort(cluster[triangles], axis=1)
    whole = (corner[:, 0] != corner[:, 1]) & (corner[:, 1] != corner[:, 2])
    line = ~whole & (corner[:, 0] != corner[:, 2])
    count = int(cluster.max()) + 1
    codes = (corner[:, 0] * count + corner[:, 1]) * count + corner[:, 2]
    rows = np.flatnonzero(whole)
    kept = np.sort(rows[np.unique(codes[rows], return_index=True)[1]])
    lines = np.flatnonzero(line)
    edge, first = np.unique(corner[lines, 0] * count + corner[lines, 2], return_index=True)
    sides = np.concatenate([corner[kept][:, pair] for pair in ((0, 1), (1, 2), (0, 2))])
    free = ~np.isin(edge, sides[:, 0] * count + sides[:, 1])
    return kept, np.column_stack([edge[free] // count, edge[free] % count]), lines[first[free]]


def _representatives(
    vertices: Float, triangles: NDArray[np.int64], cluster: NDArray[np.int64], low: Float, cell: float
) -> Float:
    """The point of each cluster that is nearest to the planes of the cluster's triangles."""
    count = len(low)
    members = np.bincount(cluster, minlength=count)[:, None]
    mean = np.column_stack([np.bincount(cluster, vertices[:, i], count) for i in range(3)]) / members
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    normals = np.cross(b - a, c - a)
    outer = np.zeros((count, 3, 3))
    pull = np.zeros((count, 3))
    for i in range(3):
        at = cluster[triangles[:, i]]
        offset = np.sum(normals * (a - mean[at]), axis=1)
        for j in range(3):
            pull[:, j] += np.bincount(at, normals[:, j] * offset, count)
            for k in range(3):
                outer[:, j, k] += np.bincount(at, normals[:, j] * normals[:, k], count)
    values, axes = np.linalg.eigh(outer)
    good = values > 1e-3 * np.maximum(values[:, 2:], 1e-300)
    inverse = np.where(good, 1 / np.where(good, values, 1), 0)
    shift = np.einsum("nij,nj,nkj,nk->ni", axes, inverse, axes, pull)
    return np.clip(mean + shift, low, low + cell)


def _triangle_colors(mesh: Mesh) -> NDArray[np.uint8]:
    """The base colour at the middle of each triangle, (T, 3) uint8 sRGB: factor, texture and vertex colours."""
    factors = np.array([m.base_color[:3] for m in mesh.materials], np.float64)
    linear = factors[mesh.triangle_material]
    if mesh.colors is not None:
        linear = linear * mesh.colors[mesh.triangles, :3].mean(axis=1)
    colors = encoded(np.clip(linear, 0, 1))
    for number, material in enumerate(mesh.materials):
        texture = material.base_color_texture
        uvs = None if texture is None else (mesh.uv0, mesh.uv1)[texture.texcoord]
        if texture is None or uvs is None:
            continue
        rows = np.flatnonzero(mesh.triangle_material == number)
        uv = uvs[mesh.triangles[rows]].mean(axis=1, dtype=np.float64)
        u, v = (uv @ texture.matrix[:, :2].T + texture.matrix[:, 2]).T
        pixels = mesh.images[texture.image].pixels
        height, width = pixels.shape[:2]
        texel = pixels[np.floor(v % 1 * height).astype(int) % height, np.floor(u % 1 * width).astype(int) % width, :3]
        colors[rows] = colors[rows] * (texel / 255)
    return np.clip(colors * 255, 0, 255).round().astype(np.uint8)


def mesh_data(mesh: _SmallMesh) -> dict[str, Any]:
    """The mesh for the page: 16-bit positions between `low` and `high`, and indices, as base64 of little-endian numbers."""
    used, index = np.unique(np.concatenate([mesh.triangles.ravel(), mesh.edges.ravel()]), return_inverse=True)
    points = mesh.vertices[used]
    low, high = points.min(axis=0), points.max(axis=0)
    steps = ((points - low) / np.maximum(high - low, 1e-12) * 65535).round().astype("<u2")
    split = mesh.triangles.size
    return {
        "low": numbers(low),
        "high": numbers(high),
        "positions": _base64(steps),
        "triangles": _base64(index[:split].astype("<u4")),
        "colors": _base64(mesh.colors),
        "edges": _base64(index[split:].astype("<u4")),
        "edgeColors": _base64(mesh.edge_colors),
    }


def _base64(array: NDArray[Any]) -> str:
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode("ascii")


def spread(count: int, most: int) -> Sequence[int]:
    """At most `most` of 0..count-1, evenly."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(int)).tolist() if count else []
