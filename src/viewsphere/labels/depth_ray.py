"""depth_ray: distance along a pixel's ray, as range finders measure it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.camera import pixel_rays
from viewsphere.labels._label import ChannelLabel, Models, channel_of
from viewsphere.labels._sight import Sight
from viewsphere.model.sample import Sample

TOLERANCE = 1e-6
"""Tolerance of the proof as a share of the distance: both channels are rounded to float32."""


def compute(sight: Sight) -> NDArray[np.float32]:
    """Distance from the camera's centre to the seen point, (H, W) metres, infinite where nothing is seen.

    The distance is the length of the pixel's ray divided by `truth.visibility`'s s: never negative, not even behind a fisheye.
    """
    length = np.linalg.norm(pixel_rays(sight.camera.intrinsics), axis=-1)
    out = np.full(length.shape, np.inf, np.float32)
    seen = sight.visibility.inverse_depth > 0
    out[seen] = length[seen] / sight.visibility.inverse_depth[seen]
    return out


def prove(sample: Sample, models: Models) -> Iterator[str]:
    """The distance is depth times the length of the pixel's ray whose z is 1."""
    distance, depth = channel_of(sample, "depth_ray"), channel_of(sample, "depth")
    if distance is None:
        return
    if not (distance > 0).all():
        yield "expected metres above 0, or infinity where nothing is seen; found others"
    if depth is None or sample.known_camera is None or sample.files.get("depth", "").endswith(".png"):
        return  # PNG keeps depth in whole steps
    rays = pixel_rays(sample.camera.intrinsics)
    seen = np.isfinite(depth)
    expected = np.abs(depth[seen]) * np.linalg.norm(rays[seen], axis=-1)
    found = distance[seen] * np.abs(rays[seen][:, 2])
    if not np.array_equal(np.isfinite(distance), seen) or not np.allclose(found, expected, rtol=TOLERANCE, atol=0):
        yield "expected depth times the length of each pixel's ray; found other distances"


LABEL = ChannelLabel(
    name="depth_ray",
    meaning="distance from the camera's centre, along the pixel's ray",
    axes="camera",
    dtype=np.float32,
    unit="m",
    empty=np.inf,
    compute=compute,
    prove=prove,
)
