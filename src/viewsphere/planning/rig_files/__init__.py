"""Calibrations of rigs and of cameras, a file for each kind; each has `is_own(document)` and `sensors(documents, rectified)`.

All but COLMAP measure pixel coordinates from the centre of the first pixel. Here the origin is the image's corner, so that
principal points are shifted by half a pixel.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import TypeAdapter, ValidationError

from viewsphere.errors import RecipeError
from viewsphere.model.fields.numbers import FARTHEST, LARGEST
from viewsphere.planning.rig_files.documents import read_document
from viewsphere.planning.rig_files.entries import Calibrated
from viewsphere.recipe.cameras.rig import MOST_SENSORS, SensorName
from viewsphere.validation.errors import shown

__all__ = ["Calibrated", "read_rig"]

KINDS = ("camera_info", "kalibr", "basalt", "aria", "opencv", "colmap", "ocamcalib")
"""Kinds of calibrations, in the order in which a document is tried; a camera_info has OpenCV's keys too."""


def read_rig(paths: Sequence[Path], kind: str = "auto", rectified: bool = False) -> tuple[Calibrated, ...]:
    """The sensors of a rig's calibration files, the first being the rig's origin.

    `kind` is one of `KINDS`, or `auto`: by the content of the first file. `rectified`: the pinholes of P
    instead of the raw lenses. Raises RecipeError, with the file, for missing or unreadable files.
    """
    documents = {path: read_document(path) for path in paths}
    kind = _kind(paths[0], documents[paths[0]]) if kind == "auto" else kind
    with np.errstate(all="ignore"):  # of numbers that overflow, which `_check` refuses
        calibrated = _reader(kind).sensors(documents, rectified)
    _check(calibrated, ", ".join(map(str, documents)))
    return calibrated


def _check(calibrated: Sequence[Calibrated], where: str) -> None:
    """Raise RecipeError for sensors that a recipe could not list either: their number, names, lenses and places."""
    if not 1 <= len(calibrated) <= MOST_SENSORS:
        raise RecipeError(
            f"{where}: expected 1 to {MOST_SENSORS} sensors; found {len(calibrated)}: list fewer, or set another format"
        )
    for sensor in calibrated:
        if not _is_name(sensor.name):
            expected = "a name of up to 64 letters, digits, dots, - and _ that begins with a letter or digit"
            raise RecipeError(f"{where}: expected {expected}; found {shown(sensor.name)}: rename the camera in the file")
        if not all(abs(value) <= LARGEST for value in sensor.lens.values()):
            found = ", ".join(f"{name} {value:g}" for name, value in sensor.lens.items())
            raise RecipeError(f"{where}: {sensor.name}: expected pixels up to {LARGEST:g}; found {found}: calibrate it again")
        if not (np.abs(sensor.rig_from_sensor) <= FARTHEST).all():
            place = ", ".join(f"{value:g}" for value in sensor.rig_from_sensor[:3, 3])
            raise RecipeError(f"{where}: {sensor.name}: expected a place within {FARTHEST:g} m; found {place}: use metres")
    names = [sensor.name.casefold() for sensor in calibrated]
    if len(set(names)) < len(names):
        found = ", ".join(sensor.name for sensor in calibrated)
        raise RecipeError(f"{where}: expected sensors of different names; found {found:.120}: rename one")


def _is_name(name: str) -> bool:
    try:
        TypeAdapter(SensorName).validate_python(name)
    except ValidationError:
        return False
    return True


def _reader(kind: str) -> Any:
    return import_module(f"{__name__}.{kind}")


def _kind(path: Path, document: dict[str, Any]) -> str:
    found = next((kind for kind in KINDS if _reader(kind).is_own(document)), None)
    if found is None:
        raise RecipeError(
            f"{path}: expected a calibration of ROS' camera_info (camera_matrix and projection_matrix), Kalibr (cam0), Basalt "
            "(value0), Project Aria (CameraCalibrations), OpenCV (K1, D1, K2, D2, R, T or camera_matrix), COLMAP (cameras.txt) "
            f"or OCamCalib; found {'none of them' if document else 'nothing'}"
        )
    return found
