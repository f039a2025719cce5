"""The camera as an object sees it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.rotation import transform
from viewsphere.model.sample import View

Float = NDArray[np.float64]


def view_of(camera_from_object: Float, center: Float) -> View:
    """Orbit angles, distance and tilt of the camera around the point `center` (3,) of the object's own axes.

    Azimuth is in [0, 360). Tilt is in [-180, 180]: the camera's roll once it is turned, by the shortest
    way, to look at the point; so for a camera that looks at it anyway these are the numbers of its pose.
    Straight above or below, where azimuth and tilt are one, tilt is 0.
    """
    columns: list[list[float]] = camera_from_object[:3, :3].T.tolist()
    seen = transform(camera_from_object, center)
    distance = math.hypot(*seen.tolist())
    if distance == 0:
        return View(0.0, 0.0, 0.0, 0.0)
    direction: list[float] = (seen / distance).tolist()
    x, y, z = (-_dot(column, direction) for column in columns)
    level = math.hypot(x, y)
    elevation = math.atan2(z, level)
    first = _shortest_turn(*direction)
    facing = [_dot(first, column) for column in columns]
    if level > 1e-9:
        azimuth = math.atan2(x, -y)
        right = math.cos(azimuth), math.sin(azimuth), 0.0
        down = z * math.sin(azimuth), -z * math.cos(azimuth), -level
        tilt = math.atan2(_dot(facing, down), _dot(facing, right))
    else:
        azimuth, tilt = math.atan2(facing[1], facing[0]), 0.0
    return View(_degrees(azimuth) % 360.0, _degrees(elevation), distance, _degrees(tilt))


def _degrees(angle: float) -> float:
    """Degrees to 1e-9, so that a full turn less the last digit is 0 and not 360."""
    return round(math.degrees(angle), 9) + 0.0


def _shortest_turn(x: float, y: float, z: float) -> tuple[float, float, float]:
    """The first row of the rotation that takes the unit vector (x, y, z) to +z by the shortest way."""
    if z < -1 + 1e-12:
        return 1.0, 0.0, 0.0
    k = 1 / (1 + z)
    return 1 - k * x * x, -k * x * y, -x


def _dot(a: Sequence[float], b: Sequence[float]) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
