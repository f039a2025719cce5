"""An instant: a moment at which all sensors of a rig take their pictures, and the state that may change with it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from viewsphere.geometry.camera import orbit_angles
from viewsphere.geometry.pose_category import pose_category
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.omit_none import OmitNone
from viewsphere.model.scene import Finish, Matrix4, Vector
from viewsphere.model.sensors.camera import Intrinsics

NEAREST = 1e-3
"""Smallest distance, in metres ahead of a camera, of the point that it looks at."""


class Moment(Frozen):
    """A time step: a frame of an animated file, and the seconds since that file's first frame."""

    frame: int
    seconds: float


class Viewpoint(OmitNone):
    """The place of a camera on a sphere around its target, and its time.

    Attributes:
        index: Number of the pose.
        azimuth_deg: Azimuth in degrees.
        elevation_deg: Elevation in degrees.
        distance: Distance from the target in metres.
        tilt_deg: Roll in degrees; positive is clockwise, seen from behind the camera.
        target: Point in world metres; None: the box centre of object 1.
        category: Name of the side that the camera sees: front, front-left, ..., top.
        time: Moment of an animation; None if nothing is animated.
        fill: Share of the picture that a model fills, if the distance follows from it; see `composing.filling`.
    """

    OMIT_IF_NONE = ("fill",)

    index: int
    azimuth_deg: float
    elevation_deg: float
    distance: float = Field(gt=0)
    tilt_deg: float = 0.0
    target: Vector | None = None
    category: str = ""  # named bin: front, front-left, ..., top
    time: Moment | None = None  # where something is animated
    fill: float | None = None

    def rounded(self) -> Viewpoint:
        """The viewpoint rounded to nine decimal places, because the last digits of angles from a matrix differ between
        processors.
        """
        names = ("azimuth_deg", "elevation_deg", "distance", "tilt_deg")
        values = {name: round(getattr(self, name), 9) + 0.0 for name in names}
        values["azimuth_deg"] %= 360.0
        target = None if self.target is None else tuple(round(v, 9) + 0.0 for v in self.target)
        return self.model_copy(update={**values, "target": target})


def viewpoint_of(
    world_from_camera: ArrayLike, focus: Vector, index: int, bins: float = 45.0, time: Moment | None = None
) -> Viewpoint:
    """The viewpoint of a camera with this pose (4, 4), OpenCV axes: around the point on its axis that is nearest to `focus`, or
    1 m ahead of the camera if that point is behind it. `bins`: width of the named categories, degrees.
    """
    pose = np.asarray(world_from_camera, np.float64)
    rotation, center = np.ascontiguousarray(pose[:3, :3].T), pose[:3, 3]
    ahead = float((rotation[2] * (np.asarray(focus) - center)).sum())
    distance = ahead if ahead > NEAREST else 1.0
    azimuth, elevation, tilt = (math.degrees(a) for a in orbit_angles(rotation))
    x, y, z = (center + distance * rotation[2]).tolist()
    return Viewpoint(
        index=index,
        azimuth_deg=azimuth % 360.0,
        elevation_deg=elevation,
        distance=distance,
        tilt_deg=tilt,
        target=(x, y, z),
        category=pose_category(azimuth % 360.0, elevation, bins),
        time=time,
    )


class Instant(Frozen):
    """One instant of a shot: the pose of the rig, the point that it looks at, and the finish and lens of its pictures.

    `index` counts from 0, in the sequence or, for still pictures, in the data set. `world_from_rig` is the pose of the rig's
    first sensor (OpenCV axes, metres); `focus` (world metres) is what it looks at. `viewpoint` is the requested pose, if it
    comes from a grid or list. `finish` replaces the scene's finish. For a zooming lens, `intrinsics` replaces the intrinsics of
    the rig's first sensor, and of sensors with the same ones, at the same size. An instant that is not `recorded` has no
    picture: labels of other instants need it.
    """

    index: int
    world_from_rig: Matrix4
    focus: Vector
    seconds: float = 0.0
    viewpoint: Viewpoint | None = None
    split: str = ""
    finish: Finish | None = None
    intrinsics: Intrinsics | None = None
    recorded: bool = True
