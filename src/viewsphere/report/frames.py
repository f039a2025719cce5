"""A shown frame's numbers as plain data, which the page draws over its picture and lists beside it."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from viewsphere.geometry.box3d import Box3d
from viewsphere.geometry.frustum import frustum
from viewsphere.geometry.lenses import Lens
from viewsphere.labels import stand_in_for
from viewsphere.model.instant import Viewpoint
from viewsphere.model.sample import ObjectAnnotation, Sample
from viewsphere.model.sensors.camera import Camera
from viewsphere.report.pictures import scan_size
from viewsphere.report.sequences import moment_data
from viewsphere.report.unknown import number, numbers


def frame_data(sample: Sample) -> dict[str, Any]:
    """Frame index, split, picture's path and size, pose, camera and objects, and, in a sequence, its moment; unknown values are
    null. For a LiDAR, which has no picture, `scan` has its rings and columns, and the size is that of the stand-in.
    """
    pose, camera, stands_in = sample.known_pose, sample.known_camera, stand_in_for(sample.channels) is not None
    return {
        "index": sample.index,
        "split": sample.split,
        "file": sample.picture_file,
        "size": list(scan_size(sample) if stands_in else (sample.width, sample.height)),
        "scan": [sample.height, sample.width] if stands_in else None,
        "pose": None if pose is None else _pose_data(pose),
        "camera": None if camera is None else _camera_data(camera),
        "objects": [_object_data(o) for o in sample.objects],
        **moment_data(sample),
    }


def _pose_data(pose: Viewpoint) -> dict[str, Any]:
    return {
        "azimuth": number(pose.azimuth_deg),
        "elevation": number(pose.elevation_deg),
        "distance": number(pose.distance),
        "tilt": number(pose.tilt_deg),
        "name": pose.category,
    }


def _camera_data(camera: Camera) -> dict[str, Any]:
    return {
        "K": [numbers(row) for row in camera.K],
        "distortion": None if camera.lens.is_linear else camera.lens.name,
        "parallel": camera.lens.is_parallel,
        "lines": None if camera.lens.is_straight or camera.lens.is_scan else _lines(camera.lens),
        "center": numbers(camera.center),
    }


@lru_cache(maxsize=16)
def _lines(lens: Lens) -> list[list[float]]:
    """The lines x, y, z, x, ... of a bent lens's frustum in camera axes, at most 1 away, to a hundredth."""
    return [[round(float(v), 2) for v in line.ravel()] for line in frustum(lens, 1.0).lines]


def _object_data(o: ObjectAnnotation) -> dict[str, Any]:
    known = o.is_placed
    view = o.view
    return {
        "id": o.id,
        "category": o.category_id,
        "model": o.key,
        "rle": [o.rle.height, o.rle.width, o.rle.counts],
        "area": o.area,
        "box": None if o.box2d is None else numbers(o.box2d),
        "corners": _corners(o) if known else None,
        "faces": _faces_seen(o) if known else None,
        "visibility": number(o.visibility),
        "truncation": number(o.truncation),
        "pose": o.pose_category,
        "view": numbers((view.azimuth_deg, view.elevation_deg, view.distance, view.tilt_deg)) if known else None,
        "size": numbers(o.size) if known else None,
        "cameraFromObject": numbers(o.camera_from_object[:3].ravel()) if known else None,
    }


def _corners(o: ObjectAnnotation) -> list[list[float | None] | None]:
    """The box's vertices in the image to a tenth of a pixel; null behind the camera."""
    return [numbers(np.round(p, 1)) if np.isfinite(p).all() else None for p in o.box3d_pixels]


def _faces_seen(o: ObjectAnnotation) -> list[str]:
    """Names of the box's faces that are turned towards the camera."""
    middle = o.box3d_camera.mean(axis=0)
    centers = {name: corners.mean(axis=0) for name, corners in Box3d(o.box3d_camera).faces.items()}
    return [name for name, center in centers.items() if float((center - middle) @ center) < 0]
