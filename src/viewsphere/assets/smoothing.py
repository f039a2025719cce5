"""Shading normals for files that give none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.piece import Float, Int, Piece, face_normals
from viewsphere.assets.transform import unit

CREASE_DEG = 40.0
MAX_VALENCE = 64


def flat(piece: Piece) -> Piece:
    """The piece with every triangle on its own, each corner with its face's normal."""
    faces = face_normals(piece.positions, piece.triangles)
    return replace(_split(piece), normals=np.repeat(unit(faces), 3, axis=0))


def creased(piece: Piece, groups: NDArray[np.int64] | None = None) -> Piece:
    """The piece with normals that are smooth across edges and sharp at creases.

    A corner's normal is the area-weighted mean of the faces around its point whose direction differs from its
    own face's by less than `CREASE_DEG`; with `groups` (T,), one smoothing group a triangle, of those of the
    same group instead, and group 0 is flat. Beyond `MAX_VALENCE` faces around a point only near ones (in file
    order) count.
    """
    faces = face_normals(piece.positions, piece.triangles)
    directions = unit(faces)
    point = _same_points(piece.positions)[piece.triangles.reshape(-1)]
    order = np.argsort(point, kind="stable")
    sorted_point, owner = point[order], order // 3
    total = faces[owner].copy()
    first = np.arange(len(order))
    for shift in range(1, MAX_VALENCE):
        first = first[first + shift < len(order)]
        first = first[sorted_point[first] == sorted_point[first + shift]]
        if not first.size:
            break
        a, b = owner[first], owner[first + shift]
        if groups is None:
            smooth = np.einsum("ij,ij->i", directions[a], directions[b]) > np.cos(np.deg2rad(CREASE_DEG))
        else:
            smooth = (groups[a] == groups[b]) & (groups[a] != 0)
        smooth &= a != b
        near = first[smooth]
        total[near] += faces[owner[near + shift]]
        total[near + shift] += faces[owner[near]]
    normals = np.empty_like(total)
    normals[order] = unit(total)
    return _welded(replace(_split(piece), normals=normals), piece.triangles.reshape(-1))


def _split(piece: Piece) -> Piece:
    corners = piece.triangles.reshape(-1)

    def taken(array: Float | None) -> Float | None:
        return None if array is None else array[corners]

    return replace(
        piece,
        positions=piece.positions[corners],
        triangles=np.arange(len(corners)).reshape(-1, 3),
        normals=taken(piece.normals),
        uv0=taken(piece.uv0),
        uv1=taken(piece.uv1),
        colors=taken(piece.colors),
    )


def _welded(piece: Piece, vertex: Int) -> Piece:
    """Join corners that came from the same vertex and have the same normal."""
    assert piece.normals is not None
    normals = np.ascontiguousarray(piece.normals.astype(np.float32)).view(np.int32)
    keys = np.column_stack([vertex, normals]).astype(np.int64)
    _, first, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)

    def taken(array: Float | None) -> Float | None:
        return None if array is None else array[first]

    return replace(
        piece,
        positions=piece.positions[first],
        triangles=inverse.reshape(-1, 3),
        normals=taken(piece.normals),
        uv0=taken(piece.uv0),
        uv1=taken(piece.uv1),
        colors=taken(piece.colors),
    )


def _same_points(positions: Float) -> Int:
    """One number a vertex, equal for equal positions, (V,) int64."""
    if not len(positions):
        return np.zeros(0, np.int64)
    return np.unique(positions, axis=0, return_inverse=True)[1].reshape(-1)
