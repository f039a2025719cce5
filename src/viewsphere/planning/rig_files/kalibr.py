"""Kalibr's camchain: cam0, cam1, ..., each with `T_cn_cnm1`, which transforms points from the previous camera to this one
(https://github.com/ethz-asl/kalibr/wiki/yaml-formats).
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np

from viewsphere.errors import RecipeError
from viewsphere.geometry.lenses import LensParameters
from viewsphere.geometry.rotation import compose
from viewsphere.planning.rig_files.documents import matrix, row, size
from viewsphere.planning.rig_files.entries import Calibrated, brown_conrady, fisheye, inverse, pinhole, rotation


def sensors(documents: Mapping[Path, dict[str, Any]], rectified: bool) -> tuple[Calibrated, ...]:
    """Return the cameras of the chain, named cam0, cam1, ...
    Raises RecipeError for lenses other than a pinhole with radtan, equidistant or no distortion.
    """
    where = ", ".join(map(str, documents))
    if rectified:
        raise RecipeError(f"{where}: expected rectified: true beside P, which Kalibr's files have not; found it")
    if len(documents) > 1:
        raise RecipeError(f"{where}: expected one camchain; found {len(documents)} files")
    (document,) = documents.values()
    calibrated: list[Calibrated] = []
    pose = np.eye(4)
    while (name := f"cam{len(calibrated)}") in document:
        entry, at = document[name], f"{where}: {name}"
        if not isinstance(entry, dict):
            raise RecipeError(f"{at}: expected a mapping; found {entry!r:.40}")
        camera = cast("dict[str, Any]", entry)
        if calibrated:
            step = matrix(camera.get("T_cn_cnm1"), f"{at}: T_cn_cnm1", (4, 4))
            pose = compose(pose, inverse(rotation(step[:3, :3], f"{at}: T_cn_cnm1"), step[:3, 3]))
        calibrated.append(_camera(name, camera, pose, at))
    return tuple(calibrated)


def _camera(name: str, entry: Mapping[str, Any], pose: np.ndarray[Any, np.dtype[np.float64]], at: str) -> Calibrated:
    if entry.get("camera_model", "pinhole") != "pinhole":
        raise RecipeError(f"{at}: camera_model: expected pinhole; found {entry['camera_model']!r}: calibrate it as one")
    numbers = row(entry.get("intrinsics"), f"{at}: intrinsics")
    if len(numbers) != 4:
        raise RecipeError(f"{at}: intrinsics: expected fx, fy, cx, cy; found {len(numbers)} numbers")
    extent = row(entry["resolution"], f"{at}: resolution") if "resolution" in entry else [None, None]
    if len(extent) != 2:
        raise RecipeError(f"{at}: resolution: expected [width, height]; found {len(extent)} numbers")
    fx, fy, cx, cy = numbers
    lens = pinhole(np.array([[fx, 0.0, cx], [0.0, fy, cy]]), f"{at}: intrinsics")
    return Calibrated(name, lens, _distortion(entry, at), pose, size(extent[0], extent[1], f"{at}: resolution"))


def _distortion(entry: Mapping[str, Any], at: str) -> LensParameters | None:
    model = entry.get("distortion_model", "none")
    if model == "none":
        return None
    numbers = row(entry.get("distortion_coeffs"), f"{at}: distortion_coeffs")
    match model:
        case "radtan":
            return brown_conrady(numbers, f"{at}: distortion_coeffs")
        case "equidistant":
            return fisheye(numbers, f"{at}: distortion_coeffs")
        case _:
            raise RecipeError(
                f"{at}: distortion_model: expected radtan, equidistant or none; found {model!r}: calibrate it as one"
            )
