"""The 2D boxes of projected geometry: half-open pixel corners (x0, y0, x1, y1)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.lenses import NEAR, Bounds, Camera
from viewsphere.geometry.seam import clip_to_turn

Float = NDArray[np.float64]

ROUNDING = 1e-9
"""Rounding error of a sum of coordinates, in metres per metre; a generous upper bound."""


def clip_to_image(bounds: Bounds, width: int, height: int) -> Bounds | None:
    """The part of a 2D box inside the image [0, width] x [0, height]; None if there is none."""
    x0, y0, x1, y1 = bounds
    if not (x1 > 0 and y1 > 0 and x0 < width and y0 < height):
        return None
    return max(x0, 0.0), max(y0, 0.0), min(x1, float(width)), min(y1, float(height))


def clip_to_picture(bounds: Bounds, camera: Camera) -> Bounds | None:
    """The part of a 2D box inside a camera's picture, which has no left and right border if it shows a full turn; None if
    there is none.
    """
    if camera.lens.period is not None:
        return clip_to_turn(bounds, float(camera.height))
    return clip_to_image(bounds, camera.width, camera.height)


def overlap(a: Bounds, b: Bounds) -> bool:
    """Return whether two 2D boxes share more than an edge."""
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def is_behind(camera: Camera, bounds: Float) -> bool:
    """Return whether a world box (2, 3), given by its lowest and highest corners, has no part in front of a pinhole's z =
    NEAR.
    """
    terms = camera.R[2] * bounds
    farthest = float(terms.max(axis=0).sum() + camera.t[2])
    return farthest + ROUNDING * (1 + float(np.abs(terms).max())) < NEAR


def projected_bounds(
    camera: Camera, vertices: Float, triangles: NDArray[np.int32], is_used: NDArray[np.bool_] | None = None
) -> tuple[Bounds | None, bool]:
    """The 2D box (x0, y0, x1, y1) in pixels of triangles (n, 3), and whether the camera sees all of them.

    `vertices` (v, 3) are the corners in the world; `is_used`, if given, masks the vertices that triangles use. The box is None
    if the camera sees no triangle.
    """
    if not len(triangles):
        return None, True
    if is_used is None:
        is_used = np.zeros(len(vertices), np.bool_)
        is_used[triangles] = True
    return camera.lens.bounds(camera.R, camera.t, vertices, is_used, triangles)
