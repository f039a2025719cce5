"""An object's pose in a picture, from its shot and its model: the input of labels that need no pixels."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.camera import project
from viewsphere.geometry.rotation import compose, rigid, transform
from viewsphere.model.annotations.appearance import Appearance
from viewsphere.model.annotations.keypoints import Keypoints
from viewsphere.model.annotations.symmetries import Symmetries
from viewsphere.model.model_spec import ModelSpec, Size
from viewsphere.model.sample import ObjectView
from viewsphere.model.scene import Matrix4
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.thing import TimeStep

Float = NDArray[np.float64]


class ModelFacts(Protocol):
    """Facts about a normalised model, at the time step that an object shows."""

    @property
    def obj(self) -> str:
        """Its OBJ file, relative to the data set's root."""
        ...

    @property
    def box3d_object(self) -> NDArray[np.float64]:
        """Its box (8, 3) in its own axes, metres."""
        ...

    @property
    def real_size(self) -> Size | None:
        """Its true size in metres; None if unknown."""
        ...

    @property
    def category(self) -> str:
        """The name of its category."""
        ...

    @property
    def category_id(self) -> int:
        """The number of its category."""
        ...

    @property
    def materials(self) -> tuple[str, ...]:
        """The names of its materials."""
        ...

    @property
    def body_parts(self) -> tuple[str, ...]:
        """The names of the parts of its body."""
        ...

    @property
    def track(self) -> str:
        """The key of the animated model, for a time step; else empty."""
        ...

    @property
    def diameter(self) -> float | None:
        """The largest distance between two vertices, metres; None in data sets of older versions."""
        ...

    @property
    def symmetries(self) -> Symmetries | None:
        """Its symmetries."""
        ...

    @property
    def keypoints(self) -> Keypoints | None:
        """Named points."""
        ...

    @property
    def looks(self) -> Appearance | None:
        """Its colours and materials; None if no requested label needs them."""
        ...


@dataclass(frozen=True, eq=False)
class Placement:
    """One object in one picture: its model and pose (world from object), the camera, and the angular resolution of pose
    categories. `known` returns the facts about its model at the shown time step; it is called at the first access to `facts`.
    `position` is the object's among the things of its shot.
    """

    spec: ModelSpec
    pose: Matrix4
    camera: Camera
    category_deg: float
    known: Callable[[], ModelFacts]
    step: TimeStep | None = None
    position: int = -1

    @cached_property
    def facts(self) -> ModelFacts:
        """The facts about the model."""
        return self.known()

    @property
    def box(self) -> Float:
        """The model's 3D box (8, 3) in its own axes, metres."""
        return self.facts.box3d_object

    @cached_property
    def world_from_object(self) -> Float:
        """Object axes to world axes, (4, 4), rigid, metres."""
        return np.array(self.pose, np.float64)

    @cached_property
    def camera_from_world(self) -> Float:
        """World axes to camera axes (OpenCV), (4, 4), rigid, metres."""
        return rigid(self.camera.R, self.camera.t)

    @cached_property
    def camera_from_object(self) -> Float:
        """Object axes to camera axes (OpenCV), (4, 4), rigid, metres."""
        return compose(self.camera_from_world, self.world_from_object)

    def pixels(self, points: Float) -> Float:
        """The pixels (n, 2) of points (n, 3) in the object's axes; NaN where the camera shows none. Under a rolling shutter,
        they are those nearest in time to the instant.
        """
        if self.camera.rows is not None:
            from viewsphere.truth.raster.rolling import pixels_in_rows

            return pixels_in_rows(self.camera, self.camera.rows, self.position, self.world_from_object, points)[0]
        in_camera = transform(self.camera_from_world, transform(self.world_from_object, points))
        return project(self.camera.intrinsics, in_camera)[0]

    @cached_property
    def view(self) -> ObjectView:
        """The camera as the object sees it, around the centre of its box."""
        return view_of(self.camera_from_object, Box3d(self.box).center, self.camera.lens.is_parallel)


def view_of(camera_from_object: Float, center: Float, is_parallel: bool = False) -> ObjectView:
    """Orbit angles, distance and tilt of the camera around the point `center` (3,) of the object's own axes. If its rays are
    parallel, they are those of a camera that looks at the point: from the place where the point's ray begins.

    Azimuth is in [0, 360). Tilt is in [-180, 180]: the camera's roll after the shortest rotation that makes it look at the
    point. So for a camera that looks at the point, the angles equal its viewpoint's.
    Straight above or below, where azimuth and tilt are the same rotation, tilt is 0.
    """
    rows: list[list[float]] = camera_from_object[:3].tolist()
    columns = [[row[k] for row in rows] for k in range(3)]
    middle = center.tolist()
    seen = [_dot(row, middle) + row[3] for row in rows]
    if is_parallel:
        seen = [0.0, 0.0, seen[2]]
    distance = math.hypot(*seen)
    if distance == 0:
        return ObjectView(0.0, 0.0, 0.0, 0.0)
    direction = [value / distance for value in seen]
    x, y, z = (-_dot(column, direction) for column in columns)
    level = math.hypot(x, y)
    elevation = math.atan2(z, level)
    first = _shortest_turn(*direction)
    facing = [_dot(first, column) for column in columns]
    if level > 1e-9:
        azimuth = math.atan2(x, -y)
        right = math.cos(azimuth), math.sin(azimuth), 0.0
        down = z * math.sin(azimuth), -z * math.cos(azimuth), -level
        tilt = math.atan2(_dot(facing, down), _dot(facing, right))
    else:
        azimuth, tilt = math.atan2(facing[1], facing[0]), 0.0
    return ObjectView(_degrees(azimuth) % 360.0, _degrees(elevation), distance, _degrees(tilt))


def _degrees(angle: float) -> float:
    """Radians converted to degrees, rounded to 1e-9, so that a full turn minus a rounding error becomes 0 and not 360."""
    return round(math.degrees(angle), 9) + 0.0


def _shortest_turn(x: float, y: float, z: float) -> tuple[float, float, float]:
    """The first row of the shortest rotation from the unit vector (x, y, z) to +z."""
    if z < -1 + 1e-12:
        return 1.0, 0.0, 0.0
    k = 1 / (1 + z)
    return 1 - k * x * x, -k * x * y, -x


def _dot(a: Sequence[float], b: Sequence[float]) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
