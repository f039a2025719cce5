"""Lens effects away from the axis: chromatic aberration and vignetting."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from viewsphere.model.sensors.camera import Intrinsics

Float32 = NDArray[np.float32]

SPLIT = 0.01
"""Enlargement of red at strength 1, and reduction of blue."""

DARKEST = 0.1
"""Share of its light that the farthest corner keeps at strength 1."""


def chromatic_aberration(picture: Float32, strength: float, intrinsics: Intrinsics) -> Float32:
    """The picture with red and blue scaled about the principal point in opposite directions; alpha covers all three
    channels.
    """
    if strength == 0:
        return picture
    out = picture.copy()
    for channel, sign in ((0, 1), (2, -1)):
        scale = 1 + sign * SPLIT * strength
        out[..., channel] = _scaled(picture[..., channel], scale, intrinsics)
        if picture.shape[2] == 4:
            np.maximum(out[..., 3], _scaled(picture[..., 3], scale, intrinsics), out=out[..., 3])
    return out


def _scaled(plane: Float32, scale: float, intrinsics: Intrinsics) -> Float32:
    """The plane (H, W) enlarged about the principal point, bilinear; its border pixels extend outwards without end."""
    for axis, center in ((0, intrinsics.cy), (1, intrinsics.cx)):
        size = plane.shape[axis]
        at = np.clip((np.arange(size) + 0.5 - center) / scale + center - 0.5, 0, size - 1)
        first = np.minimum(at.astype(np.int64), max(size - 2, 0))
        weight = (at - first).astype(np.float32)
        weight = weight[:, None] if axis == 0 else weight
        low = plane.take(first, axis)
        plane = low + (plane.take(np.minimum(first + 1, size - 1), axis) - low) * weight
    return plane


def vignetting(picture: Float32, strength: float, intrinsics: Intrinsics) -> Float32:
    """The picture with a falloff of cos^4 of the angle to the axis, scaled to the farthest corner's share; alpha is
    unchanged.
    """
    if strength == 0:
        return picture
    height, width = picture.shape[:2]
    x = (np.arange(width, dtype=np.float32) + np.float32(0.5 - intrinsics.cx)) ** 2
    y = (np.arange(height, dtype=np.float32) + np.float32(0.5 - intrinsics.cy)) ** 2
    corner = max(intrinsics.cx, width - intrinsics.cx) ** 2 + max(intrinsics.cy, height - intrinsics.cy) ** 2
    tangent = (1 - (1 - DARKEST) * strength) ** -0.5 - 1  # squared, at the corner: cos^4 is (1 + tan^2)^-2
    share = 1 / np.square(1 + (y[:, None] + x) * np.float32(tangent / corner))
    out = picture.copy()
    out[..., :3] *= share[..., None]
    return out
