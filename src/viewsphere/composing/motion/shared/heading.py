"""The turning of things along their path: a model's front, -Y, points ahead."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from viewsphere.composing.motion.shared.start import Pose

Float = NDArray[np.float64]

Heading = Literal["keep", "level", "along"]
"""keep: unchanged; level: turned about the vertical only, upright; along: also tilted uphill and downhill."""

LEVEL = 1e-9
"""Length of a unit vector's horizontal part below which the vector counts as vertical, without an azimuth."""


def headed(pose: Pose, direction: ArrayLike, heading: Heading) -> Pose:
    """Return the pose with its front (-Y) turned to a unit vector (3,) of the world. A vertical vector leaves it unchanged."""
    x, y, z = np.asarray(direction, np.float64).tolist()
    level = math.hypot(x, y)
    if heading == "keep" or level < LEVEL:
        return pose
    run, rise = (level, z) if heading == "along" else (1.0, 0.0)
    c, s = x / level, y / level
    left, back, up = (-s, c, 0.0), (-c * run, -s * run, -rise), (-c * rise, -s * rise, run)
    return pose.facing(np.array([left, back, up]).T)


def to_the_right(direction: ArrayLike) -> Float:
    """The level unit vector (3,) to the right of a direction (3,), seen from above; zero if it is vertical."""
    x, y, _ = np.asarray(direction, np.float64).tolist()
    level = math.hypot(x, y)
    return np.zeros(3) if level < LEVEL else np.array([y / level, -x / level, 0.0])
