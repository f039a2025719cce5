"""Project Aria's device calibrations: JSON with CameraCalibrations, as recordings and projectaria-tools have it.

Source: https://facebookresearch.github.io/projectaria_tools, DeviceCalibrationJson.cpp. Pixels are counted from the centre of
the first one.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

from viewsphere.composing.viewpoints.pose_files.motions import from_quaternion
from viewsphere.errors import RecipeError
from viewsphere.geometry.lenses import lens_parameters
from viewsphere.geometry.rotation import rigid
from viewsphere.planning.rig_files.documents import listed, mapping, one_of, row, size
from viewsphere.planning.rig_files.entries import Calibrated, camera_matrix, relative
from viewsphere.validation.errors import shown, told_of

MODELS = {"FisheyeRadTanThinPrism": ("fisheye624", 15), "KannalaBrandtK3": ("fisheye", 8)}
"""Lens and number of parameters of each model: with one focal length (f, cx, cy), and with two (fx, fy, cx, cy)."""


def is_own(document: Mapping[str, Any]) -> bool:
    """Return whether a document is one of Project Aria's."""
    return "CameraCalibrations" in document


def sensors(documents: Mapping[Path, dict[str, Any]], rectified: bool) -> tuple[Calibrated, ...]:
    """The cameras by their labels, in the first one's axes. Raises RecipeError for unknown lenses."""
    where = ", ".join(map(str, documents))
    if rectified or len(documents) > 1:
        raise RecipeError(f"{where}: expected one file of Project Aria's, without rectified: true; found another setting")
    (document,) = documents.values()
    entries = enumerate(listed(document.get("CameraCalibrations"), f"{where}: CameraCalibrations", "cameras"))
    return relative([_camera(mapping(e, f"{where}: CameraCalibrations[{i}]"), f"{where}: camera {i}") for i, e in entries])


def _camera(entry: Mapping[str, Any], where: str) -> Calibrated:
    name = entry.get("Label")
    if not isinstance(name, str) or not name:
        raise RecipeError(f"{where}: Label: expected a name; found {shown(name)}")
    projection = mapping(entry.get("Projection"), f"{where}: Projection")
    model, count = MODELS[one_of(projection.get("Name"), MODELS, f"{where}: Projection.Name")]
    values = row(projection.get("Params"), f"{where}: Projection.Params")
    if len(values) != count:
        raise RecipeError(f"{where}: Projection.Params: expected {count} numbers; found {len(values)}")
    matrix, rest = (values[:1] + values[:3], values[3:]) if model == "fisheye624" else (values[:4], values[4:])
    with told_of(f"{where}: Projection.Params"):
        distortion = lens_parameters(model, coefficients=tuple(rest))
    config = mapping(entry.get("ConfigData", {}), f"{where}: ConfigData")
    return Calibrated(
        name,
        camera_matrix(*matrix, where=f"{where}: Projection.Params"),
        distortion,
        _pose(mapping(entry.get("T_Device_Camera"), f"{where}: T_Device_Camera"), f"{where}: T_Device_Camera"),
        size(config.get("ImageWidth"), config.get("ImageHeight"), f"{where}: ConfigData"),
    )


def _pose(entry: Mapping[str, Any], where: str) -> Any:
    """The pose (4, 4) of a translation and of a quaternion [w, [x, y, z]]."""
    shift, turn = row(entry.get("Translation"), f"{where}.Translation"), entry.get("UnitQuaternion")
    parts = cast("list[Any]", turn) if isinstance(turn, list) else []
    if len(shift) != 3 or len(parts) != 2 or not isinstance(parts[1], list) or len(cast("list[Any]", parts[1])) != 3:
        raise RecipeError(f"{where}: expected Translation [x, y, z] and UnitQuaternion [w, [x, y, z]]; found {shown(turn)}")
    return rigid(from_quaternion(row([parts[0], *parts[1]], f"{where}.UnitQuaternion"), where), shift)
