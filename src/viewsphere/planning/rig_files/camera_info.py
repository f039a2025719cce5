"""ROS' camera_info, a file for each camera, as `camera_calibration` writes it
(https://docs.ros.org/en/api/sensor_msgs/html/msg/CameraInfo.html).

R rotates the raw camera's axes to the rectified ones; P[0, 3] is -fx' times the metres from the first camera.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from viewsphere.errors import RecipeError
from viewsphere.geometry.lenses import LensParameters
from viewsphere.geometry.rotation import rigid
from viewsphere.planning.rig_files.documents import matrix, one_of, size
from viewsphere.planning.rig_files.entries import Calibrated, brown_conrady, fisheye, pinhole, relative, rotation
from viewsphere.validation.errors import shown

MODELS = ("plumb_bob", "rational_polynomial", "equidistant", "fisheye", "")


def is_own(document: Mapping[str, Any]) -> bool:
    """Return whether a document is a camera_info."""
    return {"camera_matrix", "projection_matrix"} <= document.keys()


def sensors(documents: Mapping[Path, dict[str, Any]], rectified: bool) -> tuple[Calibrated, ...]:
    """A sensor for each file, named by its `camera_name` or the file's name; the first sensor is the rig's origin."""
    return relative([_camera(path, document, rectified) for path, document in documents.items()])


def _camera(path: Path, found: Mapping[str, Any], rectified: bool) -> Calibrated:
    """A camera's lens, and its pose in the common rectified axes."""
    k, p = (matrix(found.get(f"{n}_matrix"), f"{path}: {n}_matrix") for n in ("camera", "projection"))
    if k.shape != (3, 3) or p.shape != (3, 4):
        raise RecipeError(
            f"{path}: expected a 3 x 3 camera_matrix and a 3 x 4 projection_matrix; found {k.shape} and {p.shape}"
        )
    if min(p[0, 0], p[1, 1]) <= 0:
        raise RecipeError(f"{path}: projection_matrix: expected focal lengths above 0; found {p[0, 0]:g} and {p[1, 1]:g}")
    turn = (
        matrix(found["rectification_matrix"], f"{path}: rectification_matrix") if "rectification_matrix" in found else np.eye(3)
    )
    shift = np.array([-p[0, 3] / p[0, 0], -p[1, 3] / p[1, 1], 0.0]) + 0.0
    lens = pinhole(p if rectified else k, f"{path}: {'projection' if rectified else 'camera'}_matrix")
    axes = np.eye(3) if rectified else rotation(turn, f"{path}: rectification_matrix")
    return Calibrated(
        name=_name(found.get("camera_name"), path),
        lens=lens,
        distortion=None if rectified else _distortion(found, path),
        rig_from_sensor=rigid(axes, shift),
        size=size(found.get("image_width"), found.get("image_height"), f"{path}: image_width, image_height"),
    )


def _name(given: Any, path: Path) -> str:
    """The name in a file, which YAML may have read as a number, or the file's own."""
    return given if isinstance(given, str) and given else Calibrated.name_by(path) if given in (None, "") else shown(given)


def _distortion(found: Mapping[str, Any], path: Path) -> LensParameters | None:
    model = one_of(found.get("distortion_model", ""), MODELS, f"{path}: distortion_model")
    where = f"{path}: distortion_coefficients"
    numbers = matrix(found["distortion_coefficients"], where).ravel().tolist() if "distortion_coefficients" in found else []
    return (fisheye if model in ("equidistant", "fisheye") else brown_conrady)(numbers, where)
