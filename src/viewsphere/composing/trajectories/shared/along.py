"""A rig that moves along a curve."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.curve import Curve

Float = NDArray[np.float64]


def level(curve: Curve, lengths: Float) -> Float:
    """Level unit vectors (T, 3) along a curve at these lengths (T,); where it is vertical, along +Y."""
    x, y = curve.direction(lengths)[:, :2].T
    run = np.sqrt(x * x + y * y)
    safe = np.where(run > 0, run, 1.0)
    return np.stack([np.where(run > 0, x / safe, 0.0), np.where(run > 0, y / safe, 1.0), np.zeros(len(run))], axis=1)
