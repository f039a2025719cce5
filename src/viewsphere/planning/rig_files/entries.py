"""The values of a sensor in a calibration."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from viewsphere.composing.viewpoints.pose_files.motions import nearest_rotation
from viewsphere.errors import RecipeError
from viewsphere.geometry.lenses import LensParameters, lens_parameters, opencv_parameters
from viewsphere.geometry.rotation import compose, rigid, transform
from viewsphere.validation.errors import told_of

Float = NDArray[np.float64]

CENTER = 0.5
"""Offset added to principal points that are counted from the centre of the first pixel."""

LONGEST_NAME = 64
"""Characters of a sensor's name, as in recipes."""

RIGHT_ANGLES = 1e-3
"""Tolerance for rotations in files, which may have few digits; the nearest rotation replaces them."""


@dataclass(frozen=True, eq=False)
class Calibrated:
    """A sensor: focal lengths and principal point in pixels (`fx`, `fy`, `cx`, `cy`, from the image's corner), its pose (4, 4)
    in metres, and its size if the file has one.
    """

    name: str
    lens: dict[str, float]
    distortion: LensParameters | None
    rig_from_sensor: Float
    size: tuple[int, int] | None = None

    @staticmethod
    def name_by(path: Path) -> str:
        """A valid name of a sensor from its file's: letters without accents, and `_` for what names may not have."""
        plain = unicodedata.normalize("NFKD", path.stem).encode("ascii", "ignore").decode()
        return re.sub(r"[^A-Za-z0-9.-]+", "_", plain).lstrip("_.-")[:LONGEST_NAME].rstrip("_.-") or "camera"


def pinhole(camera: Float, where: str) -> dict[str, float]:
    """The lens of a calibration's camera matrix (3, 3 or more), with pixels measured from the centre of the first one."""
    return camera_matrix(*(float(camera[place]) for place in ((0, 0), (1, 1), (0, 2), (1, 2))), where=where)


def camera_matrix(fx: float, fy: float, cx: float, cy: float, where: str) -> dict[str, float]:
    """The lens of these entries of a camera matrix, with pixels measured from the centre of the first one."""
    if min(fx, fy) <= 0:
        raise RecipeError(f"{where}: expected focal lengths above 0; found {fx:g} and {fy:g}")
    return {"fx": fx, "fy": fy, "cx": cx + CENTER, "cy": cy + CENTER}


def brown_conrady(numbers: Sequence[float], where: str) -> LensParameters | None:
    """OpenCV's k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 s2 s3 s4 [tx ty]]]]; None if all are 0."""
    if len(numbers) not in (0, 4, 5, 8, 12, 14):
        raise RecipeError(f"{where}: expected 4, 5, 8, 12 or 14 numbers; found {len(numbers)}")
    if not any(numbers):
        return None
    with told_of(where):
        if any(numbers[8:]):
            return lens_parameters("thin_prism", coefficients=tuple(numbers))
        return opencv_parameters(tuple(numbers[:8]))


def fisheye(numbers: Sequence[float], where: str) -> LensParameters:
    """The four coefficients of Kannala and Brandt; if all are 0, the equidistant fisheye."""
    if len(numbers) != 4:
        raise RecipeError(f"{where}: expected 4 numbers; found {len(numbers)}")
    with told_of(where):
        return opencv_parameters(tuple(numbers), is_fisheye=True)


def rotation(matrix: Float, where: str) -> Float:
    """The rotation (3, 3) nearest to a file's matrix; raises RecipeError if they differ too much."""
    rotation = nearest_rotation(matrix) if matrix.shape == (3, 3) else None
    if rotation is None or not np.abs(rotation - matrix).max() <= RIGHT_ANGLES:
        raise RecipeError(f"{where}: expected a rotation; found a matrix that is none")
    return rotation


def inverse(turn: Float, shift: Float) -> Float:
    """The inverse (4, 4) of the motion x -> turn x + shift."""
    back = np.ascontiguousarray(turn.T)
    return rigid(back, -transform(back, shift))


def relative(sensors: Sequence[Calibrated]) -> tuple[Calibrated, ...]:
    """The sensors with their poses in the first one's axes instead of common ones."""
    if not sensors:
        return ()
    first = sensors[0].rig_from_sensor
    back = inverse(first[:3, :3], first[:3, 3])
    others = (replace(sensor, rig_from_sensor=compose(back, sensor.rig_from_sensor)) for sensor in sensors[1:])
    return replace(sensors[0], rig_from_sensor=np.eye(4)), *others
