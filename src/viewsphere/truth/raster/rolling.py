"""The rasteriser of rolling shutters: the poses of each row as its kernels take them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.camera import inverse_camera_matrix
from viewsphere.geometry.lenses import NEAR, Bounds, Window
from viewsphere.geometry.rotation import inverse, product
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.sensors.rolling import RowPoses
from viewsphere.truth.raster.geometry import Geometry

Float = NDArray[np.float64]

EDGE_ON = 1e-9
"""Height of a camera above the ground that counts as rounding error, relative to its distance from the origin plus a metre."""


class Active(NamedTuple):
    """The triangles that each band of rows may touch, `rows` (n, 6), and their `ends` (bands,): see
    `kernels_rolling.list_active`.
    """

    rows: NDArray[np.int32]
    ends: NDArray[np.int64]


class _RolledWorld(NamedTuple):
    """Vertices and the poses of each row, as `kernels_rolling.list_active` takes them."""

    coordinates: NDArray[np.float32]
    ground: Float
    starts: NDArray[np.int64]
    poses: Float
    slot: NDArray[np.int32]
    moving: Float
    pixels_from_world: Float


def rolled_world(geometry: Geometry, camera: Camera, rows: RowPoses) -> _RolledWorld:
    """The world of a picture's rows."""
    height, k = len(rows.rotation), camera.K
    moved = np.concatenate([rows.rotation, rows.translation[..., None]], axis=2)  # (H, 3, 4)
    m = k[:, :1] * moved[:, 0:1] + k[:, 1:2] * moved[:, 1:2] + k[:, 2:] * moved[:, 2:]
    slot, there = np.full(len(geometry.poses), -1, np.int32), [i for i in rows.moving if i < len(geometry.poses)]
    slot[there] = np.arange(len(there))
    moving = np.stack([rows.moving[i] for i in there]) if there else np.empty((0, height, 4, 4))
    starts = np.array([*geometry.vertex_start, len(geometry.coordinates)], np.int64)
    return _RolledWorld(geometry.coordinates, geometry.ground, starts, geometry.poses, slot, moving, m)


def rolled(
    geometry: Geometry, camera: Camera, rows: RowPoses, samples: int, object_id: int | None, window: Window | None
) -> tuple[Float, NDArray[np.int32], Active]:
    """1/s (0 if none) and triangle (-1 if none) at each sample of `rasterize`, for a camera whose rows have poses of their own.
    Also the triangles that each band of rows may touch.

    RowPoses outside the picture have the poses of its first or its last row.
    """
    from viewsphere.truth.raster import kernels_rolling as kernels

    x0, y0, x1, y1 = (samples * edge for edge in window or (0, 0, camera.width, camera.height))
    nearest, seen = np.zeros((y1 - y0, x1 - x0)), np.full((y1 - y0, x1 - x0), -1, np.int32)
    single = single_of(geometry)
    things = spans_of(geometry)
    chosen = things if object_id is None else things[object_id - 1 : object_id]
    cut = geometry.triangle_cutout, geometry.alpha_masks.arrays
    world, canvas = rolled_world(geometry, camera, rows), (samples, x0, y0)
    size, ends = (x1 - x0, y1 - y0), np.empty(-(-(y1 - y0) // kernels.BAND), np.int64)
    active = kernels.list_active(tuple(world), geometry.triangles, cut[0], chosen, canvas, size, ends)
    edge = edge_on(geometry, rows)
    kernels.draw(tuple(world), geometry.triangles, single, *cut, edge, canvas, active, ends, nearest, seen)
    return nearest, seen, Active(active, ends)


def single_of(geometry: Geometry) -> NDArray[np.bool_]:
    """A mask of the single-sided triangles (T,)."""
    single = np.zeros(len(geometry.triangles), np.bool_)
    single[geometry.single_sided] = True
    return single


def spans_of(geometry: Geometry) -> NDArray[np.int64]:
    """The things, and the ground as the last one, with their first triangles and those after their last ones, (N, 3)."""
    starts = np.array([*geometry.triangle_start, len(geometry.triangles)], np.int64)
    spans = np.column_stack([np.arange(len(starts) - 1), starts[:-1], starts[1:]])
    return spans if geometry.ground_z is not None else spans[:-1]


def edge_on(geometry: Geometry, rows: RowPoses) -> NDArray[np.bool_]:
    """Return a mask of the rows whose camera is in the plane of the ground, as `visibility.is_edge_on` tests it."""
    if geometry.ground_z is None:
        return np.zeros(len(rows.rotation), np.bool_)
    centers = centers_of(rows)
    return np.abs(centers[:, 2] - geometry.ground_z) <= EDGE_ON * (1.0 + np.sqrt((centers * centers).sum(axis=1)))


def centers_of(rows: RowPoses) -> Float:
    """The camera's centre at each row, (H, 3) world metres."""
    return -np.einsum("hji,hj->hi", rows.rotation, rows.translation)


@dataclass(frozen=True, eq=False)
class RowRuns:
    """The triangles that pixels show, once for each row and run of pixels: their corners have places of their own.

    seen (H, W) int32: the run, -1 where nothing is seen. triangles (n, 3) int32: rows of corners (3 n, 4), in homogeneous
    pixels at the run's row. triangle, row (n,): of each run. turns (n, 3, 3): from the world's axes at the instant,
    turned with the run's thing, to the camera's axes at the row.
    """

    seen: NDArray[np.int32]
    triangles: NDArray[np.int32]
    corners: Float
    triangle: NDArray[np.int32]
    row: NDArray[np.int32]
    turns: Float


def row_runs(geometry: Geometry, camera: Camera, rows: RowPoses, seen: NDArray[np.int32]) -> RowRuns:
    """The runs of a picture whose pixels show the triangles seen (H, W)."""
    from viewsphere.truth.raster import kernels_rolling as kernels

    run, (triangle, row) = np.empty(seen.shape, np.int32), np.empty((2, seen.size), np.int32)
    count = kernels.list_runs(seen, run, triangle, row)
    triangle, row = triangle[:count].copy(), row[:count].copy()
    q, owners = np.empty((3 * count, 4)), owners_of(geometry)
    kernels.project_runs(tuple(rolled_world(geometry, camera, rows)), geometry.triangles, owners, triangle, row, q)
    turns, own = rows.rotation[row], owners[triangle]
    for i in rows.moving.keys() & set(np.unique(own).tolist()):
        turned = product(rows.moving[i][:, :3, :3], inverse(geometry.poses[i, :3, :3]))
        chosen = own == i
        turns[chosen] = product(turns[chosen], turned[row[chosen]])
    return RowRuns(run, np.arange(3 * count, dtype=np.int32).reshape(-1, 3), q, triangle, row, turns)


def owners_of(geometry: Geometry) -> NDArray[np.int32]:
    """The thing of each triangle; for the ground, the number of things."""
    return _owners(geometry.triangle_start, len(geometry.triangles))


@lru_cache(maxsize=2)  # with the ground and without; those of a town take 13 MB
def _owners(triangle_start: tuple[int, ...], triangles: int) -> NDArray[np.int32]:
    counts = np.diff([*triangle_start, triangles])
    return np.repeat(np.arange(len(counts), dtype=np.int32), counts)


def _matrices_of(camera: Camera, rows: RowPoses, thing: int, world_from_thing: Float) -> Float:
    """The matrices (H, 3, 4) from a thing's axes to pixels at each row; a thing that does not move stands at a pose (4, 4)."""
    pose = rows.moving.get(thing, np.asarray(world_from_thing, np.float64)[None])
    turned = product(rows.rotation, pose[:, :3])
    turned[..., 3] += rows.translation
    return product(camera.K, turned)


def pixels_in_rows(camera: Camera, rows: RowPoses, thing: int, world_from_thing: Float, points: Float) -> tuple[Float, Float]:
    """The pixels (n, 2) at which a rolling shutter shows points (n, 3) in the axes of a thing of the shot, and their z (n,)
    there; NaN behind the camera. Of several, the one nearest in time to the instant counts.
    """
    from viewsphere.truth.raster import kernels_rolling as kernels

    out = np.empty((len(points), 3))
    m = _matrices_of(camera, rows, thing, world_from_thing)
    kernels.find_pixels(np.ascontiguousarray(points, np.float64), m, out)
    return out[:, :2].copy(), out[:, 2].copy()


def reach_in_rows(camera: Camera, rows: RowPoses, thing: int, world_from_thing: Float, points: Float) -> Bounds | None:
    """The box of all pixels that may show the hull of points (n, 3), in a thing's axes, in any row; None if some are nearer
    than `NEAR` to the camera, or behind it.
    """
    m = _matrices_of(camera, rows, thing, world_from_thing)
    places = np.einsum("hij,nj->hni", m[..., :3], points) + m[:, None, :, 3]
    w = places[..., 2]
    if not (w > NEAR).all():
        return None
    u, v = places[..., 0] / w, places[..., 1] / w
    return float(u.min()), float(v.min()), float(u.max()), float(v.max())


def ways_of_rows(camera: Camera, rows: RowPoses, poses_now: Mapping[int, Float]) -> tuple[Float, Float]:
    """Rays of pixels as a world sees them in which these things have their poses (4, 4) of the instant: for still things, then
    for each of these, matrices (n + 1, H, 3, 3) from pixels (x, y, 1) at each row to the camera's axes at the instant, and the
    world's way (n + 1, H, 3) from the camera's centre at the instant to where the rays begin.
    """
    pixels, backs = inverse_camera_matrix(camera.intrinsics), np.ascontiguousarray(rows.rotation.swapaxes(1, 2))
    centers = -product(backs, rows.translation[..., None])[..., 0]
    turns, shifts = [product(camera.R, product(backs, pixels))], [centers - camera.center]
    for i, now in poses_now.items():
        poses = rows.moving[i]
        turned = product(now[:3, :3], inverse(poses[:, :3, :3]))  # from the row's moment to the instant
        turns.append(product(camera.R, product(turned, product(backs, pixels))))
        begin = product(turned, (centers - poses[:, :3, 3])[..., None])[..., 0] + now[:3, 3]
        shifts.append(begin - camera.center)
    return np.stack(turns), np.stack(shifts)
