"""depth: distance along the camera's z axis."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from viewsphere.labels.shared.drawing.depth_colors import extent, picture
from viewsphere.labels.shared.spec import ChannelLabel, Drawing, Models, channel_of
from viewsphere.model.sample import Sample

if TYPE_CHECKING:
    from viewsphere.labels.shared.context import Sight


def compute(sight: Sight) -> NDArray[np.float32]:
    """z of the seen point, (H, W) metres, infinite where nothing is seen; negative behind the image plane of a fisheye."""
    from viewsphere.truth.raster import kernels_channels as kernels

    out = sight.empty(np.float32)
    kernels.depths(sight.visibility.inverse_depth, sight.rays, out)
    return out


def prove(sample: Sample, models: Models) -> Iterator[str]:
    """Depth is metres, and finite wherever an object is seen."""
    depth, instances = channel_of(sample, "depth"), channel_of(sample, "instances")
    if depth is None:
        return
    if np.isnan(depth).any():
        yield "expected metres, or infinity where nothing is seen; found NaN"
    elif instances is not None and np.isinf(depth[instances > 0]).any():
        yield f"expected metres where an object is seen; found infinity at {np.isinf(depth[instances > 0]).sum()} pixels"


LABEL = ChannelLabel(
    name="depth",
    meaning="distance along the camera's z axis",
    axes="camera",
    dtype=np.float32,
    unit="m",
    empty=np.inf,
    compute=compute,
    prove=prove,
    drawing=Drawing(
        "depth",
        within=lambda sample, within: picture(sample.channels["depth"], within),
        extent=lambda sample: extent(sample.channels["depth"]),
        key=(("depth: light is near", None),),
    ),
)
