"""A rig: sensors that are mounted to one another and move together."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import permutations
from typing import NamedTuple

import numpy as np
from pydantic import Field, model_validator

from viewsphere.geometry.rotation import transform
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.omit_none import OmitNone
from viewsphere.model.scene import IDENTITY, Matrix4
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.model.sensors.imager import MountedImager
from viewsphere.model.sensors.lidar import LIDAR, Lidar

CAMERA = "camera"
"""Default name of a rig's only sensor."""


class Sensor(OmitNone):
    """A camera or a LiDAR of a rig: its lens and its mounting. `rig_from_sensor` is rigid, OpenCV axes on both sides, metres.
    `channels` are the channels of the shot that it keeps; None: all but points for a camera, points alone for a LiDAR. `lidar`
    holds the measurement settings; None for a camera. `imager` is the sensor behind a camera's lens, None for a perfect one.
    """

    OMIT_IF_NONE = ("channels", "lidar", "imager")

    intrinsics: Intrinsics
    name: str = Field(default=CAMERA, pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$", max_length=64)
    rig_from_sensor: Matrix4 = IDENTITY
    channels: tuple[str, ...] | None = None
    lidar: Lidar | None = None
    imager: MountedImager | None = None

    def kept_channels(self, channels: tuple[str, ...]) -> tuple[str, ...]:
        """Return the channels of a shot that the sensor keeps, in the shot's order."""
        own = self.channels
        if own is None:
            return tuple(name for name in channels if (name == LIDAR) == (self.lidar is not None))
        return tuple(name for name in channels if name in own)


class Pair(NamedTuple):
    """Two sensors of a rig, by their places in it, whose pictures are rectified, and the metres between them; of panoramas,
    `left` is the upper one.
    """

    left: int
    right: int
    baseline: float


class Rig(Frozen):
    """One or more sensors; the rig's axes are those of the first."""

    sensors: tuple[Sensor, ...] = Field(min_length=1)

    @model_validator(mode="after")
    def _named_once(self) -> Rig:
        names = [sensor.name for sensor in self.sensors]
        if len({name.casefold() for name in names}) != len(names):
            raise ValueError(f"expected sensors of different names; found {', '.join(names)}")
        if self.sensors[0].rig_from_sensor != IDENTITY:
            raise ValueError(f"expected the rig's axes to be those of its first sensor; found {names[0]} mounted elsewhere")
        return self

    @property
    def rolls(self) -> bool:
        """Return whether any camera has a rolling shutter."""
        return any(sensor.intrinsics.rolling is not None for sensor in self.sensors)

    @property
    def rectified(self) -> tuple[Pair, ...]:
        """The pairs of sensors with equal pinhole lenses and equal axes, one of them on the other's x axis."""
        return tuple(pair for pair in self._pairs if self.sensors[pair.left].intrinsics.lens.is_linear)

    @property
    def stacked(self) -> tuple[Pair, ...]:
        """The pairs of sensors with equal panoramas and equal axes, one of them on the other's y axis: points move along
        columns.
        """
        return tuple(pair for pair in self._pairs if not self.sensors[pair.left].intrinsics.lens.is_linear)

    @property
    def _pairs(self) -> Iterator[Pair]:
        numbered = permutations(enumerate(self.sensors), 2)
        pairs = ((i, j, _baseline(left, right)) for (i, left), (j, right) in numbered)
        return (Pair(i, j, baseline) for i, j, baseline in pairs if baseline is not None)

    def partner(self, sensor: int) -> tuple[str, float] | None:
        """Name of the first sensor that is rectified with this one (counted from 0), or of the first panorama above or below
        it, and their distance in metres; or None.
        """
        pairs = tuple(self._pairs)
        beside = sorted((right if left == sensor else left, b) for left, right, b in pairs if sensor in (left, right))
        return (self.sensors[beside[0][0]].name, beside[0][1]) if beside else None

    @staticmethod
    def single(intrinsics: Intrinsics) -> Rig:
        """The rig of one camera with this lens."""
        return Rig(sensors=(Sensor(intrinsics=intrinsics),))


STRAIGHT = 1e-9
"""Tolerance for the numbers of equal axes, and for a baseline's direction along the x axis."""


def _baseline(left: Sensor, right: Sensor) -> float | None:
    """Metres from the left sensor to the right one along x, or from the upper panorama to the lower one along y; None if they
    are not rectified in this order.
    """
    lens = left.intrinsics.lens
    if left.intrinsics != right.intrinsics or not (lens.is_linear or not lens.has_depth):
        return None
    a, b = np.array(left.rig_from_sensor), np.array(right.rig_from_sensor)
    if np.abs(a[:3, :3] - b[:3, :3]).max() > STRAIGHT:
        return None
    x, y, z = transform(a[:3, :3].T, b[:3, 3] - a[:3, 3]).tolist()
    along, beside = (x, y) if lens.is_linear else (y, x)
    return along if along > 0 and max(abs(beside), abs(z)) <= STRAIGHT * along else None
