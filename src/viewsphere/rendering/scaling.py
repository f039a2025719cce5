"""Pictures enlarged about the principal point."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from viewsphere.model.sensors.camera import Intrinsics

Float32 = NDArray[np.float32]


def scaled(plane: Float32, scale: float, intrinsics: Intrinsics) -> Float32:
    """The plane (H, W) enlarged about the principal point, bilinear; its border pixels extend outwards without end. A scale
    below 0 turns it by 180 degrees.
    """
    for axis, center in ((0, intrinsics.cy), (1, intrinsics.cx)):
        size = plane.shape[axis]
        at = np.clip((np.arange(size) + 0.5 - center) / scale + center - 0.5, 0, size - 1)
        first = np.minimum(at.astype(np.int64), max(size - 2, 0))
        weight = (at - first).astype(np.float32)
        weight = weight[:, None] if axis == 0 else weight
        low = plane.take(first, axis)
        plane = low + (plane.take(np.minimum(first + 1, size - 1), axis) - low) * weight
    return plane
