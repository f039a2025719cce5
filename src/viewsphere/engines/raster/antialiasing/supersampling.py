"""Pictures with several samples in every pixel: painted with several times as many pixels each way, and averaged."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from viewsphere.engines.raster.records import Float32
from viewsphere.model.camera import Camera
from viewsphere.truth.raster.geometry import Geometry
from viewsphere.truth.raster.visibility import Visibility, rasterize

Paint = Callable[[Camera, Visibility, Float32, Float32], None]
"""Fills the light (H * W, 4) that a camera sees, and its parts (H * W, C), which are 0 before, or (0, 0)."""


def paint_finely(
    paint: Paint, times: int, geometry: Geometry, camera: Camera, visibility: Visibility, radiance: Float32, split: Float32
) -> None:
    """Fill `radiance` (H * W, 4) and `split` (H * W, C) with the means of what `paint` gives for `times` as many pixels each
    way; `visibility` is truth's buffer for this camera.
    """
    if times == 1:
        paint(camera, visibility, radiance, split)
        return
    large = larger(camera, times)
    light, parts = (np.zeros((len(values) * times * times, values.shape[1]), np.float32) for values in (radiance, split))
    paint(large, rasterize(geometry, large), light, parts)
    for fine, coarse in ((light, radiance), (parts, split)):
        if len(coarse):
            _average(fine.reshape(camera.height, times, camera.width, times, -1), coarse)


def larger(camera: Camera, times: int) -> Camera:
    """The camera whose picture is the same with `times` as many pixels each way."""
    lens = camera.intrinsics
    scaled = {name: times * getattr(lens, name) for name in ("width", "height", "fx", "fy", "cx", "cy", "skew")}
    return Camera(lens.model_copy(update=scaled), camera.R, camera.t)


def _average(fine: Float32, coarse: Float32) -> None:
    """Fill coarse (H * W, C) with means of fine (H, times, W, times, C)."""
    total = coarse.reshape(fine.shape[0], fine.shape[2], -1)
    total[:] = 0
    for down in range(fine.shape[1]):
        for across in range(fine.shape[3]):
            total += fine[:, down, :, across]
    total /= np.float32(fine.shape[1] * fine.shape[3])
