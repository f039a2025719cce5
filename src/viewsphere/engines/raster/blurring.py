"""Motion blur: pictures at several moments of the exposure, each smeared along its own flow, then averaged.

A smeared picture replaces about four that are not. Things, cameras, light and shadows are placed for each moment, so occlusion
between things is correct, too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.raster import kernels_blur as kernels
from viewsphere.engines.raster.records import Float32
from viewsphere.engines.shared.arranged import Arranged, Arrangements
from viewsphere.geometry.camera import pixel_rays, project
from viewsphere.geometry.rotation import compose
from viewsphere.model.scene import Matrix4
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.shot import Shot
from viewsphere.truth.raster.geometry import Geometry
from viewsphere.truth.raster.visibility import Visibility, lens_rays_to, rasterize

Float = NDArray[np.float64]

STRIDE = 16.0
"""Pixels of motion between two pictures that are averaged."""

MOST = 16
"""Maximum number of pictures that are averaged."""

LEAST = 1.0
"""Pixels of motion during the exposure above which a picture is blurred."""

Paint = Callable[[Arranged, Camera, Visibility, Float32], None]
"""A function that fills the light (H * W, 4) of arranged things, seen by a camera."""


@dataclass(frozen=True, eq=False)
class Blur:
    """The blur of a sensor's picture at an instant, both counted from 0 in the shot."""

    arrangements: Arrangements
    instant: int
    sensor: int

    @property
    def _shot(self) -> Shot:
        return self.arrangements.shot

    def count(self, geometry: Geometry, visibility: Visibility) -> int:
        """Return the number of pictures to average, 1 if nothing blurs.

        The number follows from the longest motion of any point that the instant's own picture shows. It depends on the instant
        alone, not on the shot around it.
        """
        if not self._shot.shutter or self._stands():
            return 1
        start, end = (self._way(geometry, visibility, 0.0, *ends) for ends in ((-0.5, 0.0), (0.0, 0.5)))
        longest = float((_lengths(start) + _lengths(end)).max()) + self._deforms(geometry, visibility)
        return 1 if longest < LEAST else min(1 + math.ceil(longest / STRIDE), MOST)

    def paint(self, count: int, paint: Paint, radiance: Float32) -> None:
        """Fill `radiance` (H * W, 4) with the mean of `count` smeared pictures."""
        camera = self._shot.camera(self.instant, self.sensor)
        shape = camera.height, camera.width, 4
        total, calmed = np.zeros(shape, np.float32), np.empty(shape, np.float32)
        tiles = np.empty((-(-shape[0] // kernels.TILE), -(-shape[1] // kernels.TILE), 2), np.float32)
        for k in range(count):
            middle = (k + 0.5) / count - 0.5
            arranged = self.arrangements.during(self.instant, middle * self._shot.shutter)
            camera = self._camera(middle)
            visibility = rasterize(arranged.geometry, camera)
            paint(arranged, camera, visibility, radiance)
            way = self._way(arranged.geometry, visibility, middle, middle - 0.5 / count, middle + 0.5 / count)
            kernels.calm(radiance.reshape(shape), calmed)
            kernels.find_longest(way, tiles)
            kernels.smear(radiance.reshape(shape), calmed, way, tiles, visibility.inverse_depth, total)
        np.divide(total.reshape(-1, 4), np.float32(count), out=radiance)

    def _stands(self) -> bool:
        exposure = self._shot.exposures[self.instant]
        return exposure is None or (exposure.rig is None and not any(exposure.things))

    def _deforms(self, geometry: Geometry, visibility: Visibility) -> float:
        """Maximum motion, in pixels, of a deforming thing's vertices in its own axes, at the distance of its visible part."""
        camera, exposure = self._camera(0.0), self._shot.exposures[self.instant]
        sweeps = enumerate(exposure.things if exposure else ())
        deforming = [i for i, sweep in sweeps if sweep and len(set(sweep.motion.steps)) > 1]
        if not deforming:
            return 0.0
        ends = [self.arrangements.during(self.instant, u * self._shot.shutter).whole for u in (-0.5, 0.5)]
        longest = 0.0
        for i in deforming:
            first, stop = geometry.triangle_start[i : i + 2]
            near = visibility.inverse_depth[(visibility.triangle >= first) & (visibility.triangle < stop)].max(initial=0.0)
            start, end = (whole[i].vertices for whole in ends)
            if start.shape == end.shape:
                metres = float(np.sqrt(((end - start) ** 2).sum(axis=1)).max(initial=0.0))
                share = 1.0 if camera.lens.is_parallel else float(near)
                longest = max(longest, metres * share * camera.intrinsics.fx)
        return longest

    def _camera(self, moment: float) -> Camera:
        """The camera at a moment: -0.5 when the shutter opens, 0.5 when it closes."""
        return self._shot.camera_during(self.instant, moment * self._shot.shutter, self.sensor)

    def _poses(self, moment: float) -> list[Matrix4]:
        things = self._shot.things_during(self.instant, moment * self._shot.shutter)
        return [thing.world_from_object for thing in things]

    def _way(self, geometry: Geometry, visibility: Visibility, now: float, start: float, end: float) -> Float32:
        """Return the motion (H, W, 2), in pixels, of the points that the pixels show at `now`, from `start` to `end`.

        The motion is 0 where the lens does not show the point at both moments. Deforming meshes move as if they were rigid.
        """
        camera, poses = self._camera(now), self._poses(now)
        rays = lens_rays_to(camera, visibility.inverse_depth)
        rays = pixel_rays(camera.intrinsics) if rays is None else rays
        count = len(geometry.triangle_start) - 1
        owner = np.full(len(geometry.triangles), count, np.int32)
        owner[: geometry.triangle_start[-1]] = np.repeat(np.arange(count, dtype=np.int32), np.diff(geometry.triangle_start))
        places: list[Float] = []
        for moment in (start, end):
            then = self._camera(moment)
            moves = _moves(camera, poses, then, self._poses(moment))
            points = np.empty_like(rays)
            kernels.carry(rays, visibility.inverse_depth, visibility.triangle, owner, moves, points)
            places.append(project(then.intrinsics, points)[0])
        way = np.nan_to_num(places[1] - places[0], nan=0.0, posinf=0.0, neginf=0.0).astype(np.float32)
        if camera.lens.is_parallel:
            way[visibility.triangle < 0] = 0.0  # the sky has one colour
        return way


def _lengths(way: Float32) -> Float32:
    return np.sqrt((way * way).sum(axis=-1))


def _moves(camera: Camera, poses: Sequence[Matrix4], then: Camera, others: Sequence[Matrix4]) -> Float:
    """The transforms (N + 1, 3, 4) from camera axes now to camera axes then, for each thing and for still things."""
    here, there = _inverse(_extrinsics(camera)), _extrinsics(then)
    still = compose(there, here)
    moves = [
        still if pose == other else compose(there, compose(compose(np.array(other), _inverse(np.array(pose))), here))
        for pose, other in zip(poses, others, strict=True)
    ]
    return np.array([*moves, still])[:, :3]


def _extrinsics(camera: Camera) -> Float:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = camera.R, camera.t
    return matrix


def _inverse(pose: Float) -> Float:
    """The inverse of a rigid pose (4, 4)."""
    turned = np.eye(4)
    turned[:3, :3] = pose[:3, :3].T
    moved = np.eye(4)
    moved[:3, 3] = -pose[:3, 3]
    return compose(turned, moved)
