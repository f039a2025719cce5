"""Lenses that Blender's cameras lack: pinhole pictures that cover the lens's rays are rendered, then sampled along these rays.

Labels are not affected: truth casts the lens's rays itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.shared.blender.file_frame import FileFrame
from viewsphere.engines.shared.blender.requests import staged
from viewsphere.geometry.camera import pixel_rays
from viewsphere.model.sensors.camera import Camera, Intrinsics
from viewsphere.model.shot import Shot

MOMENTS = 9
"""Number of evenly spaced moments of the exposure, from opening to closing, at which Blender gets the poses of things: as many
as Cycles evaluates.
"""


Float = NDArray[np.float64]
Float32 = NDArray[np.float32]

FINER = 1.5
"""Pixels of a covering picture in one pixel of the lens's picture, along a line."""

STEEPEST = 1.5
"""Tangent of the largest angle from the optical axis that a single covering picture may reach."""

MARGIN = 2
"""Margin of a covering picture around the outermost rays, in pixels."""

FACES: tuple[tuple[tuple[int, int, int], ...], ...] = (
    ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    ((0, 0, -1), (0, 1, 0), (1, 0, 0)),
    ((0, 0, 1), (0, 1, 0), (-1, 0, 0)),
    ((1, 0, 0), (0, 0, -1), (0, 1, 0)),
    ((1, 0, 0), (0, 0, 1), (0, -1, 0)),
    ((-1, 0, 0), (0, 1, 0), (0, 0, -1)),
)
"""Six matrices whose rows are the axes of a view ahead, right, left, down, up and behind, in camera axes."""


@dataclass(frozen=True, eq=False)
class _View:
    """A covering picture, of a camera that Blender has: its `camera`, and where the rays of the lens's pixels meet it.

    pixels (N,): indices of the lens's pixels that this picture serves; x, y (N,): the places of their rays in the picture, in
    its pixels. All three are None if the covering picture is the lens's picture, pixel by pixel.
    """

    camera: Camera
    pixels: NDArray[np.int64] | None = None
    x: Float | None = None
    y: Float | None = None


def is_rendered(camera: Camera, is_traced: bool) -> bool:
    """Return whether Blender itself has such a camera: a pinhole or parallel rays without skew; with renderers that trace rays,
    also panoramas.
    """
    blender = camera.lens.blender
    if blender is None:
        return camera.lens.is_linear and camera.intrinsics.skew == 0
    return is_traced or blender.panorama is None


def views_of(camera: Camera, is_traced: bool) -> tuple[_View, ...]:
    """The covering pictures of a camera; `is_traced`: for a renderer that traces rays, which has panoramas.

    They are the camera's own picture if Blender has such a camera, a slightly wider pinhole's for a lens that bends rays
    slightly, otherwise up to six sides of a cube.
    """
    if is_rendered(camera, is_traced):
        return (_View(camera),)
    rays = pixel_rays(camera.intrinsics).reshape(-1, 3)
    seen_pixels = np.flatnonzero(np.isfinite(rays).all(axis=1))
    ahead = rays[seen_pixels]
    if (ahead[:, 2] > 0).all() and (np.abs(ahead[:, :2]).max(axis=1) <= STEEPEST * ahead[:, 2]).all():
        return (_view(camera, np.eye(3), seen_pixels, ahead),)
    turned = [ahead @ np.array(face, float).T for face in FACES]
    nearest = np.argmax([t[:, 2] for t in turned], axis=0)
    views = [
        _view(camera, np.array(face, float), seen_pixels[nearest == i], turned[i][nearest == i])
        for i, face in enumerate(FACES)
        if (nearest == i).any()
    ]
    return tuple(views)


def _view(camera: Camera, face: Float, pixels: NDArray[np.int64], rays: Float) -> _View:
    """The smallest covering picture, with the axes `face`, through which these rays pass."""
    focal = FINER * max(camera.intrinsics.fx, camera.intrinsics.fy)
    x, y = focal * rays[:, 0] / rays[:, 2], focal * rays[:, 1] / rays[:, 2]
    left, top = math.floor(x.min()) - MARGIN, math.floor(y.min()) - MARGIN
    width, height = math.ceil(x.max()) + MARGIN - left, math.ceil(y.max()) + MARGIN - top
    pinhole = Intrinsics(width=width, height=height, fx=focal, fy=focal, cx=-left, cy=-top)
    return _View(Camera(pinhole, face @ camera.R, face @ camera.t), pixels, x - left, y - top)


def resampled(camera: Camera, views: Sequence[_View], pictures: Sequence[Float32], mixed: bool = True) -> Float32:
    """The lens's picture (H, W, C) float32, bilinear, or from the nearest pixels if not `mixed`; empty in pixels without a
    ray.
    """
    channels = pictures[0].shape[2]
    out = np.zeros((camera.height * camera.width, channels), np.float32)
    for view, picture in zip(views, pictures, strict=True):
        if view.pixels is None or view.x is None or view.y is None:
            return picture
        nearest = np.floor(view.y).astype(int), np.floor(view.x).astype(int)
        out[view.pixels] = _bilinear(picture, view.x - 0.5, view.y - 0.5) if mixed else picture[nearest]
    return out.reshape(camera.height, camera.width, channels)


def _bilinear(picture: Float32, x: Float, y: Float) -> NDArray[Any]:
    column, row = np.floor(x).astype(int), np.floor(y).astype(int)
    across, down = (x - column)[:, None].astype(np.float32), (y - row)[:, None].astype(np.float32)
    upper = picture[row, column] * (1 - across) + picture[row, column + 1] * across
    lower = picture[row + 1, column] * (1 - across) + picture[row + 1, column + 1] * across
    return upper * (1 - down) + lower * down


@dataclass(frozen=True, eq=False)
class Sweeping:
    """A sensor's picture at an instant, both counted from 0 in the shot, during the exposure. Deforming things keep their
    shape.
    """

    shot: Shot
    instant: int
    sensor: int
    is_traced: bool

    @property
    def is_still(self) -> bool:
        """Return whether nothing moves, so that the picture is sharp."""
        return self.request(0) is None

    def request(self, view: int) -> dict[str, Any] | None:
        """The part of the worker's `render` request for one of the `views_of` the sensor's camera: matrices of moving objects,
        by their index, and the camera's rotations and centres. None if nothing moves.
        """
        exposure = self.shot.exposures[self.instant] if self.shot.shutter else None
        if exposure is None:
            return None
        moments = (np.linspace(-0.5, 0.5, MOMENTS) * self.shot.shutter).tolist()
        frame = FileFrame.from_blend(self.shot.scene.blend)
        sweeps = [exposure.things[i] for i in staged(self.shot.things_at(self.instant), self.shot.scene)]
        objects = [
            {"object": place, "matrices": [frame.placed(pose) for pose in map(sweep.pose, moments) if pose is not None]}
            for place, sweep in enumerate(sweeps)
            if sweep is not None and None not in sweep.motion.poses
        ]
        camera = None if exposure.rig is None else [self._camera(frame, view, moment) for moment in moments]
        return {"objects": objects, "camera": camera} if objects or camera else None

    def _camera(self, frame: FileFrame, view: int, moment: float) -> dict[str, Any]:
        camera = views_of(self.shot.camera_during(self.instant, moment, self.sensor), self.is_traced)[view].camera
        request = {"R": camera.R.tolist(), "center": camera.center.tolist(), "near": 1.0, "far": 1.0}
        return {name: value for name, value in frame.camera(request).items() if name in ("R", "center")}
