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


def nearness(depth: NDArray[np.float32], within: Extent) -> NDArray[np.float64]:
    """From 1 at the extent's near end to 0 at its far end and beyond, (H, W), 0 too where there is no depth.

    Twice as far is as much less everywhere, else a street's horizon would leave its cars one white.
    """
    near, far = (max(end, NEAREST) for end in within)
    times = np.log(np.clip(depth, near, max(near, far)) / near)
    return np.where(np.isfinite(depth), 1.0 - times / max(np.log(far / near), 1e-9), 0.0)


def picture(depth: NDArray[np.float32], within: Extent | None = None) -> Picture:
    """Depth as a picture (H, W, 3) uint8: near is light, far is dark by factors of distance, and pixels without depth are
    black.
    """
    grey = np.where(np.isfinite(depth), 0.15 + 0.85 * nearness(depth, within or extent(depth)), 0.0)
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
