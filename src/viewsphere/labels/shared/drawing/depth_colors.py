"""Distances as greys: near is light."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from viewsphere.labels.shared.spec import Extent, Picture

NEAREST = 0.01
"""Smallest depth in metres that a picture of depth distinguishes."""


def extent(depth: NDArray[np.float32]) -> Extent:
    """The nearest depth, and the depth that 98 % of the pixels do not exceed; a ground up to the horizon then leaves greys."""
    seen = depth[np.isfinite(depth)]
    return (0.0, 0.0) if not seen.size else (float(seen.min()), float(np.percentile(seen, 98)))


def nearness(depth: NDArray[np.float32], within: Extent) -> NDArray[np.float64]:
    """Nearness (H, W) from 1 at the extent's near end to 0 at its far end and beyond; also 0 where there is no depth.

    The scale is logarithmic. On a linear scale a street's horizon would leave its cars a uniform white.
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
