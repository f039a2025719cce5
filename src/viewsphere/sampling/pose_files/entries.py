"""What a file of poses holds."""

from __future__ import annotations

from dataclasses import dataclass
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
    that all frames share, None if the file names none.
    """

    entries: tuple[Orbit, ...] | tuple[Extrinsics, ...]
    up: Axis = "+z"
    intrinsics: Intrinsics | None = None
