"""The triangle of a view that each point meets first, and so the hidden points: exact, for any lens.

The points of a distorted lens are sorted by pinholes at the same place: one that shows all points, or the six sides of a cube.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.camera import project
from viewsphere.geometry.rotation import product
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.truth.kernel_constants import FOUR, NEARER
from viewsphere.truth.raster.visibility import pixels_of, projected
from viewsphere.truth.view import View

Float = NDArray[np.float64]
Whole = NDArray[np.int32]
VISIBLE, OCCLUDED, OUTSIDE, BEHIND, INVALID = range(5)
"""States of a point in a view; later ones take precedence.

INVALID: it does not exist (its thing is absent or has other triangles, or it is on a flat picture). BEHIND: it is behind the
camera, or the lens has no pixel for its direction. OUTSIDE: it is not in [0, W) x [0, H). OCCLUDED: the segment from the
camera's centre to the point meets a triangle other than its own, nearer by more than `GAP` of its depth; or its own triangle is
single-sided and faces away from the camera.
"""

GAP = 1e-6  # share of the depth: above the rounding of one depth computed twice, below the gap of surfaces. Not measured alone
FACES = ((0, 1, 2, 1.0), (0, 1, 2, -1.0), (1, 2, 0, 1.0), (1, 2, 0, -1.0), (2, 0, 1, 1.0), (2, 0, 1, -1.0))
"""Sides of the cube around a fisheye or a scan: the axes for right and down, the axis that the side faces, and its sign."""

NARROW = 1e-6  # least width of a picture of one row, at z = 1: above the rounding of its pixels. Not measured alone
LARGEST_SIDE = 1024  # pixels along a side of the cube


@dataclass(frozen=True, eq=False)
class Placed:
    """Points in a view, in arrays of any one shape.

    xy (..., 2) float64 pixels, NaN if the lens has none. near (...) float64: 1/s, with s as in `raster.visibility.Visibility`;
    0 for points at infinity and for points without a pixel, NaN for points that do not exist. rays (..., 3) in camera axes, so
    that the point is ray / near: None for a pinhole, which needs none, unless it has a rolling shutter: then they are in the
    axes of the camera at the time of the point's row. `own` gives (...) int32: the view's triangle under the
    point, -1 for none; the ground's triangles count as one.
    """

    view: View
    xy: Float
    near: Float
    rays: Float | None
    own: Callable[[], Whole]


def in_lens(xy: Float) -> NDArray[np.bool_]:
    """Return a mask of the points that have pixels in the lens, given their pixels (..., 2) as in `Placed`."""
    return ~np.isnan(xy[..., 0])


def placed_at(view: View, points: Float, own: Callable[[], Whole]) -> Placed:
    """Points (N, 3) in a view's camera axes, none of them at infinity."""
    return Placed(view, *pixels_at(view, points), own)


def pixels_at(view: View, points: Float) -> tuple[Float, Float, Float | None]:
    """The positions of these points in the view's picture: xy, near and rays as in `Placed`."""
    xy, _ = project(view.camera.intrinsics, points)
    if view.has_unit_rays:
        x, y, z = points.T
        s = np.sqrt(x * x + y * y + z * z)
    else:
        s = points[:, 2]
    near = np.divide(1.0, s, out=np.where(np.isnan(s), np.nan, 0.0), where=in_lens(xy))
    return xy, near, None if view.is_pinhole else points * near[:, None]


def positions_along(view: View, rays: Float, near: Float) -> Float:
    """Positions (..., 2) in the view's picture of the points rays / near; NaN where the lens shows none."""
    if not view.is_parallel:
        return project(view.camera.intrinsics, rays)[0]
    with np.errstate(all="ignore"):  # points at infinity, and places that a caller fills later
        return project(view.camera.intrinsics, rays / near[..., None])[0]


def states(placed: Sequence[Placed]) -> list[NDArray[np.uint8]]:
    """The states (...) uint8 of each set of points. All sets are in one view, so its triangles are drawn once."""
    from viewsphere.truth.surface_points import kernels_points as kernels

    view = placed[0].view
    if any(points.view is not view for points in placed):
        raise ValueError("states: expected points of one view, got several views")
    xy = _joined([points.xy.reshape(-1, 2) for points in placed])
    near = _joined([points.near.reshape(-1) for points in placed])
    own_triangles = _joined([points.own().reshape(-1) for points in placed])
    has_rays = not view.is_pinhole or view.camera.rows is not None
    rays = _joined([p.rays.reshape(-1, 3) for p in placed if p.rays is not None]) if has_rays else None
    state, cell = _classified(xy, near, (view.camera.width, view.camera.height))
    if view.camera.rows is not None and rays is not None:
        _hide_in_rows(view, near, rays, own_triangles, cell, state)
    else:
        for index, met in _meetings(view, xy, near, own_triangles, cell, rays):
            kernels.hide(met, index, np.uint8(OCCLUDED), state)
        if view.shown is not view.geometry:
            state[(state == VISIBLE) & view.is_turned_away(own_triangles)] = OCCLUDED
    stops = np.cumsum([points.near.size for points in placed])[:-1]
    return [part.reshape(points.near.shape) for part, points in zip(np.split(state, stops), placed, strict=True)]


def _hide_in_rows(view: View, near: Float, rays: Float, own: Whole, cell: Whole, state: NDArray[np.uint8]) -> None:
    """Write the states of the points whose pixel `cell` is not -1: those of pictures of single rows, in which the world and the
    camera are at the row's time.
    """
    inside = np.flatnonzero(cell >= 0)
    inside = inside[np.argsort(cell[inside], kind="stable")]
    row = cell[inside] // view.camera.width
    for at in np.split(inside, np.flatnonzero(np.diff(row)) + 1) if len(inside) else ():
        lens, xy = _strip(view.camera.width, rays[at])
        strip = view.at_row(int(cell[at[0]]) // view.camera.width, lens)
        state[at] = states([Placed(strip, xy, near[at], None, partial(own.take, at))])[0]


def _strip(width: int, rays: Float) -> tuple[Intrinsics, Float]:
    """A pinhole with pictures of one row that shows all rays (N, 3), whose z is 1, and their pixels (N, 2)."""
    low, high, size = rays[:, :2].min(axis=0), rays[:, :2].max(axis=0), np.array([width, 1.0])
    (fx, fy), (u, v) = size / np.maximum((high - low) * (1 + 1e-9), NARROW), low
    lens = Intrinsics(width=width, height=1, fx=fx, fy=fy, cx=-fx * u, cy=-fy * v)
    xy = rays[:, :2] * (fx, fy) + (lens.cx, lens.cy)
    return lens, np.clip(xy, 0.0, np.nextafter(size, 0.0))


def _classified(xy: Float, near: Float, size: tuple[int, int]) -> tuple[NDArray[np.uint8], Whole]:
    """The states of points that follow from their places alone, and their pixels; see `kernels_points.classify`."""
    from viewsphere.truth.surface_points import kernels_points as kernels

    state, cell = np.empty(len(near), np.uint8), np.empty(len(near), np.int32)
    kernels.classify(np.ascontiguousarray(xy).reshape(-1), near, *size, state, cell)
    return state, cell


def _joined(arrays: Sequence[NDArray[Any]]) -> NDArray[Any]:
    return arrays[0] if len(arrays) == 1 else np.concatenate(arrays)


def first_met(
    view: View,
    xy: Float,
    near: Float,
    own: Whole,
    rays: Float | None = None,
    chosen: NDArray[np.bool_] | None = None,
) -> Whole:
    """The triangle that the ray to each point meets first before the point, (N,) int32, -1 where it meets none.

    Points are as in `Placed`. For points at `near` 0, any triangle in front counts. Points that are not `chosen` (by default
    all are), or are not in the picture, meet nothing.
    """
    from viewsphere.truth.surface_points import kernels_points as kernels

    triangle = np.full(len(near), -1, np.int32)
    _, cell = _classified(xy, near, (view.camera.width, view.camera.height))
    if chosen is not None:
        cell[~chosen] = -1
    for index, met in _meetings(view, xy, near, own, cell, rays):
        kernels.mark(met, index, triangle)
    return triangle


def _meetings(view: View, xy: Float, near: Float, own: Whole, cell: Whole, rays: Float | None) -> Iterator[tuple[Whole, Whole]]:
    """Points, by their numbers (n,), and the triangle that each of them meets first (n,), -1 for none; see `first_met`.

    The points are those whose pixel `cell` is not -1.
    """
    if rays is None or view.is_parallel:
        yield _meet(view, view.corners, view.boxes, (view.camera.width, view.camera.height), xy, near, own, cell)
        return
    index = np.flatnonzero(cell >= 0).astype(np.int32)
    for q, size, at, own_xy, own_near in _pinholes(view, rays[index], near[index]):
        _, own_cell = _classified(own_xy, own_near, size)
        order, met = _meet(view, q, pixels_of(view.geometry, q, size), size, own_xy, own_near, own[index[at]], own_cell)
        yield index[at][order], met


def _meet(
    view: View, q: Float, box: Whole, size: tuple[int, int], xy: Float, near: Float, own: Whole, cell: Whole
) -> tuple[Whole, Whole]:
    """`_meetings` for a pinhole or parallel rays, with a picture of this size; q: its `homogeneous` vertices, box: their pixels
    (`pixels_of`).
    """
    from viewsphere.truth.raster import kernels_parallel
    from viewsphere.truth.surface_points import kernels_points as kernels

    geometry, (width, height) = view.geometry, size
    ground, cut = np.int32(geometry.triangle_start[-1]), (view.shown.triangle_cutout, geometry.alpha_masks.arrays)
    clear = ground if ground < len(geometry.triangles) else np.int32(-1)
    start, far, covered = np.empty(width * height + 2, np.int32), np.empty((height, width)), np.empty(width * height, np.bool_)
    order, number = np.empty(len(near), np.int32), np.empty(len(near) + FOUR, np.int32)
    points, nearest = np.empty((2, len(near) + FOUR)), np.empty(len(near) + FOUR)
    kernels.cover(box, np.array(geometry.vertex_start), width, height, covered)
    sorted_by = (start, order, points, nearest, number, far.reshape(-1))
    inside = kernels.sort(xy, near, (1.0 + GAP) / NEARER, own, cell, covered, ground, clear, *sorted_by)
    met = np.full(inside + FOUR, -1, np.int32)
    if inside:
        surfaces = q, box, geometry.triangles, ground, *cut, size, start, points, nearest, met, number
        if view.is_parallel:
            kernels_parallel.meet(*surfaces)
        else:
            kernels.meet(*surfaces, far)
    return order[:inside], met[:inside]


def _pinholes(view: View, rays: Float, near: Float) -> Iterator[tuple[Float, tuple[int, int], NDArray[np.intp], Float, Float]]:
    """Pinholes that together show all points of a distorted lens: the vertices projected by each one, its size, the points that
    it shows, their pixels and their 1/z in it.
    """
    side = 1.0
    if view.has_unit_rays:
        axis = np.argmax(np.abs(rays), axis=1)
        count = min(max(math.ceil(math.sqrt(len(near))), 16), LARGEST_SIDE)
        for right, down, ahead, sign in FACES:
            at = np.flatnonzero((axis == ahead) & (rays[:, ahead] * sign > 0.0))
            if len(at):
                turned = np.zeros((3, 3))
                turned[0, right], turned[1, down], turned[2, ahead] = 1.0, sign, sign
                yield _pinhole(view, turned, rays[at], near[at], at, (count, count), (-side, -side, side, side))
        return
    if len(near):
        low, high = rays[:, :2].min(axis=0), rays[:, :2].max(axis=0)
        bounds = (float(low[0]), float(low[1]), float(high[0]), float(high[1]))
        size = (view.camera.width, view.camera.height)
        yield _pinhole(view, np.eye(3), rays, near, np.arange(len(near)), size, bounds)


def _pinhole(
    view: View,
    turned: Float,
    rays: Float,
    near: Float,
    at: NDArray[np.intp],
    size: tuple[int, int],
    bounds: tuple[float, float, float, float],
) -> tuple[Float, tuple[int, int], NDArray[np.intp], Float, Float]:
    """The pinhole of this size whose picture shows x/z and y/z within `bounds`, turned from the view's camera axes."""
    u0, v0, u1, v1 = bounds
    du, dv = size[0] / ((u1 - u0) * (1 + 1e-9) or 1.0), size[1] / ((v1 - v0) * (1 + 1e-9) or 1.0)
    k = np.array([[du, 0.0, -du * u0], [0.0, dv, -dv * v0], [0.0, 0.0, 1.0]])
    q = projected(view.geometry, product(k, product(turned, np.column_stack((view.camera.R, view.camera.t)))))
    x, y, z = product(turned, rays.T)
    xy = np.column_stack((du * (x / z) - du * u0, dv * (y / z) - dv * v0))
    return q, size, at, np.clip(xy, 0.0, np.nextafter(np.array(size, np.float64), 0.0)), near / z
