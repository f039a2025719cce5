"""Points that stay attached to the surface below them while it moves: for tracks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from viewsphere.geometry.camera import project
from viewsphere.geometry.rotation import transform
from viewsphere.truth.raster.visibility import direction_matrix
from viewsphere.truth.surface_points.attached import rays_through, stick, weights_of
from viewsphere.truth.surface_points.raster import Placed, first_met, in_lens, placed_at, states
from viewsphere.truth.surface_points.rolling import placed_in_rows
from viewsphere.truth.view import Body, View

Float = NDArray[np.float64]
Whole = NDArray[np.int32]

GROUND, SKY, FREE, NOWHERE = -1, -2, -3, -4
"""The `body` of points on no thing: the ground, the sky, empty space, a flat picture."""


@dataclass(frozen=True, eq=False)
class SurfacePoints:
    """N points, each on a triangle of a thing, or else fixed in the world.

    body (N,) int32: position in `bodies`, otherwise GROUND, SKY, FREE or NOWHERE. triangle (N,) int32 within the body, -1
    without one; weights (N, 3) float64: barycentrics. place (N, 3) float64, for points without a triangle: a point of the
    world, or for the sky a unit vector towards it. bodies: the things at the time when points were attached to them; a thing
    whose triangles changed is listed more than once. ground_z: the ground's height at that time.
    """

    body: Whole
    triangle: Whole
    weights: Float
    place: Float
    bodies: Sequence[Body]
    ground_z: float | None

    @staticmethod
    def from_weights(view: View, thing: Whole, triangle: Whole, weights: Float, place: Float) -> SurfacePoints:
        """Points on a view's things: thing (N,) int32 is the position in its `things`, or a value as in `body` for points on no
        thing.
        """
        bodies = view.bodies(thing)
        number = np.searchsorted([body.position for body in bodies], thing)
        body = np.where(thing >= 0, number, thing).astype(np.int32)
        return SurfacePoints(body, triangle, weights, place, bodies, view.geometry.ground_z)

    def __len__(self) -> int:
        return len(self.body)

    @property
    def thing(self) -> Whole:
        """The things under the points, (N,) int32: positions in the view's `things`, otherwise as in `body`."""
        position = np.array([*(body.position for body in self.bodies), -1], np.int32)
        return np.where(self.body >= 0, position[np.maximum(self.body, -1)], self.body)

    def in_view(self, view: View) -> _Tracked:
        """Return the points' places in a view of the same things, at any instant."""
        return _Tracked(self, view)

    def chosen(self, index: NDArray[np.intp]) -> SurfacePoints:
        """A selection of the points, by their numbers."""
        parts = (self.body[index], self.triangle[index], self.weights[index], self.place[index])
        return SurfacePoints(*parts, self.bodies, self.ground_z)

    @staticmethod
    def joined(parts: Sequence[SurfacePoints]) -> SurfacePoints:
        """Join the points of several parts on the same things; of bodies with the same triangles, the first is kept."""
        bodies, numbers = list[Body](), list[Whole]()
        for part in parts:
            at = np.array([*(_number(body, bodies) for body in part.bodies), -1], np.int32)
            numbers.append(np.where(part.body >= 0, at[np.maximum(part.body, -1)], part.body))
        triangle, weights, place = (
            np.concatenate([getattr(p, name) for p in parts]) for name in ("triangle", "weights", "place")
        )
        heights = [part.ground_z for part in parts if part.ground_z is not None]
        return SurfacePoints(np.concatenate(numbers), triangle, weights, place, bodies, heights[0] if heights else None)


def _number(body: Body, known: list[Body]) -> int:
    """The position of a body with the same triangles in the list `known`, to which it is appended if there is none."""
    for number, other in enumerate(known):
        if other.position == body.position and other.has_triangles_of(body):
            return number
    known.append(body)
    return len(known) - 1


def points_seen(view: View, xy: ArrayLike) -> SurfacePoints:
    """The points that a view shows at positions (N, 2) of its picture, in pixels: the first surface that the ray through each
    one meets.

    Points are NOWHERE outside the picture, if the lens has no ray, or if a flat picture is visible.
    """
    xy = np.ascontiguousarray(xy, np.float64).reshape(-1, 2)
    return _seen_at_once(view, xy) if view.camera.rows is None else _seen_in_rows(view, xy)


def _seen_in_rows(view: View, xy: Float) -> SurfacePoints:
    """`points_seen` under a rolling shutter: each row shows the world at its own time."""
    row = np.clip(np.floor(np.nan_to_num(xy[:, 1])), 0, view.camera.height - 1).astype(np.intp)
    order = np.argsort(row, kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(row[order])) + 1)
    seen = SurfacePoints.joined([_seen_at_once(view.at_row(int(row[at[0]]) if len(at) else 0), xy[at]) for at in parts])
    return seen.chosen(np.argsort(order, kind="stable"))


def _seen_at_once(view: View, xy: Float) -> SurfacePoints:
    """`points_seen` under a global shutter."""
    inside = ((xy >= 0.0) & (xy < (view.camera.width, view.camera.height))).all(axis=1)
    rays = rays_through(view, xy)
    has_ray = np.logical_and(inside, ~np.isnan(rays).any(axis=1))
    nowhere = np.full(len(xy), -1, np.int32)
    met = first_met(view, xy, np.zeros(len(xy)), nowhere, None if view.is_pinhole else rays, has_ray)
    thing = np.where(has_ray & view.shows_directions, SKY, NOWHERE).astype(np.int32)
    first = np.array(view.geometry.triangle_start)
    hit = met >= 0
    thing[hit] = view.owners[met[hit]]
    thing[thing == len(view.things)] = GROUND
    on = thing >= 0
    weights = np.zeros((len(xy), 3))
    weights[on] = weights_of(view, met[on], rays[on])
    triangle = np.where(on, met - first[np.maximum(thing, 0)], -1).astype(np.int32)
    directions = transform(view.world_from_camera, transform(direction_matrix(view.camera), rays))
    origins = view.center
    if view.is_parallel:
        origins = origins + transform(view.world_from_camera, view.camera.lens.rays(xy).origins)
    return SurfacePoints.from_weights(view, thing, triangle, weights, _fixed(view, thing, origins, directions))


def _fixed(view: View, thing: Whole, origins: Float, directions: Float) -> Float:
    """Return the places where rays with these origins, (3,) or (N, 3), and directions (N, 3) meet the ground, and the
    directions of sky points; 0 for all others.
    """
    place = np.zeros(directions.shape)
    sky, ground = thing == SKY, thing == GROUND
    place[sky] = directions[sky] / np.sqrt((directions[sky] ** 2).sum(axis=1, keepdims=True))
    height = view.geometry.ground_z
    if height is not None:
        d = directions[ground]
        begin = origins if origins.ndim == 1 else origins[ground]
        place[ground] = begin + d * ((height - begin[..., 2]) / d[:, 2])[:, None]
        place[ground, 2] = height
    return place


def points_in_world(places: ArrayLike) -> SurfacePoints:
    """Points (N, 3) fixed in the world, in metres."""
    place = np.ascontiguousarray(places, np.float64).reshape(-1, 3)
    nothing = np.full(len(place), -1, np.int32)
    return SurfacePoints(np.full(len(place), FREE, np.int32), nothing, np.zeros((len(place), 3)), place, (), None)


@dataclass(frozen=True, eq=False)
class _Tracked:
    """Points in one view."""

    points: SurfacePoints
    view: View

    @property
    def xy(self) -> Float:
        """Positions in pixels, (N, 2), NaN if there is none."""
        return self.placed.xy

    @cached_property
    def world(self) -> Float:
        """The places of the points, (N, 3) metres; NaN for the sky, and for points that do not exist."""
        points = self.points
        fixed = (points.body == FREE) | ((points.body == GROUND) & self._has_ground)
        out = np.where(fixed[:, None], points.place, np.nan)
        return stick(self.view.geometry, self._own, points.weights, out)

    @cached_property
    def xyz(self) -> Float:
        """The places in the camera's axes, (N, 3), at the instant; (NaN, NaN, inf) for the sky."""
        out = transform(self.view.camera.R, self.world) + self.view.camera.t
        out[self._is_sky & in_lens(self.xy), 2] = np.inf
        return out

    @cached_property
    def state(self) -> NDArray[np.uint8]:
        """The points' states, (N,) uint8; see `surface_points.raster`. Its `states` computes several at once."""
        return states([self.placed])[0]

    @cached_property
    def placed(self) -> Placed:
        """The points in the form that `surface_points.raster.states` takes."""
        own = self._own
        ground = self.view.geometry.triangle_start[-1]
        on = np.where(self.points.body == GROUND, np.int32(ground), own) if self._has_ground else own
        if self.view.camera.rows is not None:
            places = np.where(self._is_sky[:, None], self.points.place, self.world)
            return placed_in_rows(self.view, places, self.moving, lambda: on, self._is_sky)
        placed = placed_at(self.view, transform(self.view.camera.R, self.world) + self.view.camera.t, lambda: on)
        sky = np.flatnonzero(self._is_sky)
        if len(sky):
            directions = transform(self.view.camera.R, self.points.place[sky])
            self._write_sky(placed, sky, directions)
        return placed

    @property
    def moving(self) -> Whole:
        """The position of each point's thing in the view's `things`, (N,), -1 if it has none."""
        owners = np.append(self.view.owners, np.int32(-1))
        return np.where(self._own >= 0, owners[self._own], np.int32(-1))

    def _write_sky(self, placed: Placed, sky: NDArray[np.intp], directions: Float) -> None:
        xy, _ = project(self.view.camera.intrinsics, directions)
        placed.xy[sky], placed.near[sky] = xy, 0.0
        if placed.rays is not None:
            placed.rays[sky] = directions if self.view.has_unit_rays else directions / directions[:, 2:]

    @property
    def _is_sky(self) -> NDArray[np.bool_]:
        return (self.points.body == SKY) & self.view.shows_directions

    @property
    def _has_ground(self) -> bool:
        """Return whether the ground is still at the height at which the points were attached."""
        return self.points.ground_z is not None and self.points.ground_z == self.view.geometry.ground_z

    @cached_property
    def _own(self) -> Whole:
        """The view's triangle of each point, -1 if it has none."""
        view, start = self.view, np.full(len(self.points.bodies) + 1, -1, np.int32)
        for number, body in enumerate(self.points.bodies):
            if body.position < len(view.things) and body.has_triangles_of(view.body(body.position)):
                start[number] = view.geometry.triangle_start[body.position]
        first = start[np.maximum(self.points.body, -1)]
        return np.where(first >= 0, first + self.points.triangle, np.int32(-1))
