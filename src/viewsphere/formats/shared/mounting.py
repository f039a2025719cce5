"""The poses of a rig's sensors in the axes of driving formats, and the measurements of its LiDAR."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import UserError
from viewsphere.formats import Scope
from viewsphere.geometry.rotation import rigid, transform
from viewsphere.model.sample import Sample
from viewsphere.model.sensors.lidar import LIDAR
from viewsphere.model.sensors.rig import Rig

Float = NDArray[np.float64]

CAMERA_FROM_LIDAR = np.array([[0.0, -1, 0, 0], [0, 0, -1, 0], [1, 0, 0, 0], [0, 0, 0, 1]])
"""The rotation from a LiDAR's axes (x ahead, y left, z up) to those of a camera with the same position and direction."""


def mounted(rig: Rig, sensor: int) -> Float:
    """The rigid matrix (4, 4) from the axes of a sensor, by its place in the rig, to the first sensor's axes; OpenCV axes."""
    return np.array(rig.sensors[sensor].rig_from_sensor, np.float64)


def unmoved(matrix: Float) -> Float:
    """The inverse of a rigid matrix (4, 4)."""
    turn = np.ascontiguousarray(matrix[:3, :3].T)
    return rigid(turn, -transform(turn, matrix[:3, 3]))


def centred(matrix: Float) -> Float:
    """A camera matrix K (3, 3) with the centre of the first pixel as origin, from a K with the picture's corner as origin."""
    moved = np.array(matrix)
    moved[:2, 2] -= 0.5
    return moved


def pointless(scope: Scope) -> Iterator[str]:
    """Reasons to refuse, for a format of points: LiDARs that store none."""
    for sensor in scope.rig.sensors if scope.rig else ():
        if sensor.lidar is not None and LIDAR not in sensor.kept_channels(scope.channels):
            yield f"expected channel {LIDAR} of every LiDAR; found none of {sensor.name}"


def measured(sample: Sample) -> NDArray[np.void]:
    """The points of a LiDAR's sample, rows of `viewsphere.model.sensors.lidar.POINT`; raises UserError if there are none."""
    if LIDAR not in sample.channels:
        raise UserError(f"frame {sample.index}: expected channel {LIDAR} of a LiDAR, found none: render it with {LIDAR}")
    return sample.channels[LIDAR]
