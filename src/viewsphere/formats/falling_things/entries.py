"""Records of objects, models and lenses as in Falling Things; lengths in centimetres, objects' axes like a camera's."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.rotation import compose, quaternion_from_matrix, rigid, transform
from viewsphere.model.sample import ObjectAnnotation
from viewsphere.model.sensors.camera import Camera, Intrinsics
from viewsphere.store import ModelInfo

CM = 100.0
CUBOID = ((-1, -1, 1), (1, -1, 1), (1, -1, -1), (-1, -1, -1), (-1, 1, 1), (1, 1, 1), (1, 1, -1), (-1, 1, -1))
"""The sides of a box's corners in FAT's order."""

OBJECT_FROM_FAT = np.array([[-1.0, 0, 0], [0, 0, -1], [0, -1, 0]])
"""FAT's x is the object's right, viewsphere's -x; its y is down, viewsphere's -z; its z is ahead, viewsphere's -y."""

PERMUTED = np.array([[0.0, 0, 1, 0], [1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]])


def camera_data(camera: Camera) -> dict[str, Any]:
    """Return the pose of the camera in the world, and its lens."""
    k = camera.intrinsics
    return {
        "location_worldframe": (camera.center * CM).tolist(),
        "quaternion_xyzw_worldframe": _xyzw(camera.R.T),
        "intrinsics": {"fx": k.fx, "fy": k.fy, "cx": k.cx, "cy": k.cy},
    }


def class_of(o: ObjectAnnotation) -> str:
    """The name of an object's class: its model's key."""
    return o.track or o.key


def _xyzw(rotation: NDArray[np.float64]) -> list[float]:
    w, x, y, z = quaternion_from_matrix(rotation)
    return [x, y, z, w]


def box_of(o: ObjectAnnotation) -> tuple[float, float, float, float] | None:
    """The box of the projected model, which may extend beyond the picture; None if no part of it is projected."""
    return o.box2d_unclipped or o.box2d_projected


def annotation(o: ObjectAnnotation, k: NDArray[np.float64], matrix: str) -> dict[str, Any]:
    """The record of an object with a box. `k` is (3, 3); `matrix` is the permuted pose's key."""
    center = o.box3d_object.mean(axis=0)
    pose = compose(o.camera_from_object, rigid(OBJECT_FROM_FAT, center))
    pose[:3, 3] *= CM
    middle, corners, box = pose[:3, 3], Box3d(o.box3d_camera).corners_at(CUBOID) * CM, box_of(o)
    assert box is not None
    inside = 1 - o.truncation
    return {
        "class": class_of(o),
        "instance_id": o.id,
        "visibility": min(o.visibility / inside, 1.0) if inside > 0 else 0.0,
        "location": middle.tolist(),
        "quaternion_xyzw": _xyzw(pose[:3, :3]),
        matrix: compose(pose, PERMUTED.T).T.tolist(),
        "cuboid_centroid": middle.tolist(),
        "projected_cuboid_centroid": _projected(k, middle[None])[0],
        "bounding_box": {"top_left": [box[1], box[0]], "bottom_right": [box[3], box[2]]},
        "cuboid": corners.tolist(),
        "projected_cuboid": _projected(k, corners),
    }


def _projected(k: NDArray[np.float64], points: NDArray[np.float64]) -> list[list[float]]:
    """Pixels of points (N, 3) in camera axes."""
    return [[x / z, y / z] if z > 0 else [-1.0, -1.0] for x, y, z in transform(k, points).tolist()]


def lens_settings(name: str, lens: Intrinsics) -> dict[str, Any]:
    """A camera of _camera_settings.json."""
    return {
        "name": name,
        "horizontal_fov": math.degrees(2 * math.atan(lens.width / (2 * lens.fx))),
        "intrinsic_settings": {
            "resX": lens.width, "resY": lens.height, "fx": lens.fx, "fy": lens.fy, "cx": lens.cx, "cy": lens.cy, "s": lens.skew,
        },
        "captured_image_size": {"width": lens.width, "height": lens.height},
    }  # fmt: skip


def model_settings(info: ModelInfo, name: str, number: int) -> dict[str, Any]:
    """A class of _object_settings.json, and its number."""
    width, height, length = Box3d(info.box3d_object).size
    turn = OBJECT_FROM_FAT.T * CM
    fixed = rigid(turn, -transform(turn, info.box3d_object.mean(axis=0)))
    return {
        "class": name,
        "segmentation_class_id": number,
        "fixed_model_transform": fixed.T.tolist(),
        "cuboid_dimensions": [width * CM, height * CM, length * CM],
    }
