"""Polygons to triangles."""

from __future__ import annotations

import numpy as np

from viewsphere.assets.primitive import Float, Int
from viewsphere.assets.transform import unit

MAX_EARS = 2_048
"""Polygons with more corners are cut as a fan, even concave ones: cutting ears takes quadratic time."""


def triangulate(positions: Float, corners: Int, counts: Int) -> tuple[Int, Int]:
    """Cut polygons into triangles, in order.

    `corners` are all polygons' vertices one after another and `counts` (at least 3) how many each has.
    Returns the triangles (T, 3) as indices into `corners`, n - 2 for each polygon, and the polygon of each
    (T,). A polygon is cut as a fan; a quadrilateral whose fan would fold is cut along its other diagonal, and
    a larger one by its ears.
    """
    starts = np.cumsum(counts) - counts
    owner = np.repeat(np.arange(len(counts)), counts - 2)
    first = np.cumsum(counts - 2) - (counts - 2)
    step = np.arange(len(owner)) - first[owner]
    base = starts[owner]
    triangles = np.column_stack([base, base + step + 1, base + step + 2])
    many = np.flatnonzero(counts > 3)
    if not many.size:
        return triangles, owner
    points = positions[corners]
    lean, normals = _lean(points, triangles, owner, first)
    folded = many[lean[many] <= 0]
    quads = folded[counts[folded] == 4]
    if quads.size:
        other = starts[quads, None] + np.array([1, 2, 3, 1, 3, 0])
        other = other.reshape(-1, 3)
        other_lean, _ = _lean(points, other, np.repeat(np.arange(len(quads)), 2), 2 * np.arange(len(quads)))
        better = np.flatnonzero(other_lean > lean[quads])
        at = first[quads[better]]
        triangles[at], triangles[at + 1] = other[2 * better], other[2 * better + 1]
    for polygon in folded[(counts[folded] > 4) & (counts[folded] <= MAX_EARS)]:
        start, count = int(starts[polygon]), int(counts[polygon])
        flat = _flattened(points[start : start + count], normals[polygon])
        if flat is not None:
            triangles[first[polygon] : first[polygon] + count - 2] = start + _ears(flat)
    return triangles, owner


def _lean(points: Float, triangles: Int, owner: Int, first: Int) -> tuple[Float, Float]:
    """For each polygon the least component of its triangles' normals along its own, and that normal."""
    a, b, c = (points[triangles[:, i]] for i in range(3))
    faces = np.cross(b - a, c - a)
    normals = np.add.reduceat(faces, first)
    along = np.einsum("ij,ij->i", faces, normals[owner])
    return np.minimum.reduceat(np.nan_to_num(along), first), normals


def _flattened(points: Float, normal: Float) -> Float | None:
    """The polygon's points (n, 2) in its own plane, counter-clockwise; None if the polygon has no area."""
    # Neither @ nor the norm of one vector: BLAS, which rounds by processor, does both.
    (z,) = unit(normal[None])
    if not z.any() or not np.isfinite(z).all() or not np.isfinite(points).all():
        return None
    (x,) = unit(np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)[None])
    from_first = points - points[0]
    return np.column_stack([(from_first * axis).sum(axis=1) for axis in (x, np.cross(z, x))])


def _ears(points: Float) -> Int:
    """Triangles (n - 2, 3) of a simple polygon (n, 2), counter-clockwise, cut ear by ear."""
    ring = np.arange(len(points))
    triangles: list[tuple[int, int, int]] = []
    while len(ring) > 3:
        before, after = np.roll(ring, 1), np.roll(ring, -1)
        turn = _turn(points[before], points[ring], points[after])
        order = np.flatnonzero(turn > 0)
        ear = next(
            (int(i) for i in order if _is_empty(points, ring, before[i], ring[i], after[i])),
            int(np.argmax(turn)),
        )
        triangles.append((int(before[ear]), int(ring[ear]), int(after[ear])))
        ring = np.delete(ring, ear)
    triangles.append((int(ring[0]), int(ring[1]), int(ring[2])))
    return np.array(triangles)


def _turn(a: Float, b: Float, c: Float) -> Float:
    """Twice the signed area of triangles a b c in the plane."""
    u, v = b - a, c - b
    return u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]


def _is_empty(points: Float, ring: Int, a: int, b: int, c: int) -> bool:
    """Whether no other point of the ring lies in this triangle."""
    others = points[ring]
    corners = points[[a, b, c]]
    inside = np.ones(len(others), bool)
    for i in range(3):
        inside &= _turn(corners[i], corners[(i + 1) % 3], others) >= 0
        inside &= (others != corners[i]).any(axis=1)
    return not inside.any()
