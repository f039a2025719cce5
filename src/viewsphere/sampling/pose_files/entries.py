"""What a file of poses holds."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

from viewsphere.model.camera import Intrinsics
from viewsphere.model.model_spec import Axis

Row = tuple[float, float, float]


class Orbit(NamedTuple):
    """A camera on a sphere around the target: degrees and metres."""

    azimuth: float
    elevation: float
    distance: float
    tilt: float = 0.0


class Extrinsics(NamedTuple):
    """A camera in the file's own world: `R` (3, 3) world to camera in OpenCV axes, `center` (3,) in the file's unit."""

    R: tuple[Row, Row, Row]
    center: Row


@dataclass(frozen=True)
class PoseFile:
    """All of a file's poses in its order, all orbits or all motions.

    `up` is the axis of the world that points up, as the format (or its usual writers) have it; `intrinsics` is the lens
    that all frames share, None if the file names none, or several: then `lenses` has one for each. `times` are the seconds of
    each pose, as the file counts them, None if it does not.
    """

    entries: tuple[Orbit, ...] | tuple[Extrinsics, ...]
    up: Axis = "+z"
    intrinsics: Intrinsics | None = None
    times: tuple[float, ...] | None = field(default=None, repr=False)
    lenses: tuple[Intrinsics, ...] = field(default=(), repr=False)

    def thinned(self, every: int) -> PoseFile:
        """Every so many-th pose."""
        times = self.times and self.times[::every]
        return replace(self, entries=self.entries[::every], times=times, lenses=self.lenses[::every])
