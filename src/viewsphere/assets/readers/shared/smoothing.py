"""Shading normals for files without any."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.primitive import BLOCK, Float, Int, Primitive, blocks, face_normals, pick
from viewsphere.assets.readers.shared.transform import unit

CREASE_DEG = 40.0  # cylinders of ten sides, 36 degrees each, are smooth; boxes are not
MAX_VALENCE = 64  # faces around a point: limits the time for hostile fans, whose cost grows quadratically
ROUNDS = 8
"""Rounds of claiming equal normals: more than the number of normals at any vertex except the centre of a fan of sharp faces."""


def flat(piece: Primitive) -> Primitive:
    """The piece with unshared vertices, each corner having its face's normal."""
    faces = face_normals(piece.positions, piece.triangles)
    return replace(split(piece), normals=np.repeat(unit(faces), 3, axis=0))


def creased(piece: Primitive, groups: NDArray[np.int64] | None = None) -> Primitive:
    """The piece with normals that are smooth across edges and sharp at creases.

    A corner's normal is the mean, weighted by the angles at the corner's point, of the normals of the faces around this point
    that differ from the corner's own face by less than `CREASE_DEG`. With `groups` (T,), one smoothing group a triangle, the
    faces of the same group count instead, and group 0 is flat. If more than `MAX_VALENCE` faces meet at a point, only those
    near in the file's order count.
    """
    return _welded(piece, _corner_normals(piece, groups))


def _corner_normals(piece: Primitive, groups: NDArray[np.int64] | None) -> Float:
    """The smooth normals of all corners, (3 T, 3)."""
    directions, angles = _of_faces(piece.positions, piece.triangles)
    order, point = _around_points(piece.positions, piece.triangles)
    normals = np.empty((len(order), 3))
    for part in _parted(point):
        normals[order[part]] = _means(order[part], point[part], directions, angles, groups)
    return normals


def _of_faces(positions: Float, triangles: Int) -> tuple[Float, Float]:
    """The direction of each triangle's normal, (T, 3), and the angle of each corner, (3 T,) radians."""
    directions, angles = np.empty((len(triangles), 3)), np.empty(3 * len(triangles))
    for part in blocks(len(triangles)):
        directions[part] = unit(face_normals(positions, triangles[part]))
        angles[3 * part.start : 3 * part.stop] = _angles(positions, triangles[part])
    return directions, angles


def _around_points(positions: Float, triangles: Int) -> tuple[Int, Int]:
    """Return all corners, grouped by their point and in the file's order, and the ascending number of each corner's point."""
    point = _same_points(positions)[triangles.reshape(-1)]
    bits = len(point).bit_length()
    # Sorting plain, distinct numbers takes a tenth of the time of a stable argsort.
    packed = np.sort((point << bits) | np.arange(len(point)))
    return packed & ((1 << bits) - 1), packed >> bits


def _parted(point: Int) -> Iterator[slice]:
    """Slices of about `BLOCK` ascending numbers, with equal numbers in one slice."""
    start = 0
    while start < len(point):
        middle = min(start + BLOCK, len(point)) - 1
        stop = int(np.searchsorted(point, point[middle], side="right"))
        yield slice(start, stop)
        start = stop


def _means(corners: Int, point: Int, directions: Float, angles: Float, groups: NDArray[np.int64] | None) -> Float:
    """The normals of all corners around some points, whose numbers ascend."""
    owner = corners // 3
    facing = directions[owner]
    # Angles, not areas: a quadrilateral then has the same weight for either diagonal.
    turned = facing * angles[corners][:, None]
    total = turned.copy()
    first = np.arange(len(corners))
    for shift in range(1, MAX_VALENCE):
        first = first[first + shift < len(corners)]
        first = first[point[first] == point[first + shift]]
        if not first.size:
            break
        a, b = owner[first], owner[first + shift]
        if groups is None:
            cosine = np.einsum("ij,ij->i", facing.take(first, 0), facing.take(first + shift, 0))
            smooth = cosine > math.cos(math.radians(CREASE_DEG))
        else:
            smooth = (groups[a] == groups[b]) & (groups[a] != 0)
        smooth &= a != b
        near = first[smooth]
        total[near] = total.take(near, 0) + turned.take(near + shift, 0)
        total[near + shift] = total.take(near + shift, 0) + turned.take(near, 0)
    return unit(total)


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


def _welded(piece: Primitive, normals: Float) -> Primitive:
    """The piece with these normals of its corners; corners of the same vertex and normal are joined."""
    vertex = piece.triangles.reshape(-1)
    bits = normals.astype(np.float32).view(np.int32)
    like = _first_like(vertex, bits)
    first = _ordered(np.flatnonzero(like == np.arange(len(like))), vertex, bits)
    number = np.empty(len(like), np.int64)
    number[first] = np.arange(len(first))
    joined = pick(replace(piece, normals=None), vertex[first])
    return replace(joined, normals=normals[first], triangles=number[like].reshape(-1, 3))


def _ordered(corners: Int, vertex: Int, bits: NDArray[np.int32]) -> Int:
    """Corners by vertex, those of one vertex by their bits (N, 3); few share a vertex, and only those are sorted by bits."""
    corners = corners[np.argsort(vertex[corners], kind="stable")]
    ties = np.zeros(len(corners), np.bool_)
    ties[1:] = vertex[corners[1:]] == vertex[corners[:-1]]
    ties[:-1] |= ties[1:]
    tied = corners[ties]
    corners[ties] = tied[np.lexsort((*bits[tied, ::-1].T, vertex[tied]))]
    return corners


def _first_like(vertex: Int, bits: NDArray[np.int32]) -> Int:
    """For each corner, the first corner with the same vertex and the same bits (N, 3).

    In each round, the first remaining corner of each vertex claims all equal ones. Most vertices have one normal, few more than
    `ROUNDS`.
    """
    like, left = np.arange(len(vertex)), np.arange(len(vertex))
    first = np.empty(int(vertex.max(initial=-1)) + 1, np.int64)
    for _ in range(ROUNDS):
        first[vertex[left[::-1]]] = left[::-1]
        same = np.empty(len(left), np.bool_)
        for part in blocks(len(left)):
            corners = left[part]
            claimant = first[vertex[corners]]
            a, b = bits.take(corners, 0), bits.take(claimant, 0)
            same[part] = (a[:, 0] == b[:, 0]) & (a[:, 1] == b[:, 1]) & (a[:, 2] == b[:, 2])
            like[corners[same[part]]] = claimant[same[part]]
        left = left[~same]
    _, firsts, inverse = np.unique(row_numbers(vertex[left], *bits[left].T), return_index=True, return_inverse=True)
    like[left] = left[firsts][inverse]
    return like


def row_numbers(*columns: NDArray[Any]) -> Int:
    """One number per row, equal for equal rows, in the sort order of rows: much faster than numpy's unique along an axis."""
    order = np.lexsort(columns[::-1])
    steps = np.zeros(len(order), np.int64)
    for column in columns:
        ordered = column[order]
        steps[1:] |= ordered[1:] != ordered[:-1]
    number = np.empty(len(order), np.int64)
    number[order] = np.cumsum(steps)
    return number


def _same_points(positions: Float) -> Int:
    """One number per vertex, equal for equal positions, (V,) int64."""
    return row_numbers(*positions.T)
