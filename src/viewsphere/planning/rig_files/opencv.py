"""OpenCV's stereo calibrations, as `FileStorage` writes them: lenses K1, D1, K2, D2 (or M1, M2), and R, T.

A point X of the left camera is R X + T in the right one (https://docs.opencv.org/4.x/d9/d0c/group__calib3d.html,
stereoCalibrate).
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import chain
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import RecipeError
from viewsphere.geometry.lenses import LensParameters
from viewsphere.geometry.rotation import rigid
from viewsphere.planning.rig_files.documents import matrix, size
from viewsphere.planning.rig_files.entries import Calibrated, brown_conrady, fisheye, inverse, pinhole, rotation
from viewsphere.validation.errors import shown

Float = NDArray[np.float64]


def is_own(document: Mapping[str, Any]) -> bool:
    """Return whether a document is a calibration of OpenCV's: of a pair, or of one camera."""
    return bool(document.keys() & {"K1", "M1", "R", "T"}) or "camera_matrix" in document


def sensors(documents: Mapping[Path, dict[str, Any]], rectified: bool) -> tuple[Calibrated, ...]:
    """`left` and `right`: the raw cameras, or with `rectified` the pinholes of P1 and P2. Lenses with 4 coefficients are
    fisheyes if the file has `model: fisheye`. A file with one camera_matrix is a single camera, with the file's name.
    """
    where = ", ".join(map(str, documents))
    found = dict(chain.from_iterable(document.items() for document in documents.values()))
    extent = _size(found, where)
    if "camera_matrix" in found:
        return _single(found, rectified, Calibrated.name_by(next(iter(documents))), where)
    if rectified:
        left, right = (matrix(found.get(name), f"{where}: {name}", (3, 4)) for name in ("P1", "P2"))
        lenses = [(pinhole(one, where), None) for one in (left, right)]  # which refuses focal lengths of 0
        apart = -float(right[0, 3]) / float(right[0, 0])
        poses = np.eye(4), rigid(np.eye(3), (apart, 0.0, 0.0))
    else:
        turn = rotation(matrix(found.get("R"), f"{where}: R"), f"{where}: R")
        shift = matrix(found.get("T"), f"{where}: T").ravel()
        if len(shift) != 3 or not shift.any():
            raise RecipeError(f"{where}: T: expected 3 numbers, not all 0; found {shown(shift.tolist())}")
        lenses = ((pinhole(_camera(found, i, where), where), _distortion(found, i, where)) for i in (1, 2))
        poses = np.eye(4), inverse(turn, shift)
    named = zip(("left", "right"), lenses, poses, strict=True)
    return tuple(Calibrated(name, lens, bent, pose, extent) for name, (lens, bent), pose in named)


def _single(found: Mapping[str, Any], rectified: bool, name: str, where: str) -> tuple[Calibrated, ...]:
    """One camera, as OpenCV's calibration programs write it; `fisheye_model: 1` makes it a fisheye."""
    if rectified:
        raise RecipeError(f"{where}: expected rectified: true beside P1 and P2; found one camera")
    lens = pinhole(matrix(found["camera_matrix"], f"{where}: camera_matrix", (3, 3)), where)
    given = found.get("distortion_coefficients")
    numbers = [] if given is None else matrix(given, f"{where}: distortion_coefficients").ravel().tolist()
    bent = (fisheye if found.get("fisheye_model") == 1 else brown_conrady)(numbers, f"{where}: distortion_coefficients")
    return (Calibrated(name, lens, bent, np.eye(4), _size(found, where)),)


def _camera(found: Mapping[str, Any], number: int, where: str) -> Float:
    name = next((name for name in (f"K{number}", f"M{number}", f"cameraMatrix{number}") if name in found), f"K{number}")
    return matrix(found.get(name), f"{where}: {name}", (3, 3))


def _distortion(found: Mapping[str, Any], number: int, where: str) -> LensParameters | None:
    name = next((name for name in (f"D{number}", f"distCoeffs{number}") if name in found), f"D{number}")
    numbers = matrix(found[name], f"{where}: {name}").ravel().tolist() if name in found else []
    return (fisheye if found.get("model") == "fisheye" else brown_conrady)(numbers, f"{where}: {name}")


def _size(found: Mapping[str, Any], where: str) -> tuple[int, int] | None:
    for name in ("size", "image_size", "imageSize"):
        if isinstance(found.get(name), list):
            values = cast("list[Any]", found[name])
            if len(values) == 2:
                return size(values[0], values[1], f"{where}: {name}")
    return size(found.get("image_width"), found.get("image_height"), f"{where}: image_width, image_height")
