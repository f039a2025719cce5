"""Records of nuScenes' tables."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from viewsphere.formats.nuscenes.names import category_of, token
from viewsphere.formats.nuscenes.story import neighbours
from viewsphere.formats.shared.mounting import CAMERA_FROM_LIDAR, Float, centred, mounted, unmoved
from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.rotation import compose, product, quaternion_from_matrix
from viewsphere.model.sample import ObjectAnnotation
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.model.sensors.rig import Rig
from viewsphere.store import Category

Record = dict[str, Any]

LEVELS = ("v0-40", "v40-60", "v60-80", "v80-100")
BOUNDS = (0.4, 0.6, 0.8)
"""Visible shares of an object at which the next level of visibility begins."""

OBJECT_FROM_BOX = np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
"""The rotation from a box's axes (x ahead, y left, z up) to viewsphere's object axes, with the front at -y."""


def visibilities() -> list[Record]:
    """The levels of visibility."""
    shares = (level[1:].replace("-", " to ") for level in LEVELS)
    told = (f"visibility of whole object is {share} %" for share in shares)
    levels = enumerate(zip(LEVELS, told, strict=True), 1)
    return [{"token": f"{number}", "level": level, "description": words} for number, (level, words) in levels]


def category(one: Category) -> Record:
    """A category; its description is its name in the data set."""
    return {"token": token("category", one.id), "name": category_of(one.name), "description": one.name, "index": one.id}


def chain(instants: Sequence[int], instant: int, name: Callable[[int], str]) -> Record:
    """Tokens of the previous and the next record, empty at the ends."""
    before, behind = neighbours(instants, instant)
    return {"prev": "" if before is None else name(before), "next": "" if behind is None else name(behind)}


def _placed(matrix: Float) -> Record:
    """A rigid matrix (4, 4) as a position and a quaternion."""
    return {"translation": matrix[:3, 3].tolist(), "rotation": list(quaternion_from_matrix(matrix[:3, :3]))}


def ego_from_sensor(rig: Rig, sensor: int) -> Record:
    """Return the pose of a sensor, by its place in the rig, in the ego's axes; a LiDAR's pose is turned to its own axes."""
    axes = np.eye(4) if rig.sensors[sensor].lidar is None else CAMERA_FROM_LIDAR
    return _placed(compose(compose(unmoved(CAMERA_FROM_LIDAR), mounted(rig, sensor)), axes))


def world_from_ego(world_from_rig: Float) -> Record:
    """Return the pose of the ego in the world."""
    return _placed(compose(world_from_rig, CAMERA_FROM_LIDAR))


def matrix_of(lens: Intrinsics) -> list[list[float]]:
    """K, row by row, with the origin in the first pixel's centre."""
    return centred(lens.K).tolist()


def box(o: ObjectAnnotation) -> Record:
    """The middle, the size and the rotation of an object's box in the world."""
    width, height, length = o.size
    turn = product(o.world_from_object[:3, :3], OBJECT_FROM_BOX)
    middle = Box3d(o.box3d).center
    return {
        "translation": middle.tolist(),
        "size": [width, length, height],
        "rotation": list(quaternion_from_matrix(turn)),
    }


def grade(visibility: float) -> str:
    """The token of the level of visibility."""
    return str(1 + sum(visibility >= bound for bound in BOUNDS))
