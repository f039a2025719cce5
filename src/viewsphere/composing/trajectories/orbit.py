"""A circle, or a part of one, around the rig's target."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator, model_validator

from viewsphere.composing.trajectories.shared.aim import around, focuses
from viewsphere.composing.trajectories.shared.world import RigPose, World
from viewsphere.model.fields.numbers import Number
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.plugins.trajectory import TrajectorySpec
from viewsphere.recipe.cameras.aim import AZIMUTH, DISTANCE, ELEVATION, TILT, in_elevation, in_reach
from viewsphere.recipe.cameras.trajectories import LOOK, Drift, Look, Moving, Place, ends

Float = NDArray[np.float64]


class OrbitPath(Moving):
    """A circle, or a part of one, around the camera's target."""

    kind: Literal["orbit"] = Field(description="a circle around its target")
    look: Look = Field(default="center", description=f"the centre of its circle: {LOOK}; not ahead")
    azimuth: Drift = Field(default=0.0, description=f"degrees, a number or [from, to]; {AZIMUTH}")
    elevation: Drift = Field(default=20.0, description=f"degrees {ELEVATION}; a number or [from, to]")
    distance: Drift = Field(description=f"{DISTANCE}; a number or [from, to]")
    tilt: Drift = Field(default=0.0, description=f"degrees, a number or [from, to]; {TILT}")
    turns: Number | None = Field(
        default=None,
        description="turns over the sequence, counter-clockwise from above; after a whole turn, the next instant would "
        "repeat the first; 1 by default if azimuth is a number",
    )
    speed_deg: Number | None = Field(default=None, description="instead of turns: degrees per second")

    @field_validator("look")
    @classmethod
    def _around(cls, value: int | str | Place) -> int | str | Place:
        if value == "ahead":
            raise ValueError("expected what to go around; found ahead")
        return value

    @field_validator("elevation")
    @classmethod
    def _elevation(cls, value: float | tuple[float, float]) -> float | tuple[float, float]:
        in_elevation(min(ends(value)), max(ends(value)))
        return value

    @field_validator("distance", mode="before")
    @classmethod
    def _in_metres(cls, value: Any) -> Any:
        if isinstance(value, dict) and "fill" in value:
            raise ValueError("expected metres, as what moves fills another share of every picture; found fill: give a distance")
        return value

    @field_validator("distance")
    @classmethod
    def _distance(cls, value: float | tuple[float, float]) -> float | tuple[float, float]:
        in_reach(min(ends(value)), max(ends(value)))
        return value

    @model_validator(mode="after")
    def _one_pace(self) -> OrbitPath:
        given = [n for n in ("turns", "speed_deg") if getattr(self, n) is not None]
        given += ["azimuth: [from, to]"] if isinstance(self.azimuth, tuple) else []
        if len(given) > 1:
            raise ValueError(f"expected one of azimuth: [from, to], turns and speed_deg; found {' and '.join(given)}")
        return self


@dataclass(frozen=True, eq=False)
class _Orbit:
    """An orbit whose angles and distance change linearly with time."""

    entry: OrbitPath
    digest: str = ""
    intrinsics: Intrinsics | None = None

    def poses(self, times: Float, world: World) -> tuple[RigPose, ...]:
        """See `Trajectory.poses`."""
        entry = self.entry
        elevation, distance, tilt = (_drifted(ends(v), times) for v in (entry.elevation, entry.distance, entry.tilt))
        focus = focuses(entry, entry.look, times, world)
        assert focus is not None
        parts = zip(focus, self._azimuths(times, world.fps).tolist(), elevation, distance, tilt, strict=True)
        return tuple(around(*part) for part in parts)

    def _azimuths(self, times: Float, fps: float) -> Float:
        entry = self.entry
        if isinstance(entry.azimuth, tuple):
            return np.array(_drifted(entry.azimuth, times))
        if entry.speed_deg is not None:
            return entry.azimuth + entry.speed_deg * times
        turns = 1.0 if entry.turns is None else entry.turns
        return entry.azimuth + 360.0 * turns * times / (len(times) / fps)


def _drifted(drift: tuple[float, float], times: Float) -> list[float]:
    """Numbers from the first one at the first instant to the second one at the last instant, which is reached exactly."""
    first, last = drift
    if first == last or times[0] == times[-1]:
        return [first] * len(times)
    begin, whole = float(times[0]), float(times[-1] - times[0])
    return [first + (last - first) * ((t - begin) / whole) for t in times.tolist()]


def _trajectory(entry: OrbitPath, folder: Path) -> _Orbit:
    """The motion that an entry of a recipe means."""
    return _Orbit(entry)


TRAJECTORY = TrajectorySpec(options=OrbitPath, trajectory=_trajectory)
