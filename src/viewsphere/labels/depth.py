"""depth: distance along the camera's z axis."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from viewsphere.labels._label import ChannelLabel, Drawing, Extent, Models, Picture, channel_of
from viewsphere.labels._sight import Sight
from viewsphere.model.sample import Sample

NEAREST = 0.01
"""Metres that a picture of depth tells apart from less."""


def compute(sight: Sight) -> NDArray[np.float32]:
    """z of the seen point, (H, W) metres, infinite where nothing is seen; negative behind the image plane of a fisheye."""
    from viewsphere.truth import kernels_channels as kernels

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


def extent(depth: NDArray[np.float32]) -> Extent:
    """The nearest depth, and that which 98 % of the pixels do not exceed, so that a ground up to the horizon leaves greys."""
    seen = depth[np.isfinite(depth)]
    return (0.0, 0.0) if not seen.size else (float(seen.min()), float(np.percentile(seen, 98)))


def picture(depth: NDArray[np.float32], within: Extent | None = None) -> Picture:
    """Depth as a picture (H, W, 3) uint8: near is light, far is dark, and pixels without depth are black.

    Twice as far is as much darker everywhere, else a street's horizon would leave its cars one white.
    """
    seen = np.isfinite(depth)
    grey = np.zeros(depth.shape, np.float64)
    near, far = (max(end, NEAREST) for end in within or extent(depth))
    times = np.log(np.maximum(depth[seen], near) / near)
    grey[seen] = 1.0 - 0.85 * np.clip(times / max(np.log(far / near), 1e-9), 0, 1)
    return np.repeat((grey * 255).astype(np.uint8)[..., None], 3, axis=2)


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
