"""The sky, and the ground that fades into it, composited behind pictures of a renderer that has neither."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.shared.blender.requests import extent
from viewsphere.geometry.camera import pixel_rays
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.shot import Shot
from viewsphere.model.weather import Fog
from viewsphere.rendering.ground.horizon import BEGIN, FLAT, OVER
from viewsphere.rendering.sky.sky import SkyPictures, sky_pictures
from viewsphere.rendering.weather.fog import Air
from viewsphere.truth.raster.geometry import Geometry
from viewsphere.truth.raster.visibility import Visibility, rasterize

EDGE = 1
"""Pixels by which an object's smoothed outline reaches beyond the pixels whose rays hit the object."""

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Backdrop:
    """The backdrop of a shot. middle (3,) and unit: centre and half the extent of all placed things, in world metres; ground:
    the number of the ground's first triangle.
    """

    sky: SkyPictures
    middle: Float
    unit: float
    ground: int

    @classmethod
    def for_shot(cls, shot: Shot, geometry: Geometry) -> Backdrop:
        """The backdrop of a shot. Raises RecipeError for a picture that cannot be read."""
        scene = shot.scene
        sky = sky_pictures(scene.sky, scene.sun, scene.lights, scene.ground is not None)
        middle, unit = extent(geometry, any(p.scenery for p in shot.things))
        return cls(sky, middle, unit, int(geometry.triangle_start[-1]))

    def behind(self, picture: Float32, camera: Camera, visibility: Visibility, is_open: bool) -> Float32:
        """The picture (H, W, 4), premultiplied, with a ground that fades into the sky, or into nothing if `is_open`."""
        rays = np.nan_to_num(pixel_rays(camera.intrinsics)) @ camera.R
        length = np.linalg.norm(rays, axis=2)
        with np.errstate(divide="ignore", invalid="ignore"):
            away = length / visibility.inverse_depth
            directions = np.nan_to_num(rays / length[..., None])
        shown = picture
        if (visibility.triangle >= self.ground).any():
            shown = picture * self._left(away, directions[..., 2], camera, visibility.triangle)[..., None]
        if is_open:
            return shown
        out = np.ones_like(shown)
        out[..., :3] = shown[..., :3] + (1 - shown[..., 3:]) * self.seen(directions)
        return out

    def _left(self, away: Float, rise: Float, camera: Camera, triangle: NDArray[np.int32]) -> Float32:
        """The share (H, W) of each pixel that has not faded, by distance `away` and the ray's `rise` (sine of its elevation): 1
        on everything above the ground, 0 beyond the ground's end.
        """
        behind = np.where(np.isfinite(away), away, 0) - np.linalg.norm(self.middle - camera.center)
        near = np.clip(1 - (behind / self.unit - BEGIN) / OVER, 0, 1)
        left = _smooth(near * near) * _smooth(np.clip(np.abs(rise) / FLAT, 0, 1))
        left[triangle < 0] = 0
        left[_widened((triangle >= 0) & (triangle < self.ground)) & (triangle < self.ground)] = 1
        return left.astype(np.float32)

    def seen(self, directions: Float) -> Float32:
        """The sky's radiance (H, W, 3) in unit directions of the world, bilinear."""
        sky, turn = self.sky.seen, np.radians(self.sky.turn_deg)
        height, width, _ = sky.shape
        azimuth = np.arctan2(directions[..., 1], directions[..., 0]) - turn
        x = (0.5 - azimuth / (2 * np.pi)) * width - 0.5
        y = np.clip(np.arccos(np.clip(directions[..., 2], -1, 1)) / np.pi * height - 0.5, 0, height - 1)
        column, row = np.floor(x).astype(int), np.minimum(np.floor(y).astype(int), height - 2)
        across, down = ((v - i)[..., None].astype(np.float32) for v, i in ((x, column), (y, row)))
        left, right = column % width, (column + 1) % width
        upper = sky[row, left] * (1 - across) + sky[row, right] * across
        lower = sky[row + 1, left] * (1 - across) + sky[row + 1, right] * across
        return upper * (1 - down) + lower * down


def _widened(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The mask (H, W), and all pixels at most `EDGE` columns and rows away from its pixels."""
    height, width = mask.shape
    padded = np.pad(mask, EDGE)
    near = np.zeros_like(mask)
    for down in range(2 * EDGE + 1):
        for across in range(2 * EDGE + 1):
            near |= padded[down : down + height, across : across + width]
    return near


def _smooth(x: Float) -> Float:
    return x * x * (3 - 2 * x)


def veil(picture: Float32, fog: Fog, camera: Camera, geometry: Geometry, is_outdoors: bool = False) -> None:
    """Apply fog in place to a picture (H, W, 4), premultiplied, without its sky; fog that `is_outdoors` covers only the
    ground.
    """
    seen = rasterize(geometry, camera, subdivision=2)
    rays = pixel_rays(camera.intrinsics, 2).reshape(-1, 3)
    depth = Air.for_camera(fog, camera, rays).depth(seen.inverse_depth.reshape(-1))
    triangle = seen.triangle.reshape(-1)
    if is_outdoors:
        depth = np.where(triangle >= geometry.triangle_start[-1], depth, np.float32(0))
    is_there = triangle >= 0
    through, there = (_of_pixels(values, camera) for values in (np.exp(-depth) * is_there, is_there.astype(np.float32)))
    mean = np.where(there > 0, through / np.maximum(there, np.float32(0.25)), 0)
    Air.for_camera(fog, camera).veil(picture.reshape(-1, 4), -np.log(np.maximum(mean, np.float32(1e-30))))


def lay_sky(picture: Float32, fog: Fog, camera: Camera, backdrop: Backdrop | None) -> None:
    """Composite a veiled picture over the sky seen through fog, in place; without a backdrop, only fog is behind it."""
    rows = picture.reshape(-1, 4)
    hidden = rows[:, 3].copy()
    sky = np.zeros((len(rows), 3), np.float32)
    if backdrop is not None:
        rays = np.nan_to_num(pixel_rays(camera.intrinsics)) @ camera.R
        directions = rays / np.maximum(np.linalg.norm(rays, axis=2, keepdims=True), 1e-12)
        sky = (1 - hidden[:, None]) * backdrop.seen(directions).reshape(-1, 3).astype(np.float32)
    rows[:, :3] += Air.for_camera(fog, camera).behind(sky, hidden)
    rows[:, 3] = 1


def _of_pixels(values: NDArray[np.floating], camera: Camera) -> Float32:
    """The mean (H * W,) of values at the quarters of each pixel, (2H * 2W,)."""
    quarters = values.reshape(camera.height, 2, camera.width, 2)
    return quarters.mean(axis=(1, 3)).reshape(-1).astype(np.float32)
