"""Shading normals for files that give none."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.primitive import Float, Int, Primitive, face_normals, pick
from viewsphere.assets.transform import unit

CREASE_DEG = 40.0
MAX_VALENCE = 64


def flat(piece: Primitive) -> Primitive:
    """The piece with unshared vertices, each corner having its face's normal."""
    faces = face_normals(piece.positions, piece.triangles)
    return replace(split(piece), normals=np.repeat(unit(faces), 3, axis=0))


def creased(piece: Primitive, groups: NDArray[np.int64] | None = None) -> Primitive:
    """The piece with normals that are smooth across edges and sharp at creases.

    A corner's normal is the mean, weighted by the angles at the corner's point, of the normals of the faces around this point
    that differ from the corner's own face by less than `CREASE_DEG`. With `groups` (T,), one smoothing group a triangle, the
    faces of the same group count instead, and group 0 is flat. Of more than `MAX_VALENCE` faces around a point only those
    near in the file's order count.
    """
    faces = face_normals(piece.positions, piece.triangles)
    directions = unit(faces)
    point = _same_points(piece.positions)[piece.triangles.reshape(-1)]
    order = np.argsort(point, kind="stable")
    sorted_point, owner = point[order], order // 3
    # Angles, not areas: a quadrilateral then counts the same however it was cut.
    turned = (np.repeat(directions, 3, axis=0) * _angles(piece.positions, piece.triangles)[:, None])[order]
    total = turned.copy()
    first = np.arange(len(order))
    for shift in range(1, MAX_VALENCE):
        first = first[first + shift < len(order)]
        first = first[sorted_point[first] == sorted_point[first + shift]]
        if not first.size:
            break
        a, b = owner[first], owner[first + shift]
        if groups is None:
            smooth = np.einsum("ij,ij->i", directions[a], directions[b]) > math.cos(math.radians(CREASE_DEG))
        else:
            smooth = (groups[a] == groups[b]) & (groups[a] != 0)
        smooth &= a != b
        near = first[smooth]
        total[near] += turned[near + shift]
        total[near + shift] += turned[near]
    normals = np.empty_like(total)
    normals[order] = unit(total)
    return _welded(replace(split(piece), normals=normals), piece.triangles.reshape(-1))


def _angles(positions: Float, triangles: Int) -> Float:
    """Angle of each corner, (3 T,) radians."""
    corners = positions[triangles]
    u = np.roll(corners, -1, axis=1) - corners
    v = np.roll(corners, 1, axis=1) - corners
    return angle_of(np.linalg.norm(np.cross(u, v), axis=2), (u * v).sum(axis=2)).reshape(-1)


def angle_of(sine: Float, cosine: Float) -> Float:
    """arctan2(sine, cosine) for sines of at least 0, to 1e-11 rad, and 0 where the angle is unknown.

    Computed by halving the angle four times and a power series, since numpy's arctan2 rounds differently on each processor.
    """
    for _ in range(4):
        cosine = cosine + np.sqrt(sine * sine + cosine * cosine)
    tangent = np.divide(sine, cosine, out=np.zeros_like(sine), where=cosine > 0)
    square = tangent * tangent
    series = np.zeros_like(square)
    for odd in range(15, 0, -2):
        series = 1.0 / odd - square * series
    return 16.0 * np.nan_to_num(tangent * series)


def split(piece: Primitive) -> Primitive:
    """The piece with unshared vertices: three for every triangle."""
    corners = piece.triangles.reshape(-1)
    return replace(pick(piece, corners), triangles=np.arange(len(corners)).reshape(-1, 3))


def _welded(piece: Primitive, vertex: Int) -> Primitive:
    """Join corners that came from the same vertex and have the same normal."""
    assert piece.normals is not None
    bits = np.ascontiguousarray(piece.normals.astype(np.float32)).view(np.int32)
    _, first, inverse = np.unique(row_numbers(vertex, *bits.T), return_index=True, return_inverse=True)
    return replace(pick(piece, first), triangles=inverse.reshape(-1, 3))


def row_numbers(*columns: NDArray[Any]) -> Int:
    """One number a row, equal for equal rows: much faster than numpy's unique along an axis."""
    number = np.zeros(len(columns[0]), np.int64)
    for column in columns:
        _, dense = np.unique(column, return_inverse=True)
        _, number = np.unique(number * (int(dense.max(initial=0)) + 1) + dense.reshape(-1), return_inverse=True)
        number = number.reshape(-1)
    return number


def _same_points(positions: Float) -> Int:
    """One number a vertex, equal for equal positions, (V,) int64."""
    return row_numbers(*positions.T)
