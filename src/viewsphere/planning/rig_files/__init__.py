"""Calibrations of rigs: OpenCV's YAML, Kalibr's camchain, ROS' camera_info.

All three measure pixel coordinates from the centre of the first pixel. Here the origin is the image's corner, so that principal
points are shifted by half a pixel.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from viewsphere.errors import RecipeError
from viewsphere.planning.rig_files.documents import read_document
from viewsphere.planning.rig_files.entries import Calibrated

__all__ = ["Calibrated", "read_rig"]


def read_rig(paths: Sequence[Path], kind: str = "auto", rectified: bool = False) -> tuple[Calibrated, ...]:
    """The sensors of a rig's calibration files, the first being the rig's origin.

    `kind` is `opencv`, `kalibr`, `camera_info`, or `auto`: by the content of the first file. `rectified`: the pinholes of P
    instead of the raw lenses. Raises RecipeError, with the file, for missing or unreadable files.
    """
    documents = {path: read_document(path) for path in paths}
    kind = _kind(paths[0], documents[paths[0]]) if kind == "auto" else kind
    if kind == "camera_info":
        from viewsphere.planning.rig_files.camera_info import sensors
    elif kind == "kalibr":
        from viewsphere.planning.rig_files.kalibr import sensors
    else:
        from viewsphere.planning.rig_files.opencv import sensors
    calibrated = sensors(documents, rectified)
    names = [sensor.name.casefold() for sensor in calibrated]
    if len(set(names)) < len(names):
        raise RecipeError(
            f"{paths[0]}: expected sensors of different names; found {', '.join(sensor.name for sensor in calibrated)}"
        )
    return calibrated


def _kind(path: Path, document: dict[str, Any]) -> str:
    if {"camera_matrix", "projection_matrix"} <= document.keys():
        return "camera_info"
    if "cam0" in document:
        return "kalibr"
    if document.keys() & {"K1", "M1", "R", "T"}:
        return "opencv"
    raise RecipeError(
        f"{path}: expected camera_matrix and projection_matrix (ROS' camera_info), cam0 (Kalibr), or K1, D1, K2, D2, R, T "
        f"(OpenCV); found {'none of them' if document else 'nothing'}"
    )
