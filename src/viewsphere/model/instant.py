"""An instant: a moment at which all of a rig's sensors take their pictures, and what may change with it."""

from __future__ import annotations

from pydantic import Field

from viewsphere.model.frozen import Frozen
from viewsphere.model.scene import Finish, Matrix4, Vector


class Moment(Frozen):
    """A time step: a frame of an animated file, and the seconds since that file's first frame."""

    frame: int
    seconds: float


class Viewpoint(Frozen):
    """Where a camera stands on a sphere around `target` (world metres; None: the box centre of object 1), and when."""

    index: int
    azimuth_deg: float
    elevation_deg: float
    distance: float = Field(gt=0)
    tilt_deg: float = 0.0
    target: Vector | None = None
    category: str = ""  # named bin: front, front-left, ..., top
    time: Moment | None = None  # where something is animated


class Instant(Frozen):
    """One instant of a shot: where the rig is, what it looks at, and what the pictures are made of then.

    `index` counts the instants of a sequence from 0, of still pictures those of the data set. `world_from_rig` is the pose of
    the rig's first sensor (OpenCV axes, metres); `focus` (world metres) is what it looks at. `viewpoint` says how the pose was
    asked for, where it comes from a grid or list. `finish` replaces the scene's. An instant that is not `recorded` is there
    only because labels of others need it: no picture is taken then.
    """

    index: int
    world_from_rig: Matrix4
    focus: Vector
    seconds: float = 0.0
    viewpoint: Viewpoint | None = None
    split: str = ""
    finish: Finish | None = None
    recorded: bool = True
