"""Fog over pictures of Blender's renderers, in the closed form of `weather.fog`: rendering a volume would add noise.

At an outline a pixel is veiled by the mean of what its quarters let through, as it is not known which of its light came from
where; the raster engine veils each of its samples.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.shared.blender.backdrop import Backdrop
from viewsphere.geometry.camera import pixel_rays
from viewsphere.model.camera import Camera
from viewsphere.model.weather import Fog
from viewsphere.rendering.weather.fog import Air
from viewsphere.truth.raster.geometry import Geometry
from viewsphere.truth.raster.visibility import rasterize

Float32 = NDArray[np.float32]


def veil(picture: Float32, fog: Fog, camera: Camera, geometry: Geometry, is_outdoors: bool = False) -> None:
    """Veil what a picture (H, W, 4), premultiplied, without its sky shows, in place; of fog that `is_outdoors` its ground."""
    seen = rasterize(geometry, camera, subdivision=2)
    rays = pixel_rays(camera.intrinsics, 2).reshape(-1, 3)
    depth = Air.of(fog, camera, rays).depth(seen.inverse_depth.reshape(-1))
    triangle = seen.triangle.reshape(-1)
    if is_outdoors:
        depth = np.where(triangle >= geometry.triangle_start[-1], depth, np.float32(0))
    is_there = triangle >= 0
    through, there = (_of_pixels(values, camera) for values in (np.exp(-depth) * is_there, is_there.astype(np.float32)))
    mean = np.where(there > 0, through / np.maximum(there, np.float32(0.25)), 0)
    Air.of(fog, camera).veil(picture.reshape(-1, 4), -np.log(np.maximum(mean, np.float32(1e-30))))


def lay_sky(picture: Float32, fog: Fog, camera: Camera, backdrop: Backdrop | None) -> None:
    """Lay a veiled picture over the sky as fog shows it, in place; without a backdrop there is fog alone."""
    rows = picture.reshape(-1, 4)
    hidden = rows[:, 3].copy()
    sky = np.zeros((len(rows), 3), np.float32)
    if backdrop is not None:
        rays = np.nan_to_num(pixel_rays(camera.intrinsics)) @ camera.R
        directions = rays / np.maximum(np.linalg.norm(rays, axis=2, keepdims=True), 1e-12)
        sky = (1 - hidden[:, None]) * backdrop.seen(directions).reshape(-1, 3).astype(np.float32)
    rows[:, :3] += Air.of(fog, camera).behind(sky, hidden)
    rows[:, 3] = 1


def _of_pixels(values: NDArray[np.floating], camera: Camera) -> Float32:
    """The mean (H * W,) of values at the quarters of each pixel, (2H * 2W,)."""
    quarters = values.reshape(camera.height, 2, camera.width, 2)
    return quarters.mean(axis=(1, 3)).reshape(-1).astype(np.float32)
