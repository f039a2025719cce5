"""The entries of a file of poses."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

from viewsphere.model.listed import ListedShot
from viewsphere.model.model_spec import Axis
from viewsphere.model.sensors.camera import Intrinsics

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


class Arranged(NamedTuple):
    """A line of a file of shots, with a name.
    `line`: the line's number. `places`: the poses of its objects, in the form of a camera: `R` (3, 3) from the world to the
    object.
    """

    said: ListedShot
    line: int
    places: tuple[Extrinsics, ...]

    @property
    def name(self) -> str:
        """The shot's name."""
        assert self.said.name is not None
        return self.said.name


@dataclass(frozen=True)
class PoseFile:
    """The poses of a file in its order, all orbits or all motions.

    `up` is the world axis that points up, as the format (or its usual writers) define it.
    `intrinsics` is the common lens of all frames, None if the file names none or several; for several, `lenses` has one a
    frame.
    `times` are the seconds of each pose on the file's clock, None if the file has none.
    `shots` are the further fields of each pose in a file of shots.
    """

    entries: tuple[Orbit, ...] | tuple[Extrinsics, ...]
    up: Axis = "+z"
    intrinsics: Intrinsics | None = None
    times: tuple[float, ...] | None = field(default=None, repr=False)
    lenses: tuple[Intrinsics, ...] = field(default=(), repr=False)
    shots: tuple[Arranged, ...] = field(default=(), repr=False)

    def thinned(self, every: int) -> PoseFile:
        """The file with only every `every`-th pose."""
        times = self.times and self.times[::every]
        thinned = {"lenses": self.lenses[::every], "shots": self.shots[::every]}
        return replace(self, entries=self.entries[::every], times=times, **thinned)
