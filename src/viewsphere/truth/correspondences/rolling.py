"""Correspondence under a rolling shutter: each pixel's point is where it is at the time of its row, and goes to the place at
which the row that is exposed just then shows it in the other picture.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.camera import inverse_camera_matrix
from viewsphere.geometry.rotation import inverse, product, transform
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.sensors.rolling import RowPoses
from viewsphere.truth.correspondences.correspondence import Match, own_triangles, pixel_centers
from viewsphere.truth.kernel_constants import GONE, OTHER
from viewsphere.truth.raster.visibility import Visibility
from viewsphere.truth.surface_points.raster import Placed
from viewsphere.truth.surface_points.rolling import placed_in_rows
from viewsphere.truth.view import View

Float = NDArray[np.float64]
Whole = NDArray[np.int32]
Mask = NDArray[np.bool_]

SKY = -1


def match_between(view: View, visibility: Visibility, other: View) -> Match:
    """The points of a view's pixels in another view. Raises ValueError for things that deform under a rolling shutter."""
    if view.camera.rows is None and other.camera.rows is None:
        return Match(view, visibility, other)
    return _RollingMatch(_with_rows(view), visibility, _with_rows(other))


def _with_rows(view: View) -> View:
    """The view with the poses of its rows, which are equal while nothing moves."""
    camera = view.camera
    if camera.rows is not None:
        return view
    rows = RowPoses(np.tile(camera.R, (camera.height, 1, 1)), np.tile(camera.t, (camera.height, 1)), {})
    return replace(view, camera=replace(camera, rows=rows))


def _rows(camera: Camera) -> RowPoses:
    assert camera.rows is not None
    return camera.rows


@dataclass(frozen=True, eq=False)
class _RollingMatch(Match):
    """The points of one view's pixels in another view, both with poses for each row. Positions are those nearest in time to the
    other instant; places and depths are in the axes of the camera at the time of the row.
    """

    @cached_property
    def flow(self) -> NDArray[np.float32]:
        """The offset of `xy` from the centres of the pixels, (H, W, 2)."""
        return self.offset.astype(np.float32)

    @cached_property
    def xyz(self) -> Float:
        """The places of the points at the time of the row that shows them, in the other camera's axes at that time, (H, W, 3)
        metres; at the other instant for points without a pixel.

        They are NaN for points that do not exist then, and (NaN, NaN, inf) for the sky.
        """
        near, rays, camera = self.placed.near.reshape(-1), self.placed.rays, self.other.camera
        assert rays is not None
        out = transform(camera.R, self._places) + camera.t
        has_pixel, at_rest = near > 0.0, self._rests & (self._things != SKY)
        out[has_pixel] = rays.reshape(-1, 3)[has_pixel] / near[has_pixel, None]
        out[at_rest] = self._here[at_rest]
        out[self._things == SKY] = np.nan
        out[(self._things == SKY) & (near == 0.0), 2] = np.inf
        return out.reshape(*self._inverse.shape, 3)

    @cached_property
    def scene_flow(self) -> NDArray[np.float32]:
        """The motion of each point between the camera's axes at the times of its rows, (H, W, 3) metres; NaN for the sky."""
        out = self.xyz - self._here.reshape(*self._inverse.shape, 3)
        out[self._inverse == 0.0] = np.nan
        return out.astype(np.float32)

    @cached_property
    def placed(self) -> Placed:
        """The points in the other view, as `surface_points.raster.states` takes them."""
        shape, things, own = self._inverse.shape, self._things, partial(own_triangles, self.visibility, self.view, self.other)
        found = placed_in_rows(self.other, self._places, things, own, (things == SKY) & ~np.isnan(self._places[:, 0]))
        assert found.rays is not None
        still = np.flatnonzero(self._rests)
        found.xy[still], found.near[still] = pixel_centers(shape).reshape(-1, 2)[still], self._inverse.reshape(-1)[still]
        found.rays[still] = self._rays_here[still]
        return Placed(self.other, found.xy.reshape(*shape, 2), found.near.reshape(shape), found.rays.reshape(*shape, 3), own)

    @cached_property
    def _things(self) -> Whole:
        """The thing of each pixel (H W,); for the ground, the number of things."""
        return np.append(self.view.owners, np.int32(SKY))[self.visibility.triangle.reshape(-1)]

    @cached_property
    def _rays_here(self) -> Float:
        """The pixels' rays (H W, 3), with z = 1, in the camera's axes at the time of their row."""
        centers = pixel_centers(self._inverse.shape).reshape(-1, 2)
        return transform(inverse_camera_matrix(self.view.camera.intrinsics), np.insert(centers, 2, 1.0, axis=1))

    @cached_property
    def _here(self) -> Float:
        """The points (H W, 3) in the camera's axes at the time of their row; NaN for the sky."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(self._things[:, None] == SKY, np.nan, self._rays_here / self._inverse.reshape(-1, 1))

    @cached_property
    def _places(self) -> Float:
        """The points (H W, 3) in the world at the other instant, NaN for those that do not exist then; directions of the
        sky.
        """
        rows, (height, width) = _rows(self.view.camera), self._inverse.shape
        row, sky = np.repeat(np.arange(height), width), self._things == SKY
        backs = rows.rotation.swapaxes(1, 2)[row]
        away = np.where(sky[:, None], self._rays_here, self._here - rows.translation[row])
        out = product(backs, away[..., None])[..., 0]
        for i in self._moving:
            at = np.flatnonzero(self._things == i)
            poses = rows.moving[i][row[at]] if i in rows.moving else np.tile(self.view.geometry.poses[i], (len(at), 1, 1))
            own = product(inverse(poses[:, :3, :3]), (out[at] - poses[:, :3, 3])[..., None])[..., 0]
            out[at] = transform(self.other.geometry.poses[i], own)
        out[(self._kinds == GONE)[self._things]] = np.nan
        return out

    @cached_property
    def _kinds(self) -> Whole:
        kinds = self._maps.kinds
        if (kinds == OTHER).any():
            thing = int(np.flatnonzero(kinds == OTHER)[0])
            raise ValueError(f"rolling shutter: expected things that keep their shape; thing {thing} deforms")
        return kinds

    @cached_property
    def _moving(self) -> list[int]:
        """The things of both views that move while rows are exposed, or from one instant to the other."""
        here, there = self.view.geometry.poses, self.other.geometry.poses
        count = min(len(here), len(there))
        moved = set(np.flatnonzero((here[:count] != there[:count]).any(axis=(1, 2))).tolist())
        moved |= _rows(self.view.camera).moving.keys() | _rows(self.other.camera).moving.keys()
        return sorted(i for i in moved if i < count and self._kinds[i] != GONE)

    @cached_property
    def _rests(self) -> Mask:
        """A mask of the pixels (H W,) whose points stay where they are before a camera that does, too."""
        one, two, camera = _rows(self.view.camera), _rows(self.other.camera), self.view.camera
        is_still = camera.intrinsics == self.other.camera.intrinsics and all(
            (rows.rotation == camera.R).all() and (rows.translation == camera.t).all() for rows in (one, two)
        )
        if not is_still:
            return np.zeros(len(self._things), np.bool_)
        return ~np.isin(self._things, self._moving) & (self._kinds != GONE)[self._things]
