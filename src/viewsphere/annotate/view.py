"""The camera as an object sees it."""

from __future__ import annotations

import math

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
    rotation = camera_from_object[:3, :3]
    seen = transform(camera_from_object, center)
    distance = math.hypot(*seen.tolist())
    if distance == 0:
        return View(0.0, 0.0, 0.0, 0.0)
    direction = seen / distance
    x, y, z = (float(-c) for c in transform(rotation.T, direction))
    level = math.hypot(x, y)
    elevation = math.atan2(z, level)
    facing = transform(_shortest_turn(direction), rotation.T).T
    if level > 1e-9:
        azimuth = math.atan2(x, -y)
        right = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
        down = np.array([z * math.sin(azimuth), -z * math.cos(azimuth), -level])
        first = facing[0]
        tilt = math.atan2(float((first * down).sum()), float((first * right).sum()))
    else:
        azimuth, tilt = math.atan2(float(facing[0, 1]), float(facing[0, 0])), 0.0
    return View(_degrees(azimuth) % 360.0, _degrees(elevation), distance, _degrees(tilt))


def _degrees(angle: float) -> float:
    """Degrees to 1e-9, so that a full turn less the last digit is 0 and not 360."""
    return round(math.degrees(angle), 9) + 0.0


def _shortest_turn(direction: Float) -> Float:
    """The rotation (3, 3) that takes a unit vector to +z by the shortest way."""
    x, y, z = (float(c) for c in direction)
    if z < -1 + 1e-12:
        return np.diag([1.0, -1.0, -1.0])
    k = 1 / (1 + z)
    return np.array([[1 - k * x * x, -k * x * y, -x], [-k * x * y, 1 - k * y * y, -y], [x, y, z]])
