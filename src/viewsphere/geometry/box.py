"""Boxes: the eight vertices and six faces of a 3D box, and the 2D box of what a camera projects.

Object axes: front -Y, up +Z; left (+X) and right (-X) are the object's own sides. 2D boxes are half-open
pixel corners (x0, y0, x1, y1).
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from viewsphere.geometry.lens import Camera, Distortion

Float = NDArray[np.float64]
Bounds = tuple[float, float, float, float]

VERTEX_SIGNS = (
    (1, 1, -1),
    (1, -1, -1),
    (-1, -1, -1),
    (-1, 1, -1),
    (1, 1, 1),
    (1, -1, 1),
    (-1, -1, 1),
    (-1, 1, 1),
)
"""Side of the box's centre each vertex lies on, in x, y and z; the order of Ruiz et al. 2019."""

FACES: dict[str, tuple[int, int, int, int]] = {
    "bottom": (0, 1, 2, 3),
    "top": (4, 7, 6, 5),
    "right": (2, 6, 7, 3),
    "front": (1, 5, 6, 2),
    "left": (0, 4, 5, 1),
    "back": (4, 0, 3, 7),
}
"""Vertices of each face, in the order of Ruiz et al. 2019 (who call the bottom `ground`)."""

EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))
"""The twelve edges, as pairs of vertices."""

NEAR = 1e-6
"""Distance in front of the camera, metres, from which on geometry is projected; nearer parts are cut off."""

ROUNDING = 1e-9
"""By how much, in metres a metre, a sum of coordinates may miss the depth that it stands for: generously."""

KNOTS = 1024
"""Steps, from its axis to its limit, of the table that says how much the lens bends lines."""

RIM = 1 << 14
"""Number of directions along a lens' limit at which its rim is searched."""


def box_vertices(low: ArrayLike, high: ArrayLike) -> Float:
    """The eight vertices (8, 3) of an axis-aligned box between two corners, in the order of `VERTEX_SIGNS`."""
    return np.where(np.array(VERTEX_SIGNS) > 0, np.asarray(high, np.float64), np.asarray(low, np.float64))


def box_size(vertices: Float) -> tuple[float, float, float]:
    """(width along X, height along Z, length along Y) of an axis-aligned box given by its vertices (8, 3)."""
    x, y, z = (vertices[4] - vertices[2]).tolist()
    return x, z, y


def clip_to_image(bounds: Bounds, width: int, height: int) -> Bounds | None:
    """The part of a 2D box inside the image [0, width] x [0, height]; None if there is none."""
    x0, y0, x1, y1 = bounds
    if not (x1 > 0 and y1 > 0 and x0 < width and y0 < height):
        return None
    return max(x0, 0.0), max(y0, 0.0), min(x1, float(width)), min(y1, float(height))


def overlap(a: Bounds, b: Bounds) -> bool:
    """Return whether two 2D boxes share more than an edge."""
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def is_behind(camera: Camera, bounds: Float) -> bool:
    """Return whether nothing in a box in the world, its lowest and its highest corner (2, 3), is in front of a pinhole's z =
    NEAR.
    """
    terms = camera.R[2] * bounds
    farthest = float(terms.max(axis=0).sum() + camera.t[2])
    return farthest + ROUNDING * (1 + float(np.abs(terms).max())) < NEAR


def projected_bounds(
    camera: Camera,
    vertices: Float,
    triangles: NDArray[np.int32],
    faces: tuple[int, int],
    points: tuple[int, int],
    is_used: NDArray[np.bool_] | None = None,
) -> tuple[Bounds | None, bool]:
    """The 2D box (x0, y0, x1, y1) in pixels of triangles [faces) whose corners are world vertices [points), and whether the
    camera sees all of the triangles. `is_used`, if given: a mask of the vertices that triangles use. In a scan, the box spans
    the full circle if the triangles do, or if they cross its first and last column.

    Triangles that cross the plane z = NEAR of the camera (or the limit of a distorted lens) are cut there.
    None if no part of them is in front of the camera. Under lens distortion straight edges bend; the box is
    that of the bent edges, to 1e-5 px.
    """
    from viewsphere.geometry import kernels_bent
    from viewsphere.geometry import kernels_box as kernels

    if faces[0] == faces[1]:
        return None, True
    if is_used is None:
        is_used = np.zeros(len(vertices), np.bool_)
        is_used[triangles[faces[0] : faces[1]]] = True
    base, stop = points
    used = is_used[base:stop]
    if camera.distortion is not None and camera.distortion.model == "scan":
        return _scanned(camera, vertices[base:stop], used, triangles[faces[0] : faces[1]] - np.int32(base)), True
    if camera.distortion is not None:
        lens, rim = _bent_lens(camera.distortion, camera.K)
        room = np.empty((stop - base, 6))
        box, whole = kernels_bent.bent_bounds(vertices, used, base, triangles, *faces, camera.R, camera.t, lens, rim, room)
        return (box if box[0] <= box[2] else None), whole
    x0, y0, x1, y1, front = kernels.whole_bounds(vertices, used, base, camera.K, camera.R, camera.t, NEAR)
    if front:
        return (x0, y0, x1, y1), True
    x0, y0, x1, y1, whole = kernels.cut_bounds(vertices, triangles, *faces, *points, camera.K, camera.R, camera.t, NEAR)
    return ((x0, y0, x1, y1) if x0 <= x1 else None), bool(whole)


def _scanned(camera: Camera, vertices: Float, used: NDArray[np.bool_], triangles: NDArray[np.int32]) -> Bounds:
    """The 2D box of triangles (n, 3) of vertices (v, 3) in a scan."""
    from viewsphere.geometry import kernels_scan
    from viewsphere.geometry.camera import coefficients

    assert camera.distortion is not None
    room = np.empty((len(vertices), 5))
    u0, v0, u1, v1 = kernels_scan.bounds(vertices, used, triangles, camera.R, camera.t, coefficients(camera.distortion), room)
    (fx, skew, cx), (_, fy, cy), _ = camera.K.tolist()
    assert skew == 0
    return fx * u0 + cx, fy * v0 + cy, fx * u1 + cx, fy * v1 + cy


def _bent_lens(lens: Distortion, matrix: Float) -> tuple[tuple[Any, ...], Float]:
    """A lens as `kernels_bent` takes it, and its rim: the directions (M, 3) at its limit where u or v is extreme."""
    from viewsphere.geometry.camera import coefficients, lens_limit

    fisheye, k = lens.model == "fisheye", coefficients(lens)
    limit = lens_limit(lens) if fisheye else min(float(np.nextafter(lens_limit(lens), 0)), 1 / NEAR)
    skew = float(matrix[0, 1] / matrix[0, 0])
    return (fisheye, k, limit, matrix, _bends(fisheye, tuple(k.tolist()), limit)), _rim(fisheye, tuple(k.tolist()), limit, skew)


@lru_cache(maxsize=64)
def _bends(fisheye: bool, k: tuple[float, ...], limit: float) -> Float:
    from viewsphere.geometry import kernels_bent

    table = np.empty(KNOTS + 1)
    kernels_bent.tabulate(fisheye, np.array(k), limit, table)
    return table


@lru_cache(maxsize=64)
def _rim(fisheye: bool, k: tuple[float, ...], limit: float, skew: float) -> Float:
    """Directions (M, 3) along a lens' limit whose pixels are locally farthest left, right, up or down."""
    from viewsphere.geometry import kernels_lens as kernels

    turn, within = np.linspace(0, 2 * np.pi, RIM, endpoint=False), limit * (1 - 1e-12)
    r, z = (math.sin(within), math.cos(within)) if fisheye else (within, 1.0)
    directions = np.stack([r * np.cos(turn), r * np.sin(turn), np.full(RIM, z)], axis=1)
    seen = np.empty((RIM, 2))
    (kernels.distort_fisheye if fisheye else kernels.distort_brown)(np.array(k), limit, directions, seen)
    turns = np.zeros(RIM, np.bool_)
    for along in (seen[:, 0] + skew * seen[:, 1], seen[:, 1]):
        turns |= (along > np.roll(along, 1)) != (np.roll(along, -1) > along)
    return directions[turns]
