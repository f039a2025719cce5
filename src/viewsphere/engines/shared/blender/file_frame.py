"""From the shot's world to the world of a .blend scene, which has its own origin, rotation and unit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from viewsphere.geometry.rotation import compose, transform
from viewsphere.model.scene import BlendScene

Float = NDArray[np.float64]
Request = dict[str, Any]


@dataclass(frozen=True, eq=False)
class FileFrame:
    """`file_from_world` (4, 4) is rigid, in metres; `unit` is the number of metres in one unit of the file."""

    file_from_world: Float
    unit: float

    @classmethod
    def from_blend(cls, blend: BlendScene | None) -> FileFrame:
        """The frame of the .blend file; the identity without a file."""
        if blend is None:
            return cls(np.eye(4), 1.0)
        world_from_file = np.array(blend.world_from_file)
        turn = world_from_file[:3, :3].T
        inverse = np.eye(4)
        inverse[:3, :3], inverse[:3, 3] = turn, -transform(turn, world_from_file[:3, 3])
        return cls(inverse, blend.unit)

    @property
    def is_same(self) -> bool:
        """Return whether the file's world is the shot's world, in metres."""
        return self.unit == 1.0 and bool((self.file_from_world == np.eye(4)).all())

    def placed(self, world_from_object: ArrayLike) -> list[list[float]]:
        """Object-to-file matrix (4, 4), as nested lists, of an object whose mesh is in metres."""
        matrix = compose(self.file_from_world, world_from_object)
        matrix[:3] /= self.unit
        return matrix.tolist()

    def point(self, point: ArrayLike) -> list[float]:
        """A point (3,) of the world in the file's axes and units."""
        return (transform(self.file_from_world, point) / self.unit).tolist()

    def direction(self, direction: ArrayLike) -> list[float]:
        """A direction (3,) of the world in the file's axes."""
        return transform(self.file_from_world[:3, :3], direction).tolist()

    def light(self, request: Request) -> Request:
        """A light in the file's axes and units; its power is scaled, as light falls off with the squared distance in units."""
        if self.is_same:
            return request
        if request["kind"] == "sun":
            return {**request, "direction": self.direction(request["direction"])}
        changed = {name: self.point(request[name]) for name in ("position", "toward") if name in request}
        changed["irradiance"] = [value / self.unit**2 for value in request["irradiance"]]
        if "radius" in request:
            changed["radius"] = request["radius"] / self.unit
        if "size" in request:
            changed["size"] = [value / self.unit for value in request["size"]]
        return {**request, **changed}

    def camera(self, request: Request) -> Request:
        """A camera in the file's axes and units; the rows of `R` are the camera's axes."""
        if self.is_same:
            return request
        axes = [self.direction(axis) for axis in request["R"]]
        distances = {name: request[name] / self.unit for name in ("near", "far")}
        lengths = {name: length / self.unit for name, length in request.get("lengths", {}).items()}
        return {**request, "R": axes, "center": self.point(request["center"]), "lengths": lengths, **distances}
