"""The viewpoints of a recipe: the paper's grid, random ones, a file's, and motions of the camera. Angles in degrees, distances
in metres.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import (
    Field,
    field_validator,
    model_validator,
)

from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Count, Number, Positive
from viewsphere.model.fields.omit_none import OmitNone
from viewsphere.model.model_spec import Axis
from viewsphere.plugins.trajectory import TrajectorySpec
from viewsphere.recipe.cameras.aim import (
    AZIMUTH,
    DISTANCE,
    ELEVATION,
    FILL,
    TILT,
    Aimed,
    DistanceAround,
    DistanceBetween,
    Distances,
    Fill,
    FillBetween,
    ends_of,
    in_elevation,
    in_reach,
)
from viewsphere.recipe.cameras.time import RATE, Frames, Rate
from viewsphere.recipe.cameras.trajectories import Moving
from viewsphere.recipe.kinds import ByKind
from viewsphere.recipe.values import Interval, Point, Range, Values
from viewsphere.validation.errors import error_at

AxisValues = float | tuple[float, ...] | Range
"""One value, a list of them, or evenly spaced ones."""


def axis_count(values: AxisValues, *, turn: bool = False) -> int:
    """The number of values on an axis; with `turn`, a range's last value is dropped if it is the first after 360 degrees."""
    if isinstance(values, Range):
        repeats = turn and values.count > 1 and abs(values.value(values.count - 1) - values.start - 360) < 1e-6
        return values.count - repeats
    return len(values) if isinstance(values, tuple) else 1


def axis_value(values: AxisValues, index: int) -> float:
    """One value of an axis."""
    if isinstance(values, Range):
        return values.value(index)
    return values[index] if isinstance(values, tuple) else values


class _Axes(Aimed):
    """Angles and distances to combine."""

    azimuth: Values = Field(default=Range(start=0, stop=360, step=45), description=f"degrees; {AZIMUTH}; a full turn drops 360")
    elevation: Values = Field(default=20.0, description=f"degrees {ELEVATION}")
    distance: Distances = Field(description=f"{DISTANCE}; {FILL}")
    tilt: Values = Field(default=0.0, description=f"degrees; {TILT}")

    @field_validator("azimuth", "elevation", "distance", "tilt")
    @classmethod
    def _distinct(cls, given: AxisValues | Fill) -> AxisValues | Fill:
        values = given.fill if isinstance(given, Fill) else given
        if isinstance(values, tuple) and len(set(values)) < len(values):
            twice = next(v for i, v in enumerate(values) if v in values[:i])
            raise ValueError(f"expected distinct values; found {twice:g} twice")
        return given

    @field_validator("azimuth", "tilt")
    @classmethod
    def _one_turn(cls, values: AxisValues) -> AxisValues:
        if isinstance(values, Range) and values.stop - values.start > 360 + 1e-6:
            raise ValueError(f"expected at most a full turn; found {values.start:g} to {values.stop:g}")
        return values

    @field_validator("elevation")
    @classmethod
    def _elevation(cls, values: AxisValues) -> AxisValues:
        in_elevation(*ends_of(values))
        return values

    @field_validator("distance")
    @classmethod
    def _distance(cls, values: AxisValues | Fill) -> AxisValues | Fill:
        if not isinstance(values, Fill):
            in_reach(*ends_of(values))
        return values

    @property
    def distances(self) -> AxisValues:
        """The distances, or the filled shares that replace them."""
        return self.distance.fill if isinstance(self.distance, Fill) else self.distance

    @property
    def axis_counts(self) -> dict[str, int]:
        """Number of values of each axis, outermost loop first."""
        return {
            "tilts": axis_count(self.tilt, turn=True),
            "distances": axis_count(self.distances),
            "elevations": axis_count(self.elevation),
            "azimuths": axis_count(self.azimuth, turn=True),
        }


class Grid(_Axes):
    """Every combination of the given angles and distances, as in the paper."""

    kind: Literal["grid"] = Field(default="grid", description="every combination of the given angles and distances")


class Spread(Frozen):
    """A width for each coordinate of a viewpoint; 0 leaves it as it is."""

    azimuth: Annotated[Number, Field(ge=0)] = Field(default=0.0, description="degrees")
    elevation: Annotated[Number, Field(ge=0)] = Field(default=0.0, description="degrees")
    distance: Annotated[Number, Field(ge=0)] = Field(default=0.0, description="metres")
    tilt: Annotated[Number, Field(ge=0)] = Field(default=0.0, description="degrees")


def _check_width(width: Spread, field: str, instead: str) -> None:
    """Raise ValueError for metres added to a distance that is not given in metres."""
    if width.distance:
        with error_at(field, "distance"):
            raise ValueError(
                f"expected 0 beside distance: {{fill: ...}}, which is no length; found {width.distance:g}: use {instead}"
            )


Shared = Annotated[
    bool,
    Field(
        strict=True,
        description="true: one draw for all models or random scenes; by default each has its own",
    ),
]
"""True to draw random viewpoints once for all subjects."""


class Jitter(_Axes):
    """A grid with every viewpoint moved at random, uniformly within plus or minus a width, not beyond the poles."""

    kind: Literal["jitter"] = Field(description="a grid with random offsets")
    plus_minus: Spread = Field(description="the widest offset of each coordinate")
    count: Count = Field(default=1, description="viewpoints for each grid viewpoint")
    shared: Shared = False

    @model_validator(mode="after")
    def _in_front(self) -> Jitter:
        if isinstance(self.distance, Fill):
            _check_width(self.plus_minus, "plus_minus", "a grid of shares, or kind: sphere with fill: [low, high]")
            return self
        low, high = ends_of(self.distance)
        in_reach(low - self.plus_minus.distance, high)
        return self


class Sphere(Aimed):
    """Random viewpoints, uniform by area on the sphere or on a part of it."""

    kind: Literal["sphere"] = Field(description="uniform on the sphere")
    count: Count = Field(description="number of viewpoints of each model or random scene")
    shared: Shared = False
    azimuth: Interval = Field(default=(0.0, 360.0), description=f"[low, high] in degrees; {AZIMUTH}")
    elevation: Interval = Field(default=(-90.0, 90.0), description=f"[low, high] in degrees {ELEVATION}")
    distance: DistanceBetween = Field(
        description=f"a number or [low, high] (uniform): {DISTANCE}; {FILL}; or fill: [low, high]"
    )
    tilt: Interval = Field(default=(0.0, 0.0), description=f"a number or [low, high] (uniform), degrees; {TILT}")

    @field_validator("elevation")
    @classmethod
    def _elevation(cls, value: tuple[float, float]) -> tuple[float, float]:
        in_elevation(*value)
        return value

    @field_validator("distance")
    @classmethod
    def _distance(cls, value: tuple[float, float] | FillBetween) -> tuple[float, float] | FillBetween:
        if not isinstance(value, FillBetween):
            in_reach(*value)
        return value


class Normal(Aimed):
    """Random viewpoints, normal around one; draws beyond the poles or at no distance are drawn again."""

    kind: Literal["normal"] = Field(description="normal around a viewpoint")
    count: Count = Field(description="number of viewpoints of each model or random scene")
    shared: Shared = False
    azimuth: Number = Field(default=0.0, description=f"mean, degrees; {AZIMUTH}")
    elevation: Annotated[Number, Field(ge=-90, le=90)] = Field(default=20.0, description=f"mean, degrees {ELEVATION}")
    distance: DistanceAround = Field(description=f"mean; {DISTANCE}; {FILL}; or fill: [low, high] (uniform)")
    tilt: Number = Field(default=0.0, description=f"mean, degrees; {TILT}")
    sd: Spread = Field(description="standard deviations")

    @model_validator(mode="after")
    def _in_metres(self) -> Normal:
        if isinstance(self.distance, FillBetween):
            _check_width(self.sd, "sd", "fill: [low, high]")
        return self


class PoseList(Aimed, OmitNone):
    """Viewpoints from a file: orbits around the target, or a camera's motion through the file's own world.

    A motion is turned so that the file's `up` is +Z and its `forward` is -Y, moved so that `origin` is at the models, and
    scaled; its cameras keep their viewing directions, regardless of the target.
    """

    OMIT_IF_NONE = ("fps",)

    kind: Literal["file"] = Field(description="from a file")
    path: Annotated[str, Field(min_length=1)] = Field(description="the file, or COLMAP's folder")
    format: Literal["auto", "csv", "view", "tum", "kitti", "nerfstudio", "colmap", "shots", "cameras"] = Field(
        default="auto", description="auto: from the file's ending and the numbers in its first line; cameras: a 3D file"
    )
    every: Count = Field(default=1, description="uses every n-th pose")
    camera: Annotated[str, Field(min_length=1)] | None = Field(
        default=None, description="3D files: name of the camera; by default the scene's, or the only one"
    )
    frames: Frames | None = Field(
        default=None,
        description="3D files: time steps: all, a list of frames, or {first, last, step}; by default the first frame",
    )
    clip: Annotated[str, Field(min_length=1)] | None = Field(
        default=None, description="3D files: the animation to play, if the file has several; by default the first"
    )
    fps: Rate | None = Field(default=None, description=f"3D files: {RATE}")
    at: Annotated[str, Field(min_length=1)] | None = Field(
        default=None,
        description="3D files: an object with the pose (at the first frame) that becomes the world's, like scene.blend.at",
    )
    size: tuple[Annotated[Count, Field(le=16384)], Annotated[Count, Field(le=16384)]] | None = Field(
        default=None, description="3D files: [width, height] of the camera's picture in pixels; by default the scene's"
    )
    confined: bool = Field(
        default=True, strict=True, description="3D files: requires paths inside the file to stay in its folder"
    )
    origin: Point = Field(default=(0.0, 0.0, 0.0), description="motions: where the models stand, in the file's world and unit")
    scale: Positive = Field(default=1.0, description="motions: metres in one unit of the file")
    up: Axis | None = Field(default=None, description="motions: the file's axis that points up; default: the format's")
    forward: Axis | None = Field(
        default=None,
        description="motions: the file's axis that becomes -Y, the models' front; default: -y, or -z if that is up or down",
    )

    @model_validator(mode="after")
    def _right_angles(self) -> PoseList:
        if self.up and self.forward and self.up[1] == self.forward[1]:
            raise ValueError(f"expected up and forward at right angles; found up {self.up} and forward {self.forward}")
        return self

    @property
    def of_cameras(self) -> dict[str, object]:
        """The given fields that are allowed only for cameras of 3D files."""
        names = ("camera", "frames", "clip", "fps", "at", "size")
        return {name: value for name in names if (value := getattr(self, name)) is not None}


_STILL = {"grid": Grid, "sphere": Sphere, "normal": Normal, "jitter": Jitter, "file": PoseList}

Viewpoints = Annotated[Grid | Sphere | Normal | Jitter | PoseList | Moving, ByKind(TrajectorySpec, "grid", _STILL)]
"""Still viewpoints of the camera, or its motion: a trajectory."""
