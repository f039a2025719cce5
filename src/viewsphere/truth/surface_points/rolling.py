"""Points of things under a rolling shutter: the place at which the row that is exposed just then shows each one."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.rotation import inverse_pose, product, transform
from viewsphere.model.sensors.rolling import RowPoses
from viewsphere.truth.raster.rolling import pixels_in_rows
from viewsphere.truth.surface_points.raster import Placed, in_lens
from viewsphere.truth.view import View

Float = NDArray[np.float64]
Whole = NDArray[np.int32]


def placed_in_rows(view: View, places: Float, thing: Whole, own: Callable[[], Whole], far: NDArray[np.bool_]) -> Placed:
    """Points in a view whose rows have poses of their own: of several places, the one nearest in time to the instant.

    places (N, 3): in the world at the instant, NaN for points that do not exist, or directions where `far` (N,) is True. thing
    (N,): the position of the thing with which a point moves, below 0 for none. Their `rays` are in the camera's axes of the row
    that shows them: that of the pixel's row or, outside the picture, the first or the last row.
    """
    rows = view.camera.rows
    assert rows is not None
    height = len(rows.rotation)
    xy, seen = np.full((len(places), 2), np.nan), np.full((len(places), 3), np.nan)
    for at, moving, poses, i in _groups(view, rows, thing, far, ~np.isnan(places[:, 0])):
        points = places[at] if i < 0 else transform(inverse_pose(poses), places[at])
        xy[at], _ = pixels_in_rows(view.camera, moving, i, poses, points)
        row = np.clip(np.nan_to_num(np.floor(xy[at, 1])), 0, height - 1).astype(np.intp)
        if i >= 0:
            pose = moving.moving[i][row]
            points = product(pose[:, :3, :3], points[..., None])[..., 0] + pose[:, :3, 3]
        seen[at] = product(moving.rotation[row], points[..., None])[..., 0] + moving.translation[row]
    has_pixel = in_lens(xy)
    near = np.divide(1.0, seen[:, 2], out=np.where(np.isnan(places[:, 0]), np.nan, 0.0), where=has_pixel)
    rays = seen * near[:, None]
    near[far & has_pixel] = 0.0
    return Placed(view, xy, near, rays, own)


def _groups(
    view: View, rows: RowPoses, thing: Whole, far: NDArray[np.bool_], exists: NDArray[np.bool_]
) -> Iterator[tuple[NDArray[np.intp], RowPoses, Float, int]]:
    """Points that move together, by their numbers, with the poses of the rows for them, and their thing with its pose at the
    instant: -1 for points that stand still.
    """
    turned = RowPoses(rows.rotation, np.zeros_like(rows.translation), {})
    moves = np.isin(thing, [*rows.moving]) & ~far
    yield np.flatnonzero(exists & far), turned, np.eye(4), -1
    yield np.flatnonzero(exists & ~far & ~moves), replace(rows, moving={}), np.eye(4), -1
    for i in np.unique(thing[moves & exists]).tolist():
        yield np.flatnonzero(exists & moves & (thing == i)), rows, view.geometry.poses[i], i


def when_shown(view: View, places: Float, thing: Whole, y: Float) -> Float:
    """The places (N, 3) in the world, at the instant, of points on things (N,), at the times when rows show them at y (N,)
    pixels; between the times of two rows where y is between their centres. Those without a pixel are at the instant.
    """
    rows, out = view.camera.rows, places.copy()
    assert rows is not None
    last = len(rows.rotation) - 1
    first = np.clip(np.nan_to_num(np.floor(y - 0.5)), 0, max(last - 1, 0)).astype(np.intp)
    share = np.clip(y - 0.5 - first, 0.0, 1.0)[:, None]
    for i in rows.moving.keys() & set(thing[~np.isnan(y)].tolist()):
        at = np.flatnonzero((thing == i) & ~np.isnan(y))
        points, poses = transform(inverse_pose(view.geometry.poses[i]), places[at])[..., None], rows.moving[i]
        before, after = (
            product(pose[:, :3, :3], points)[..., 0] + pose[:, :3, 3]
            for pose in (poses[first[at]], poses[np.minimum(first[at] + 1, last)])
        )
        out[at] = before + share[at] * (after - before)
    return out
