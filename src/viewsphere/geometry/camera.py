"""The geometry of cameras: orbit viewpoints, rays and projection.

World: right-handed, Z up, metres. Camera axes: x right, y down, z forward (OpenCV). The image spans [0, W] x [0, H];
pixel (i, j) has its centre at (i + .5, j + .5).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from viewsphere.geometry.lenses import Intrinsics, Window

Float = NDArray[np.float64]


def orbit_center(azimuth: float, elevation: float, distance: float) -> Float:
    """Camera centre relative to the target, (3,) metres; angles in radians.

    At azimuth 0 the camera is on -Y and looks along +Y, the rig of Ruiz et al. 2019 and of PASCAL3D+.
    """
    ca, sa, ce, se = math.cos(azimuth), math.sin(azimuth), math.cos(elevation), math.sin(elevation)
    return distance * np.array([ce * sa, -ce * ca, se])


def orbit_rotation(azimuth: float, elevation: float, tilt: float = 0.0) -> Float:
    """World-to-camera rotation (3, 3); angles in radians.

    It does not use a look-at, so elevation 90 degrees is well defined. A positive tilt rolls the camera clockwise seen from
    behind it.
    """
    ca, sa, ce, se = math.cos(azimuth), math.sin(azimuth), math.cos(elevation), math.sin(elevation)
    level = np.array([[ca, sa, 0.0], [se * sa, -se * ca, -ce], [-ce * sa, ce * ca, -se]])
    c, s = math.cos(tilt), math.sin(tilt)
    return np.array(
        [c * level[0] + s * level[1], c * level[1] - s * level[0], level[2]]
    )  # not @: BLAS' rounding varies by processor


def orbit_angles(rotation: ArrayLike) -> tuple[float, float, float]:
    """The azimuth, elevation and tilt, in radians, that `orbit_rotation` turns into this world-to-camera rotation (3, 3).

    Straight above and below, where only the sum or difference of azimuth and tilt is defined, tilt is 0.
    """
    right, _, forward = np.asarray(rotation, np.float64).tolist()
    level = math.hypot(forward[0], forward[1])
    elevation = math.atan2(-forward[2], level)
    if level < 1e-12:
        return math.atan2(right[1], right[0]), elevation, 0.0
    azimuth = math.atan2(-forward[0], forward[1])
    ca, sa, ce, se = math.cos(azimuth), math.sin(azimuth), math.cos(elevation), math.sin(elevation)
    across = right[0] * ca + right[1] * sa
    down = right[0] * se * sa - right[1] * se * ca - right[2] * ce
    return azimuth, elevation, math.atan2(down, across)


def focal_from_sensor(focal: float, sensor: float, extent: float) -> float:
    """Focal length in pixels from the lens' focal length and the sensor's size along `extent` pixels (both in
    the same unit).
    """
    return focal / sensor * extent


def inverse_camera_matrix(intrinsics: Intrinsics) -> Float:
    """K^-1, (3, 3): pixels to (x/z, y/z, 1)."""
    i = intrinsics
    return np.array(
        [
            [1 / i.fx, -i.skew / (i.fx * i.fy), (i.skew * i.cy / i.fy - i.cx) / i.fx],
            [0.0, 1 / i.fy, -i.cy / i.fy],
            [0.0, 0.0, 1.0],
        ]
    )


def pixel_rays(intrinsics: Intrinsics, subdivision: int = 1, window: Window | None = None) -> Float:
    """Directions of the rays through sample centres in camera axes, (H, W, 3): see `Lens.directions`."""
    return intrinsics.lens.directions(subdivision, window)


def project(intrinsics: Intrinsics, points: ArrayLike) -> tuple[Float, NDArray[np.bool_]]:
    """Picture positions of points (..., 3) in camera axes, and whether the lens shows them; see
    `viewsphere.geometry.lenses.Lens.project`.
    """
    return intrinsics.lens.project(points)
