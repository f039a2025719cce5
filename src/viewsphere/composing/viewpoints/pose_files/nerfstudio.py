"""`transforms.json` of nerfstudio and instant-ngp, and of the original NeRF's Blender scenes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np

from viewsphere.composing.viewpoints.pose_files.entries import Extrinsics, PoseFile
from viewsphere.composing.viewpoints.pose_files.lens import one_lens
from viewsphere.composing.viewpoints.pose_files.lines import number, read_text
from viewsphere.composing.viewpoints.pose_files.motions import motion
from viewsphere.errors import RecipeError
from viewsphere.geometry.lenses import LensParameters, focal_from_fov, opencv_parameters
from viewsphere.geometry.lenses.shared.programs.nerfstudio import OWN, own_lens
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.store.texts import parsed
from viewsphere.validation.errors import told_of

NUMBERS = ("w", "h", "fl_x", "fl_y", "cx", "cy", "k1", "k2", "k3", "k4", "p1", "p2", "camera_angle_x")
LENS_KEYS = (*NUMBERS, "camera_model", "is_fisheye", "distortion_params")
MODELS = ("OPENCV", "OPENCV_FISHEYE", "PINHOLE", "SIMPLE_PINHOLE", *OWN)


def read_nerfstudio(path: Path) -> PoseFile:
    """Frames' `transform_matrix`: camera to world in OpenGL's axes (x right, y up, looking along -z), world Z up.

    The lens (`fl_x`, `camera_model`, ... or `camera_angle_x`) may be given once or in each frame
    (https://docs.nerf.studio/quickstart/data_conventions.html); without `w` and `h` there is none.
    """
    try:
        data = parsed(read_text(path))
    except ValueError as error:
        raise RecipeError(f"{path}: expected JSON; found: {error}") from None
    frames = data.get("frames") if isinstance(data, dict) else None
    if not isinstance(frames, list):
        raise RecipeError(f"{path}: expected a mapping with a list of frames; found none")
    whole = cast(dict[str, Any], data)
    entries: list[Extrinsics] = []
    lenses: list[Intrinsics | None] = []
    for i, frame in enumerate(cast(list[Any], frames)):
        where = f"{path}: frames[{i}]"
        if not isinstance(frame, dict):
            raise RecipeError(f"{where}: expected a mapping; found {frame!r:.40}")
        values = cast(dict[str, Any], frame)
        entries.append(_motion(values.get("transform_matrix"), f"{where}.transform_matrix"))
        lenses.append(_lens({k: values.get(k, whole.get(k)) for k in LENS_KEYS}, where))
    return PoseFile(tuple(entries), intrinsics=one_lens(lenses, str(path)))


def _motion(value: Any, where: str) -> Extrinsics:
    rows = cast(list[Any], value) if isinstance(value, list) else []
    if len(rows) not in (3, 4) or any(not isinstance(r, list) or len(cast(list[Any], r)) != 4 for r in rows):
        raise RecipeError(f"{where}: expected a 4x4 matrix; found {value!r:.40}")
    matrix = np.array([[number(v, where) for v in row] for row in rows[:3]])
    return motion(matrix[:, :3] * [1.0, -1.0, -1.0], matrix[:, 3], where)


def _lens(given: Mapping[str, Any], where: str) -> Intrinsics | None:
    width, height = given["w"], given["h"]
    if width is None or height is None:
        return None
    values = {k: number(given[k], f"{where}: {k}") for k in NUMBERS if given[k] is not None}
    angle = values.get("camera_angle_x")
    fx = values.get("fl_x") or (focal_from_fov(angle, values["w"]) if angle and 0 < angle < math.pi else None)
    if fx is None or fx <= 0 or values["w"] < 1 or values["h"] < 1:
        raise RecipeError(f"{where}: expected w, h and fl_x (or camera_angle_x) above 0; found {fx}")
    size = {"width": int(values["w"]), "height": int(values["h"])}
    matrix = (fx, values.get("fl_y") or fx, values.get("cx", values["w"] / 2), values.get("cy", values["h"] / 2))
    model = "OPENCV_FISHEYE" if given["is_fisheye"] else given["camera_model"]
    with told_of(where):
        if model in OWN:
            return Intrinsics(**size, **own_lens(model, matrix, given["distortion_params"] or ())._asdict())
        bent = _distortion(model, values, where)
        return Intrinsics(**size, fx=matrix[0], fy=matrix[1], cx=matrix[2], cy=matrix[3], distortion=bent, rolling=None)


def _distortion(model: object, values: Mapping[str, float], where: str) -> LensParameters | None:
    if model is not None and model not in MODELS:
        raise RecipeError(f"{where}: camera_model: expected one of {', '.join(MODELS)}; found {model!r}")
    k1, k2, k3, k4, p1, p2 = (values.get(k, 0.0) for k in ("k1", "k2", "k3", "k4", "p1", "p2"))
    if model == "OPENCV_FISHEYE":
        return opencv_parameters((k1, k2, k3, k4), is_fisheye=True)
    if k4:
        raise RecipeError(f"{where}: k4: expected 0, OpenCV's lens has no such term; found {k4:g}: undistort the images first")
    if not any((k1, k2, k3, p1, p2)):
        return None
    return opencv_parameters((k1, k2, p1, p2, k3))
