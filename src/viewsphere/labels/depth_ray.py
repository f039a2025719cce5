"""depth_ray: distance along a pixel's ray, as range finders measure it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.camera import pixel_rays
from viewsphere.labels.shared.drawing.depth_colors import extent, picture
from viewsphere.labels.shared.spec import ChannelLabel, Drawing, Models, channel_of
from viewsphere.model.sample import Sample

if TYPE_CHECKING:
    from viewsphere.labels.shared.context import Sight


def compute(sight: Sight) -> NDArray[np.float32]:
    """Distance from the camera's centre to the seen point, (H, W) metres, infinite where nothing is seen.

    It is the length of the pixel's ray times 1/s of `truth.raster.visibility`: never negative, behind a fisheye neither.
    """
    length = np.linalg.norm(pixel_rays(sight.camera.intrinsics), axis=-1)
    out = np.full(length.shape, np.inf, np.float32)
    seen = sight.visibility.inverse_depth > 0
    out[seen] = length[seen] / sight.visibility.inverse_depth[seen]
    return out


def prove(sample: Sample, models: Models) -> Iterator[str]:
    """Distances are metres above 0, and finite where depth is. Depth may be kept in steps, so the numbers are not compared."""
    distance, depth = channel_of(sample, "depth_ray"), channel_of(sample, "depth")
    if distance is None:
        return
    if not (distance > 0).all():
        yield "expected metres above 0, or infinity where nothing is seen; found others"
    if depth is not None and not np.array_equal(np.isfinite(distance), np.isfinite(depth)):
        yield "expected finite distances where depth is finite, and nowhere else; found others"


LABEL = ChannelLabel(
    name="depth_ray",
    meaning="distance from the camera's centre, along the pixel's ray",
    axes="camera",
    dtype=np.float32,
    unit="m",
    empty=np.inf,
    compute=compute,
    prove=prove,
    drawing=Drawing(
        "depth_ray",
        within=lambda sample, within: picture(sample.channels["depth_ray"], within),
        extent=lambda sample: extent(sample.channels["depth_ray"]),
        key=(("depth_ray: light is near", None),),
    ),
)
