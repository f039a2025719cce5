"""Boxes: the eight vertices and six faces of a 3D box, and the 2D box of what a camera projects.

Object axes: front -Y, up +Z; left (+X) and right (-X) are the object's own sides. 2D boxes are half-open
pixel corners (x0, y0, x1, y1).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from viewsphere.geometry.lens import Camera

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
    camera: Camera, vertices: Float, triangles: NDArray[np.int32], is_used: NDArray[np.bool_] | None = None
) -> tuple[Bounds | None, bool]:
    """The 2D box (x0, y0, x1, y1) in pixels of triangles (n, 3) whose corners are world vertices (v, 3), None if the camera
    sees none of them; and whether it sees all. `is_used`, if given: a mask of the vertices that triangles use.
    """
    if not len(triangles):
        return None, True
    if is_used is None:
        is_used = np.zeros(len(vertices), np.bool_)
        is_used[triangles] = True
    return camera.lens.bounds(camera.R, camera.t, vertices, is_used, triangles)
