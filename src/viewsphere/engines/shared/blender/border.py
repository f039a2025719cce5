"""The part of a picture in which anything is visible."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from viewsphere.model.sensors.camera import Camera
from viewsphere.truth.raster.geometry import Geometry
from viewsphere.truth.raster.visibility import homogeneous

Float = NDArray[np.float64]

AROUND = 2
"""Pixels by which Blender's pixel filter spreads a surface."""


def border_of(geometry: Geometry, camera: Camera) -> tuple[int, int, int, int]:
    """Pixels x0, y0, x1, y1 outside of which a pinhole without skew sees nothing of the scene; all 0 if it sees nothing."""
    width, height = camera.width, camera.height
    # Twice of each side: room for surfaces that the filter spreads into the picture. If all hold, z is positive.
    sides = np.array([(1, 0, AROUND), (-1, 0, width + AROUND), (0, 1, AROUND), (0, -1, height + AROUND)], float)
    places = homogeneous(geometry, camera, 0, len(geometry.coordinates))[:, :3]  # also of things beside the picture
    x, y, z = places.T
    beyond = np.zeros(len(places), np.uint8)  # the sides that a vertex is beyond, a bit each
    for bit, (across, down, room) in enumerate(sides):
        beyond |= (across * x + down * y + room * z < 0).astype(np.uint8) << bit
    a, b, c = beyond[geometry.triangles.T]
    is_cut, is_used = ((a | b | c) != 0) & ((a & b & c) == 0), np.zeros(len(places), bool)
    is_used[geometry.triangles[(a | b | c) == 0]] = True
    seen = np.concatenate([places[is_used], _clipped(places[geometry.triangles[is_cut]], sides)])
    seen = seen[seen[:, 2] > 0]
    if not len(seen):
        return 0, 0, 0, 0
    place = seen[:, :2] / seen[:, 2:]
    left, top = (max(math.floor(low) - AROUND, 0) for low in place.min(axis=0))
    right, bottom = (math.ceil(high) + AROUND for high in place.max(axis=0))
    return left, top, min(right, width), min(bottom, height)


def _clipped(polygons: Float, sides: Float) -> Float:
    """The corners (M, 3), some of them repeated, of the parts of convex polygons (N, K, 3) inside all sides.

    Sutherland and Hodgman, Reentrant Polygon Clipping, 1974.
    """
    for side in sides:
        after = np.roll(polygons, -1, axis=1)
        here, there = polygons @ side, after @ side
        crosses = (here >= 0) != (there >= 0)
        share = np.where(crosses, here / np.where(crosses, here - there, 1), 0)
        cut = polygons + (after - polygons) * share[..., None]
        corners = np.stack([polygons, cut], axis=2).reshape(len(polygons), 2 * polygons.shape[1], 3)
        is_kept = np.stack([here >= 0, crosses], axis=2).reshape(corners.shape[:2])
        corners, is_kept = corners[is_kept.any(axis=1)], is_kept[is_kept.any(axis=1)]
        order = np.argsort(~is_kept, axis=1, kind="stable")[:, : max(int(is_kept.sum(axis=1).max(initial=0)), 1)]
        first = np.where(np.take_along_axis(is_kept, order, axis=1), order, order[:, :1])
        polygons = np.take_along_axis(corners, first[..., None], axis=1)
    return polygons.reshape(-1, 3)
