"""Correspondence: positions in another view of the points that one view's pixels show, and their visibility there.

A pixel's point is the place where its ray meets the first surface. It moves with its thing, or with its triangle if the thing
deforms. The ground is a fixed plane, and the sky is a direction. All computation is in float64.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.rotation import product, transform
from viewsphere.geometry.seam import short_way
from viewsphere.truth.correspondences.maps import Maps, maps_between
from viewsphere.truth.kernel_constants import OTHER, STILL
from viewsphere.truth.raster.visibility import Visibility
from viewsphere.truth.surface_points.attached import shifts, stick, weights_of
from viewsphere.truth.surface_points.raster import Placed, in_lens, pixels_at, positions_along, states
from viewsphere.truth.view import View

Float = NDArray[np.float64]
Real = TypeVar("Real", np.float32, np.float64)


@dataclass(frozen=True, eq=False)
class _Deformed:
    """Pixels that show deforming things: their numbers in the picture (n,), and their points in the axes of either camera (n,
    3).

    is_still (n,): whether neither the camera nor the point's triangle moved.
    """

    pixel: NDArray[np.intp]
    here: Float
    there: Float
    is_still: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Match:
    """The points of one view's pixels in another view: `visibility` is that of `view`. Arrays have the size of the picture of
    `view`.
    """

    view: View
    visibility: Visibility
    other: View

    @property
    def xy(self) -> Float:
        """Positions in the other view, (H, W, 2), in pixels; NaN if there is none, and the pixel's own centre if nothing
        moved.
        """
        return self.placed.xy

    @cached_property
    def flow(self) -> NDArray[np.float32]:
        """The offset of `xy` from the centres of the pixels, (H, W, 2)."""
        from viewsphere.truth.correspondences import kernels_correspond as kernels

        out = np.empty((*self._inverse.shape, 2), np.float32)
        if self.view.is_pinhole and self.other.is_pinhole and self._deformed is None:
            seen, owners, inverse, _, kinds = self._pixels
            maps = self._maps.projected(self.view, self.other)
            kernels.flow_on_pinhole(seen, owners, inverse, kinds, maps, out.reshape(-1))
        elif self.other.camera.lens.period is not None:
            out[...] = self.offset
        else:
            kernels.from_centers(self.xy.reshape(-1), self._inverse.shape[1], out.reshape(-1))
        return out

    @property
    def offset(self) -> Float:
        """The offset of `xy` from the centres of the pixels, (H, W, 2), by the shorter way around a full turn."""
        out, period = self.xy - pixel_centers(self._inverse.shape), self.other.camera.lens.period
        if period is not None:
            out[..., 0] = short_way(out[..., 0], period)
        return out

    @cached_property
    def xyz(self) -> Float:
        """The places of the points at the other instant, in the other camera's axes, (H, W, 3) metres.

        They are NaN for points that do not exist then, and (NaN, NaN, inf) for the sky.
        """
        out = self._moved(self._maps.turn, np.float64)
        out[(self._inverse == 0.0) & (self.placed.near == 0.0), 2] = np.inf
        if self._deformed is not None:
            out.reshape(-1, 3)[self._deformed.pixel] = self._deformed.there
        return out

    @cached_property
    def scene_flow(self) -> NDArray[np.float32]:
        """The motion of each point between the camera axes of its two instants, (H, W, 3) metres; NaN for the sky, too.

        It is computed from differences of motions, not of points, so it is exact at any distance from the camera or the origin.
        """
        out = self._moved(self._maps.turn - np.eye(3), np.float32)
        if self._deformed is not None:
            out.reshape(-1, 3)[self._deformed.pixel] = self._deformed.there - self._deformed.here
        return out

    @cached_property
    def inverse_depth(self) -> Float:
        """1/z in the other camera's axes, (H, W): 0 for the sky and for points without a pixel, NaN for points that do not
        exist.
        """
        rays, near = self.placed.rays, self.placed.near
        return near if rays is None else np.divide(near, rays[..., 2], out=near.copy(), where=near > 0.0)

    @cached_property
    def state(self) -> NDArray[np.uint8]:
        """The points' states in the other view, (H, W); see `surface_points.raster`. Its `states` computes several at once."""
        return states([self.placed])[0]

    @cached_property
    def placed(self) -> Placed:
        """The points in the other view, as `surface_points.raster.states` takes them."""
        xy, near, rays = self._on_pinhole() if self.other.is_pinhole else self._as_rays()
        if self._deformed is not None:
            self._write_deformed(xy, near, rays)
        return Placed(self.other, xy, near, rays, partial(own_triangles, self.visibility, self.view, self.other))

    @cached_property
    def _inverse(self) -> Float:
        """1/s of the pixels."""
        exact = self.visibility.exact
        return self.visibility.inverse_depth.astype(np.float64) if exact is None else exact

    @cached_property
    def _rays(self) -> Float:
        return self.view.rays_to(self._inverse)

    @cached_property
    def _maps(self) -> Maps:
        return maps_between(self.view, self.other)

    @property
    def _pixels(self) -> tuple[NDArray[np.int32], NDArray[np.int32], Float, Float, NDArray[np.int32]]:
        """The arguments for pixels and things that all kernels take."""
        inverse, rays = self._inverse.reshape(-1), self._rays.reshape(-1)
        return self.visibility.triangle, self.view.owners, inverse, rays, self._maps.kinds

    def _moved(self, turn: Float, kind: type[Real]) -> NDArray[Real]:
        """turn x + shift of the points x in this camera's axes, (H, W, 3): computed in float64, rounded to `kind`."""
        from viewsphere.truth.correspondences import kernels_correspond as kernels

        out = np.empty((*self._inverse.shape, 3), kind)
        kernels.in_axes(*self._pixels, self._maps.matrices(product(turn, self.view.camera_from_ray)), out.reshape(-1))
        return out

    def _on_pinhole(self) -> tuple[Float, Float, None]:
        from viewsphere.truth.correspondences import kernels_correspond as kernels

        xy, near = np.empty((*self._inverse.shape, 2)), np.empty(self._inverse.shape)
        kernels.on_pinhole(*self._pixels, self._maps.projected(self.view, self.other), xy.reshape(-1), near.reshape(-1))
        return xy, near, None

    def _as_rays(self) -> tuple[Float, Float, Float]:
        from viewsphere.truth.correspondences import kernels_correspond as kernels

        rays, near = np.empty((*self._inverse.shape, 3)), np.empty(self._inverse.shape)
        matrices = self._maps.matrices(product(self._maps.turn, self.view.camera_from_ray))
        kernels.as_rays(*self._pixels, matrices, self.other.has_unit_rays, rays.reshape(-1), near.reshape(-1))
        xy = positions_along(self.other, rays, near)
        still = self._shows(STILL)
        xy[still] = pixel_centers(self._inverse.shape)[still]
        near[~in_lens(xy) & ~np.isnan(near)] = 0.0
        return xy, near, rays

    def _shows(self, kind: int) -> NDArray[np.bool_]:
        """Return a mask of the pixels that show a thing of this kind, (H, W)."""
        owners = np.append(self.view.owners, len(self._maps.kinds) - 1)  # the last row is for the sky
        return (self._maps.kinds == kind)[owners][self.visibility.triangle]

    @cached_property
    def _deformed(self) -> _Deformed | None:
        if not (self._maps.kinds == OTHER).any():
            return None
        pixel = np.flatnonzero(self._shows(OTHER))
        triangle = self.visibility.triangle.reshape(-1)[pixel]
        centers = pixel_centers(self._inverse.shape).reshape(-1, 2)[pixel]
        rays = np.column_stack((centers, np.ones(len(pixel)))) if self.view.is_straight else self._rays.reshape(-1, 3)[pixel]
        weights = weights_of(self.view, triangle, rays)
        further = triangle + shifts(self.view, self.other)[self.view.owners[triangle]]
        places, corners = list[Float](), list[Float]()
        for view, chosen in ((self.view, triangle), (self.other, further)):
            world = stick(view.geometry, chosen, weights, np.empty((len(pixel), 3)))
            places.append(transform(view.camera.R, world) + view.camera.t)
            corners.append(view.geometry.corners(chosen))
        is_still = (corners[0] == corners[1]).all(axis=(1, 2)) & self.view.has_camera_of(self.other)
        return _Deformed(pixel, places[0], places[1], is_still)

    def _write_deformed(self, xy: Float, near: Float, rays: Float | None) -> None:
        assert self._deformed is not None
        pixel, is_still = self._deformed.pixel, self._deformed.is_still
        there_xy, there_near, there_rays = pixels_at(self.other, self._deformed.there)
        centers = pixel_centers(near.shape).reshape(-1, 2)[pixel]
        xy.reshape(-1, 2)[pixel] = np.where(is_still[:, None], centers, there_xy)
        near.reshape(-1)[pixel] = there_near
        if rays is not None and there_rays is not None:
            rays.reshape(-1, 3)[pixel] = there_rays


def own_triangles(visibility: Visibility, view: View, other: View) -> NDArray[np.int32]:
    """The other view's numbers of the triangles visible in a view, -1 if there is none."""
    from viewsphere.truth.correspondences import kernels_correspond as kernels

    seen, shift = visibility.triangle, shifts(view, other)
    if not shift.any():
        return seen
    triangles = np.empty(seen.shape, np.int32)
    kernels.own_triangles(seen, view.owners, shift, triangles)
    return triangles


def pixel_centers(shape: tuple[int, ...]) -> Float:
    """The centres of pixels, (H, W, 2)."""
    y, x = np.indices(shape, np.float64)
    return np.stack((x + 0.5, y + 0.5), axis=-1)
