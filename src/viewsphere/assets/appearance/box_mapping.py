"""Texture coordinates in metres by box projection, for surfaces of any shape, independent of the coordinates in their file."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.mesh import Mesh
from viewsphere.assets.primitive import face_normals

Float = NDArray[np.float64]

_RIGHT = np.array([[0, 1, 0], [0, -1, 0], [-1, 0, 0], [1, 0, 0], [1, 0, 0], [-1, 0, 0]], np.float64)
_UP = np.array([[0, 0, 1], [0, 0, 1], [0, 0, 1], [0, 0, 1], [0, 1, 0], [0, 1, 0]], np.float64)
"""The right and up directions of a viewer that faces the sides +x, -x, +y, -y, +z, -z of a box."""

_GOLDEN = 0.6180339887498949
"""The golden ratio less 1: multiples of it, modulo 1, shift the parts' textures by evenly spread amounts."""


def box_mapped(mesh: Mesh, chosen: NDArray[np.bool_], grained: NDArray[np.bool_], rest: Mesh | None = None) -> Mesh:
    """The mesh in which each chosen triangle (T,) has coordinates uv0 in metres, v down, on the box side that it faces most.

    grained (T,): u runs along the longer side of the triangle's part, and each part has a different offset, like pieces cut
    from one material. rest: the same triangles at rest, whose positions and normals are used for a deforming model.

    The number and order of triangles stay the same. A vertex with several coordinates is split into several at one position.
    Vertex colours become white there.
    """
    still = mesh if rest is None or rest.triangles.shape != mesh.triangles.shape else rest
    vertices = still.vertices.astype(np.float64)
    normals = face_normals(vertices, still.triangles)
    axis = np.abs(normals).argmax(axis=1)
    side = 2 * axis + (np.take_along_axis(normals, axis[:, None], axis=1)[:, 0] < 0)
    turned = grained & _is_turned(still, vertices, side)
    part = np.where(grained, mesh.triangle_part.astype(np.int64) + 1, 0)
    mapping = np.where(chosen, 1 + side + 6 * turned + 12 * part, 0)
    count = int(mapping.max()) + 1
    keys = mesh.triangles.astype(np.int64) * count + mapping[:, None]
    found, triangles = np.unique(keys, return_inverse=True)
    origin, way = found // count, found % count
    own = way > 0
    uv = np.zeros((len(found), 2), np.float32) if mesh.uv0 is None else mesh.uv0[origin]
    uv[own] = _coordinates(vertices[still.triangles.reshape(-1)[_first(triangles, len(found))]][own], way[own] - 1)
    colors = None if mesh.colors is None else np.where(own[:, None], np.float32(1), mesh.colors[origin])
    return replace(
        mesh,
        vertices=mesh.vertices[origin],
        normals=mesh.normals[origin],
        triangles=triangles.reshape(-1, 3).astype(np.int32),
        uv0=uv,
        uv1=None if mesh.uv1 is None else mesh.uv1[origin],
        colors=colors,
    )


def _first(index: NDArray[np.intp], count: int) -> NDArray[np.intp]:
    """For each number below `count`, a position in `index` that holds it."""
    places = np.empty(count, np.intp)
    places[index.reshape(-1)] = np.arange(index.size)
    return places


def _is_turned(mesh: Mesh, vertices: Float, side: NDArray[np.int64]) -> NDArray[np.bool_]:
    """A mask (T,) of the triangles whose part extends farther up than right on the triangle's side."""
    low, high = (np.full((len(mesh.parts), 3), fill) for fill in (np.inf, -np.inf))
    corners, parts = vertices[mesh.triangles], mesh.triangle_part
    np.minimum.at(low, parts, corners.min(axis=1))
    np.maximum.at(high, parts, corners.max(axis=1))
    extent = np.where(high >= low, high - low, 0.0)[parts]
    return (extent * np.abs(_UP[side])).sum(axis=1) > (extent * np.abs(_RIGHT[side])).sum(axis=1)


def _coordinates(places: Float, way: NDArray[np.int64]) -> NDArray[np.float32]:
    """Coordinates (N, 2) of positions (N, 3), each mapped by its `way`: one of 6 sides, upright or turned, shifted by its
    part's number.
    """
    side, turned, part = way % 6, way // 6 % 2 == 1, way // 12
    right, up = (places * _RIGHT[side]).sum(axis=1), (places * _UP[side]).sum(axis=1)
    u, v = np.where(turned, up, right), np.where(turned, right, -up)
    shift = part * _GOLDEN
    return np.stack([u + 0.3 * shift, v + shift], axis=1).astype(np.float32)
