"""Objects of other tools' data sets with a known position, and the fields that follow from it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.camera import project
from viewsphere.geometry.pose_category import pose_category
from viewsphere.geometry.rotation import compose, quaternion_from_matrix, transform
from viewsphere.labels import view_of
from viewsphere.model.sensors.camera import Intrinsics

Float = NDArray[np.float64]


def placed(box: Float, world_from_object: Float, camera_from_world: Float, lens: Intrinsics | None) -> dict[str, Any]:
    """Fields of an object with this box (8, 3) in its own axes, metres, and this pose: boxes, poses, view and size.

    Matrices are rigid, (4, 4). Without a lens the box's pixels are unknown. If the box is NaN, the view is that of the origin
    of the object's axes. Raises ValueError for a matrix that is not rigid.
    """
    camera_from_object = compose(camera_from_world, world_from_object)
    in_camera = transform(camera_from_object, box)
    pixels, in_front = np.full((8, 2), np.nan), in_camera[:, 2] > 0
    if lens is not None:
        with np.errstate(over="ignore"):
            pixels, _ = project(lens, in_camera)
    view = view_of(camera_from_object, np.nan_to_num(Box3d(box).center))
    return {
        "box3d_object": box,
        "box3d": transform(world_from_object, box),
        "box3d_camera": in_camera,
        "box3d_pixels": np.where(np.isfinite(pixels), pixels, np.nan),
        "box3d_in_front": in_front,
        "world_from_object": world_from_object,
        "camera_from_object": camera_from_object,
        "quaternion": quaternion_from_matrix(camera_from_object[:3, :3]),
        "view": view,
        "pose_category": pose_category(view.azimuth_deg, view.elevation_deg),
        "size": Box3d(box).size,
    }
