"""The check that labels of places share: it finds points that their pixels do not show, or not at their depth."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.camera import pixel_rays
from viewsphere.labels.shared.spec import Array, channel_of
from viewsphere.model.sample import Sample

Float = NDArray[np.float64]

ROUNDING = 4e-7
"""Share of the numbers that a point was computed from by which float32 may move it."""


def exact_depth(sample: Sample) -> Array | None:
    """The depth of a sample, None where it is not kept, or is kept in whole steps: only PNG files do that."""
    return None if sample.files.get("depth", "").endswith(".png") else channel_of(sample, "depth")


def misplaced(sample: Sample, points: Float, pixels: NDArray[np.bool_], slack: Float) -> NDArray[np.bool_]:
    """Return a mask of the points (N, 3), metres in a camera's axes, that are off the rays of these pixels (H, W). N pixels are
    True. Points off their depth count too, where depth is exact; `slack` (N,) is the rounding error in metres.
    """
    rays = pixel_rays(sample.camera.intrinsics)
    rays = rays.reshape(-1, 3) if pixels.all() else rays[pixels]
    x, y, z = points.T  # by columns: numpy takes long over rows of three
    a, b, c = rays.T
    along = (x * a + y * b + z * c) / (a * a + b * b + c * c)
    x, y, off = x - along * a, y - along * b, z - along * c
    wrong = ~((along > 0) & (x * x + y * y + off * off <= slack * slack))
    depth = exact_depth(sample)
    if depth is not None:
        wrong |= ~(np.abs(z - depth[pixels]) <= slack)
    return wrong


def largest(rows: Float) -> Float:
    """The greatest absolute value in each row of three, (N,)."""
    x, y, z = np.abs(rows).T
    return np.maximum(np.maximum(x, y), z)
