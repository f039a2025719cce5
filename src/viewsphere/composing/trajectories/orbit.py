"""A circle, or a part of one, around what the rig looks at."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from viewsphere.composing.trajectories._aim import around, focuses
from viewsphere.composing.trajectories._world import RigPose, World
from viewsphere.model.camera import Intrinsics
from viewsphere.recipe.trajectories import OrbitPath, ends

Float = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Orbit:
    """Angles and distance change evenly with time."""

    entry: OrbitPath
    digest: str = ""
    intrinsics: Intrinsics | None = None

    def poses(self, times: Float, world: World) -> tuple[RigPose, ...]:
        """As `Trajectory.poses`."""
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
    """From the first number at the first instant to the second one at the last, which is met exactly."""
    first, last = drift
    if first == last or len(times) == 1:
        return [first] * len(times)
    begin, whole = float(times[0]), float(times[-1] - times[0])
    return [first + (last - first) * ((t - begin) / whole) for t in times.tolist()]


def trajectory(entry: OrbitPath, folder: Path) -> Orbit:
    """The motion that an entry of a recipe means."""
    return Orbit(entry)
