"""A view: one camera at one instant. Also the tests whether things of two views are the same."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.rotation import inverse, transform
from viewsphere.model.sensors.camera import Camera, Intrinsics
from viewsphere.model.thing import Thing
from viewsphere.truth.raster.geometry import Geometry, seen_from
from viewsphere.truth.raster.rolling import owners_of
from viewsphere.truth.raster.visibility import Visibility, direction_matrix, homogeneous, lens_rays_to, pixels_of, rasterize

Float = NDArray[np.float64]
Change = Literal["moved", "deformed", "gone"]


@dataclass(frozen=True, eq=False)
class Body:
    """One thing of a view, at this position in its `things`, reduced to the data that attached points depend on.

    They are its triangles (n, 3), whose vertices are counted from `base` on, and the `places` (v, 3) of these in the thing's
    own axes.
    """

    position: int
    thing: Thing
    triangles: NDArray[np.int32]
    base: int
    places: NDArray[np.float32]

    @property
    def corners(self) -> NDArray[np.int32]:
        """The vertex of each corner of its triangles, (3 n,), counted from 0."""
        return (self.triangles - np.int32(self.base)).reshape(-1)

    def has_triangles_of(self, other: Body) -> bool:
        """Return whether both are the same thing, present, and made of the same triangles, wherever its vertices are.

        Normals split vertices: two corners may share a vertex while their triangles are level, and need two once they are not.
        So corners are compared by their places: corners that share a vertex in one body must be at the same place in the other.
        """
        one, two = self.thing, other.thing
        if one is not two and not (one.is_there and two.is_there and (one.model is two.model or one.model == two.model)):
            return False
        if one.step == two.step:
            return True
        if len(self.triangles) != len(other.triangles):
            return False
        return np.array_equal(self.corners, other.corners) or (self._is_joined_in(other) and other._is_joined_in(self))

    def _is_joined_in(self, other: Body) -> bool:
        """Return whether the corners of each vertex are at the same place in another body with as many triangles."""
        corners = self.corners
        first = np.zeros(len(self.places), np.intp)
        first[corners[::-1]] = np.arange(len(corners))[::-1]
        there = other.places[other.corners]
        return np.array_equal(there, there[first[corners]])


@dataclass(frozen=True, eq=False)
class View:
    """One camera at one instant. `geometry` has the triangles of `things` at that instant, all standing still: see
    `Shot.things_at` and `Stage.at`. Use a view only until its geometry is overwritten: see `truth.moving.Ring`.

    is_sky_endless: whether a pixel without a triangle shows a direction (sky, surrounding), or a flat picture, which has no
    place. is_compared: whether labels may compare this view with others.
    """

    things: Sequence[Thing]
    geometry: Geometry
    camera: Camera
    is_sky_endless: bool
    is_compared: bool = True

    @cached_property
    def corners(self) -> Float:
        """The vertices before the perspective division, from `truth.raster.visibility.homogeneous`."""
        return homogeneous(self.geometry, self.camera)

    @cached_property
    def boxes(self) -> NDArray[np.int32]:
        """The pixel range of each vertex, (n, 4): see `truth.raster.visibility.pixels_of`. Lines must stay straight."""
        corners = self.corners
        if self.is_parallel:
            corners = np.insert(corners[:, :3], 3, 1.0, axis=1)  # 1/w instead of z
        return pixels_of(self.geometry, corners, (self.camera.width, self.camera.height))

    @cached_property
    def shown(self) -> Geometry:
        """The geometry without the single-sided triangles that face away from the camera."""
        return seen_from(self.geometry, self.corners)

    def is_turned_away(self, triangles: NDArray[np.int32]) -> NDArray[np.bool_]:
        """Return whether the camera cannot see these triangles (-1 for none) because they face away from it."""
        is_gone = self.shown.triangle_cutout != self.geometry.triangle_cutout
        return (triangles >= 0) & is_gone[triangles]

    @cached_property
    def visibility(self) -> Visibility:
        """The triangles and the depth visible to the camera."""
        corners = self.corners if self.camera.rows is None else None
        return rasterize(self.geometry, self.camera, corners=corners, keeps_exact=self.is_compared)

    def at_row(self, row: int, lens: Intrinsics | None = None) -> View:
        """The view of a camera with a global shutter at the time of a row of this one's rolling shutter, through its own lens
        or another one.
        """
        rows, lens = self.camera.rows, lens or self.camera.intrinsics
        assert rows is not None
        geometry = self.geometry
        if rows.moving:
            poses, bounds = geometry.poses.copy(), geometry.bounds.copy()
            for i in (i for i in rows.moving if i < len(poses)):
                poses[i], bounds[i] = rows.moving[i][row], ((-np.inf,) * 3, (np.inf,) * 3)
            geometry = replace(geometry, poses=poses, bounds=bounds)
        return replace(self, geometry=geometry, camera=Camera(lens, rows.rotation[row], rows.translation[row]))

    def rays_to(self, inverse_depth: Float) -> Float:
        """Rays (H, W, 3), camera axes, from the camera's centre to the points that the pixels show at 1/s `inverse_depth` (H,
        W): see `lens_rays_to`; (0, 0, 3) for a pinhole, which needs none.
        """
        rays = lens_rays_to(self.camera, inverse_depth)
        if rays is None:
            rays = np.empty((0, 0, 3))
        rays.setflags(write=False)
        return rays

    @cached_property
    def camera_from_ray(self) -> Float:
        """Matrix (3, 3) from `rays_to` to camera axes: K^-1 for a pinhole, whose rays are pixels (x, y, 1); else the
        identity.
        """
        return direction_matrix(self.camera) if self.is_pinhole else np.eye(3)

    @cached_property
    def world_from_camera(self) -> Float:
        """The inverse of the camera's R, (3, 3), even if R is a rotation only to a few digits."""
        return inverse(self.camera.R)

    @cached_property
    def center(self) -> Float:
        """The camera's centre, (3,) world metres."""
        return -transform(self.world_from_camera, self.camera.t)

    @property
    def is_pinhole(self) -> bool:
        """Return whether the lens has no distortion."""
        return self.camera.lens.is_linear

    @property
    def is_straight(self) -> bool:
        """Return whether `corners` are pixels (u, v, w), which rays meet as (x, y, 1)."""
        return self.camera.lens.is_straight

    @property
    def shows_directions(self) -> bool:
        """Return whether each pixel without a triangle shows a direction of its own: not where all rays have one direction."""
        return self.is_sky_endless and not self.is_parallel

    @property
    def is_parallel(self) -> bool:
        """Return whether all rays have one direction, but begin at different places."""
        return self.camera.lens.is_parallel

    @property
    def has_unit_rays(self) -> bool:
        """Return whether s is measured along rays of length 1; see `truth.raster.visibility.Visibility`."""
        return self.camera.lens.has_unit_rays

    @property
    def owners(self) -> NDArray[np.int32]:
        """The thing of each triangle, by its position in `things`; for the ground, the number of things."""
        return owners_of(self.geometry)

    def body(self, i: int) -> Body:
        """Thing i."""
        first, stop = self.geometry.triangle_start[i : i + 2]
        return Body(i, self.things[i], self.geometry.triangles[first:stop], self.geometry.vertex_start[i], self._own_axes(i))

    def bodies(self, things: NDArray[np.int32]) -> tuple[Body, ...]:
        """Return the bodies of the things in a list of their positions; the bodies outlast the geometry.

        The list may hold numbers below 0, too.
        """
        found = (self.body(i) for i in np.unique(things[things >= 0]).tolist())
        return tuple(replace(body, places=body.places.copy()) if body.thing.step else body for body in found)

    def change(self, i: int, other: View) -> Change:
        """Return the change of thing i from this view to another: moved (or still), deformed, or gone.

        A thing with other triangles in the other view counts as gone.
        """
        if i >= len(other.things):
            return "gone"
        if self.things[i] is other.things[i]:
            return "moved"
        one, two = self.body(i), other.body(i)
        if not one.has_triangles_of(two):
            return "gone"
        is_rigid = one.thing.step == two.thing.step or np.array_equal(self._own_axes(i), other._own_axes(i))
        return "moved" if is_rigid else "deformed"

    def _own_axes(self, i: int) -> NDArray[np.float32]:
        """Vertices of thing i in its own axes."""
        first, stop = self.geometry.vertex_start[i : i + 2]
        return self.geometry.coordinates[first:stop]

    def has_camera_of(self, other: View) -> bool:
        """Return whether both cameras are the same, and at the same place."""
        return self.turns_like(other) and np.array_equal(self.camera.t, other.camera.t)

    def turns_like(self, other: View) -> bool:
        """Return whether both cameras see all directions in the same pixels."""
        same_lens = self.camera.intrinsics == other.camera.intrinsics
        return same_lens and np.array_equal(self.camera.R, other.camera.R)

    def has_ground_of(self, other: View) -> bool:
        """Return whether both views have a ground at the same height."""
        return self.geometry.ground_z is not None and self.geometry.ground_z == other.geometry.ground_z

    def has_sky_of(self, other: View) -> bool:
        """Return whether each pixel without a triangle shows a direction of its own in both views."""
        return self.shows_directions and other.shows_directions
