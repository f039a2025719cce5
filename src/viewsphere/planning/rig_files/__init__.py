"""Calibrations of rigs and of cameras, a file for each kind; each has `is_own(document)` and `sensors(documents, rectified)`.

All but COLMAP measure pixel coordinates from the centre of the first pixel. Here the origin is the image's corner, so that
principal points are shifted by half a pixel.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from viewsphere.errors import RecipeError
from viewsphere.planning.rig_files.documents import read_document
from viewsphere.planning.rig_files.entries import Calibrated

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
    calibrated = _reader(kind).sensors(documents, rectified)
    names = [sensor.name.casefold() for sensor in calibrated]
    if len(set(names)) < len(names):
        raise RecipeError(
            f"{paths[0]}: expected sensors of different names; found {', '.join(sensor.name for sensor in calibrated)}"
        )
    return calibrated


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
