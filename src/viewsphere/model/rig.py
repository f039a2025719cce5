"""A rig: sensors that are mounted to one another and move together."""

from __future__ import annotations

from pydantic import Field, model_validator

from viewsphere.model.camera import Intrinsics
from viewsphere.model.frozen import Frozen
from viewsphere.model.scene import IDENTITY, Matrix4

CAMERA = "camera"
"""Default name of a rig's only sensor."""


class Sensor(Frozen):
    """A camera of a rig: its lens, and where it is mounted. `rig_from_sensor` is rigid, OpenCV axes on both sides, metres."""

    intrinsics: Intrinsics
    name: str = Field(default=CAMERA, pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$", max_length=64)
    rig_from_sensor: Matrix4 = IDENTITY


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

    @staticmethod
    def of(intrinsics: Intrinsics) -> Rig:
        """The rig of one camera with this lens."""
        return Rig(sensors=(Sensor(intrinsics=intrinsics),))
