"""Blurs that are uniform across the picture: a kernel's taps applied to pictures with border pixels repeated outwards.

Beyond a side of a full turn, they see the columns of the other side.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]


def spread(picture: Float32, kernel: Float32, wraps: bool = False) -> Float32:
    """The picture (H, W, C) correlated with a kernel of odd sides (h, w); only taps that are not 0 cost time. `wraps`: the
    picture shows a full turn.
    """
    from viewsphere.rendering import kernels_spread as kernels

    height, width, channels = picture.shape
    up, left = kernel.shape[0] // 2, kernel.shape[1] // 2
    wide = np.pad(picture, ((0, 0), (left, left), (0, 0)), mode="wrap" if wraps else "edge")
    padded = np.pad(wide, ((up, up), (0, 0), (0, 0)), mode="edge").reshape(height + 2 * up, -1)
    rows, columns = np.nonzero(kernel)
    out = np.empty((height, width * channels), np.float32)
    kernels.spread(padded, channels, rows, columns, kernel[rows, columns].astype(np.float32), out)
    return out.reshape(picture.shape)


def spread_both_ways(picture: Float32, profile: Float32, wraps: bool = False) -> Float32:
    """The picture correlated with a kernel that is the product of one profile (odd length) down and across."""
    return spread(spread(picture, profile[None, :], wraps), profile[:, None])


def gaussian(sigma: float) -> Float32:
    """Weights of a Gaussian cut off at 3.5 sigma, each integrated over its pixel; they sum to 1."""
    reach = max(1, math.ceil(3.5 * sigma))
    edges = (np.arange(-reach, reach + 2) - 0.5) / (max(sigma, 1e-6) * math.sqrt(2))
    cumulative = np.array([math.erf(e) for e in edges])
    weights = np.diff(cumulative)
    return (weights / weights.sum()).astype(np.float32)


def box(half: float) -> Float32:
    """Weights of a box from -half - 1/2 to half + 1/2 pixels; they sum to 1."""
    reach = math.ceil(half)
    weights = np.clip(half + 1 - np.abs(np.arange(-reach, reach + 1)), 0, 1)
    return (weights / weights.sum()).astype(np.float32)
