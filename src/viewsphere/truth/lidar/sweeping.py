"""The hits of a LiDAR's rays, measured all at once, or column by column while things and sensor move."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.rotation import product
from viewsphere.model.sensors.camera import Camera
from viewsphere.truth.raster.geometry import Geometry
from viewsphere.truth.raster.visibility import Visibility, homogeneous, lens_rays, rasterize

Float = NDArray[np.float64]

SECTORS = 36
"""Number of parts of a sweep; in each, all triangles are drawn at their places in the middle of that part."""

GLANCE = np.cos(np.radians(80.0))
"""Cosine of the incidence angle beyond which a point is not moved along the plane of a triangle that the ray misses."""


@dataclass(frozen=True, eq=False)
class Hits:
    """The hits of rays.

    Each hit has its ring, column and triangle (N,), and the distance (N,) in metres. `incidence` (N,) is the angle, 0 to pi/2,
    between the ray and the triangle's normal; `cosine` (N,) is its cosine. `place` (N, 3) is in world metres at the hit's own
    moment. `weights` (N, 3) apply to the triangle's corners.
    """

    ring: NDArray[np.intp]
    column: NDArray[np.intp]
    triangle: NDArray[np.int32]
    distance: Float
    incidence: Float
    cosine: Float
    place: Float
    weights: Float


@dataclass(frozen=True, eq=False)
class Turning:
    """The motion of things and sensor while columns are measured.

    `rotation` (W, 3, 3) and `shift` (W, 3) lead from the world to the sensor at each column's moment. `moved` maps the position
    of each moving thing to its motion (W, 4, 4) from its place at the instant to its place at that moment.
    """

    rotation: Float
    shift: Float
    moved: Mapping[int, Float]


def still_hits(geometry: Geometry, camera: Camera, visibility: Visibility) -> Hits:
    """Return the hits of all rays at the instant; `visibility` is `rasterize(geometry, camera)`."""
    ring, column = np.nonzero(visibility.inverse_depth > 0)
    triangle = visibility.triangle[ring, column]
    distance = 1.0 / visibility.inverse_depth[ring, column].astype(np.float64)
    rays = _rays(camera)[ring, column]
    place = product(camera.R.T, (rays * distance[:, None] - camera.t)[..., None])[..., 0]
    weights = _weights(place, geometry.corners(triangle))
    angle, cosine = _incidence(rays, geometry.triangle_normals, triangle, camera.R)
    return Hits(ring, column, triangle, distance, angle, cosine, place, weights)


def swept_hits(geometry: Geometry, camera: Camera, turning: Turning) -> Hits:
    """Return the hits of each column's rays at its own moment.

    The triangle that a ray meets is looked up in the middle of its sector. The place on the triangle's plane follows from the
    ray's own moment. So points are exact except at outlines, which are off by at most half a sector's motion.
    """
    width, parts = camera.width, list[Hits]()
    edges = np.unique(np.linspace(0, width, SECTORS + 1).round().astype(int)).tolist()
    for first, stop in pairwise(edges):
        middle = (first + stop - 1) // 2
        then = Camera(camera.intrinsics, turning.rotation[middle], turning.shift[middle])
        corners = _moved(geometry, then, turning, middle)
        seen = rasterize(geometry, then, window=(first, 0, stop, camera.height), corners=corners)
        ring, column = np.nonzero(seen.inverse_depth > 0)
        distance = 1.0 / seen.inverse_depth[ring, column].astype(np.float64)
        parts.append(_own_moment(geometry, camera, turning, (ring, column + first, seen.triangle[ring, column], distance)))
    order = np.argsort(np.concatenate([part.ring * width + part.column for part in parts]), kind="stable")
    return Hits(*(np.concatenate([getattr(part, one.name) for part in parts])[order] for one in fields(Hits)))


def _moved(geometry: Geometry, camera: Camera, turning: Turning, column: int) -> Float:
    """Return all vertices at their places at a column's moment, in the camera's axes at that moment.

    See `truth.raster.visibility.homogeneous`.
    """
    from viewsphere.truth.raster import kernels_draw as kernels

    q, m = homogeneous(geometry, camera), np.column_stack((camera.R, camera.t))
    for i, motion in turning.moved.items():
        rows = slice(geometry.vertex_start[i], geometry.vertex_start[i + 1])
        placed = _transformed(motion[column], geometry.places(i))
        kernels.transform(placed, 0, len(placed), m, q[rows])
    return q


def _own_moment(geometry: Geometry, camera: Camera, turning: Turning, found: tuple[Any, Any, Any, Float]) -> Hits:
    """Hits (ring, column, triangle, distance) at the middle of a sector, moved to the moments of their columns."""
    ring, column, triangle, distance = found
    rays = _rays(camera)[ring, column]
    corners = geometry.corners(triangle)
    for i, motion in turning.moved.items():
        own = np.flatnonzero((triangle >= geometry.triangle_start[i]) & (triangle < geometry.triangle_start[i + 1]))
        corners[own] = _transformed(motion[column[own]][:, None], corners[own])
    placed = product(turning.rotation[column][:, None], corners[..., None])[..., 0] + turning.shift[column][:, None]
    a, b, c = (placed[:, i] for i in range(3))
    normal = np.cross(b - a, c - a)
    along = (normal * rays).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        again = (normal * a).sum(axis=1) / along
    own = np.arange(len(rays), dtype=np.int32)
    incidence, cosine = _incidence(rays, normal, own, np.eye(3))
    sides = np.stack([(np.cross(p, q) * rays).sum(axis=1) for p, q in ((b, c), (c, a), (a, b))])
    inside = (sides >= 0).all(axis=0) | (sides <= 0).all(axis=0) | (triangle >= geometry.triangle_start[-1])
    sure = np.isfinite(again) & (again > 0) & (inside | (cosine > GLANCE))
    distance = np.where(sure, again, distance)
    seen = rays * distance[:, None]
    back = turning.rotation[column].swapaxes(1, 2)
    place = product(back, (seen - turning.shift[column])[..., None])[..., 0]
    weights = _weights(seen, placed)
    return Hits(ring, column, triangle, distance, incidence, cosine, place, weights)


def _weights(points: Float, corners: Float) -> Float:
    """Weights (N, 3) of the corners (N, 3, 3) of triangles at points (N, 3) of their planes."""
    from viewsphere.truth.lidar import kernels_lidar as kernels

    out = np.empty((len(points), 3))
    kernels.weights(points, corners, out)
    return out


def _transformed(motion: Float, points: Float) -> Float:
    """Points (..., 3) moved by matrices (..., 4, 4)."""
    return product(motion[..., :3, :3], points[..., None])[..., 0] + motion[..., :3, 3]


def _rays(camera: Camera) -> Float:
    rays = lens_rays(camera)
    if rays is None:
        raise ValueError("expected the rays of a LiDAR, found a pinhole's")
    return rays


def _incidence(rays: Float, normals: NDArray[np.floating], chosen: NDArray[np.int32], rotation: Float) -> tuple[Float, Float]:
    """The angles (N,) between rays (N, 3) and the chosen (N,) normals, and their cosines (N,). The rotation maps normals to the
    rays' axes.
    """
    from viewsphere.truth.lidar import kernels_lidar as kernels

    angle, cosine = np.empty((2, len(rays)))
    kernels.incidence(rays, normals, chosen, rotation, angle, cosine)
    return angle, cosine
