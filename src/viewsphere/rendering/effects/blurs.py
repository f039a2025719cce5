"""Blurs that are uniform across the picture: a Gaussian, and the motion of the camera during the exposure."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from viewsphere.rendering.spread import gaussian, spread, spread_both_ways

Float32 = NDArray[np.float32]

SIGMA = 1 / 50
"""Sigma of the Gaussian at strength 1, in widths of the picture."""

STREAK = 1 / 12
"""Length of the streak at strength 1, in widths of the picture."""


def blur(picture: Float32, strength: float) -> Float32:
    """The picture blurred by a Gaussian, in linear light; the sum of the light is kept."""
    sigma = strength * SIGMA * picture.shape[1]
    return spread_both_ways(picture, gaussian(sigma)) if strength > 0 else picture


def motion_blur(picture: Float32, strength: float, angle_deg: float) -> Float32:
    """The mean of the picture along a straight streak; its angle is counter-clockwise from the right."""
    return spread(picture, streak(strength * STREAK * picture.shape[1], angle_deg)) if strength > 0 else picture


def streak(length: float, angle_deg: float) -> Float32:
    """Weights of a centred segment of this length in pixels: each is the share of the segment in a bilinear pixel."""
    steps = max(1, math.ceil(8 * length))
    along = ((np.arange(steps) + 0.5) / steps - 0.5) * length
    x, y = along * math.cos(math.radians(angle_deg)), -along * math.sin(math.radians(angle_deg))
    across, down = math.ceil(abs(x).max()), math.ceil(abs(y).max())
    kernel = np.zeros((2 * down + 3, 2 * across + 3))
    left, top = np.floor(x), np.floor(y)
    for right_side in (0, 1):
        for bottom in (0, 1):
            weight = np.abs(1 - right_side - (x - left)) * np.abs(1 - bottom - (y - top))
            row, column = (top + bottom).astype(int) + down + 1, (left + right_side).astype(int) + across + 1
            np.add.at(kernel, (row, column), weight)
    return (kernel / steps).astype(np.float32)
