"""Kalibr's camchain: cam0, cam1, ..., each with `T_cn_cnm1`, which transforms points from the previous camera to this one
(https://github.com/ethz-asl/kalibr/wiki/yaml-formats).
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np

from viewsphere.errors import RecipeError
from viewsphere.geometry.lenses import LensParameters, lens_parameters
from viewsphere.geometry.rotation import compose
from viewsphere.planning.rig_files.documents import matrix, one_of, row, size
from viewsphere.planning.rig_files.entries import Calibrated, brown_conrady, camera_matrix, fisheye, inverse, rotation
from viewsphere.validation.errors import shown, told_of

MODELS = {"pinhole": (), "omni": ("xi",), "ds": ("xi", "alpha"), "eucm": ("alpha", "beta")}
"""Camera models, and their intrinsics before fx, fy, cx and cy."""


def is_own(document: Mapping[str, Any]) -> bool:
    """Return whether a document is a camchain."""
    return "cam0" in document


def sensors(documents: Mapping[Path, dict[str, Any]], rectified: bool) -> tuple[Calibrated, ...]:
    """Return the cameras of the chain, named cam0, cam1, ...
    Raises RecipeError for other lenses than Kalibr's.
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
            raise RecipeError(f"{at}: expected a mapping; found {shown(entry)}")
        camera = cast("dict[str, Any]", entry)
        if calibrated:
            step = matrix(camera.get("T_cn_cnm1"), f"{at}: T_cn_cnm1", (4, 4))
            pose = compose(pose, inverse(rotation(step[:3, :3], f"{at}: T_cn_cnm1"), step[:3, 3]))
        calibrated.append(_camera(name, camera, pose, at))
    return tuple(calibrated)


def _camera(name: str, entry: Mapping[str, Any], pose: np.ndarray[Any, np.dtype[np.float64]], at: str) -> Calibrated:
    model = one_of(entry.get("camera_model", "pinhole"), MODELS, f"{at}: camera_model")
    names, numbers = (*MODELS[model], "fx", "fy", "cx", "cy"), row(entry.get("intrinsics"), f"{at}: intrinsics")
    if len(numbers) != len(names):
        raise RecipeError(f"{at}: intrinsics: expected {', '.join(names)}; found {len(numbers)} numbers")
    extent = row(entry["resolution"], f"{at}: resolution") if "resolution" in entry else [None, None]
    if len(extent) != 2:
        raise RecipeError(f"{at}: resolution: expected [width, height]; found {len(extent)} numbers")
    lens = camera_matrix(*numbers[-4:], where=f"{at}: intrinsics")
    distortion = _lens(model, dict(zip(MODELS[model], numbers, strict=False)), entry, at)
    return Calibrated(name, lens, distortion, pose, size(extent[0], extent[1], f"{at}: resolution"))


def _lens(model: str, own: dict[str, float], entry: Mapping[str, Any], at: str) -> LensParameters | None:
    """The lens of a camera model with its `own` parameters and its distortion."""
    bent = entry.get("distortion_model", "none")
    if model == "pinhole":
        return _distortion(entry, at)
    if bent != "none" and (model, bent) != ("omni", "radtan"):
        expected = "none or radtan" if model == "omni" else "none"
        raise RecipeError(f"{at}: distortion_model: expected {expected} beside {model}; found {shown(bent)}")
    with told_of(f"{at}: intrinsics"):
        if model != "omni":
            return lens_parameters({"ds": "double_sphere"}.get(model, model), **own)
        numbers = row(entry.get("distortion_coeffs"), f"{at}: distortion_coeffs") if bent == "radtan" else [0.0] * 4
        return lens_parameters("unified", **own, coefficients=tuple(numbers))


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
        case "fov":
            if len(numbers) != 1:
                raise RecipeError(f"{at}: distortion_coeffs: expected one number; found {len(numbers)}")
            with told_of(f"{at}: distortion_coeffs"):
                return lens_parameters("fov", omega=numbers[0])
        case _:
            raise RecipeError(
                f"{at}: distortion_model: expected radtan, equidistant, fov or none; found {shown(model)}: calibrate it as one"
            )
