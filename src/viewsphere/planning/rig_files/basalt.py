"""Basalt's calibrations: JSON with the cameras' intrinsics, resolutions and poses in the IMU's axes.

Sources: https://gitlab.com/VladyslavUsenko/basalt/-/blob/master/doc/Calibration.md, and the models of basalt-headers. Pixels
are counted from the centre of the first one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from viewsphere.composing.viewpoints.pose_files.lines import number
from viewsphere.composing.viewpoints.pose_files.motions import from_quaternion
from viewsphere.errors import RecipeError
from viewsphere.geometry.lenses import LensParameters, lens_parameters
from viewsphere.geometry.rotation import rigid
from viewsphere.planning.rig_files.documents import listed, mapping, one_of, row, size
from viewsphere.planning.rig_files.entries import Calibrated, brown_conrady, camera_matrix, fisheye, relative
from viewsphere.validation.errors import told_of

MATRIX = ("fx", "fy", "cx", "cy")


class _Model(NamedTuple):
    names: str
    lens: Callable[[Sequence[float], str], LensParameters | None]


def _double_sphere(values: Sequence[float], _where: str) -> LensParameters:
    return lens_parameters("double_sphere", xi=values[0], alpha=values[1])


def _eucm(values: Sequence[float], _where: str) -> LensParameters:
    return lens_parameters("eucm", alpha=values[0], beta=(*values, 1.0)[1])


def _pinhole(_values: Sequence[float], _where: str) -> None:
    return None


MODELS = {
    "ds": _Model("xi alpha", _double_sphere),
    "eucm": _Model("alpha beta", _eucm),
    "kb4": _Model("k1 k2 k3 k4", fisheye),
    "pinhole": _Model("", _pinhole),
    "pinhole-radtan8": _Model("k1 k2 p1 p2 k3 k4 k5 k6", brown_conrady),
    "ucm": _Model("alpha", _eucm),
}


def is_own(document: Mapping[str, Any]) -> bool:
    """Return whether a document is one of Basalt's."""
    return isinstance(document.get("value0"), dict) and "intrinsics" in document["value0"]


def sensors(documents: Mapping[Path, dict[str, Any]], rectified: bool) -> tuple[Calibrated, ...]:
    """The cameras, named cam0, cam1, ..., in the first one's axes. Raises RecipeError for unknown lenses."""
    where = ", ".join(map(str, documents))
    if rectified or len(documents) > 1:
        raise RecipeError(f"{where}: expected one file of Basalt's, without rectified: true; found another setting")
    (document,) = documents.values()
    value = mapping(document.get("value0"), f"{where}: value0")
    cameras = [listed(value.get(name), f"{where}: {name}", "cameras") for name in ("intrinsics", "T_imu_cam", "resolution")]
    if len({len(entries) for entries in cameras}) > 1:
        counts = ", ".join(str(len(entries)) for entries in cameras)
        raise RecipeError(f"{where}: expected equally many intrinsics, T_imu_cam and resolution; found {counts}")
    return relative([_camera(i, a, b, c, where) for i, (a, b, c) in enumerate(zip(*cameras, strict=True))])


def _camera(i: int, lens: Any, pose: Any, extent: Any, where: str) -> Calibrated:
    at = f"{where}: intrinsics[{i}]"
    entry = mapping(lens, at)
    given = mapping(entry.get("intrinsics"), f"{at}.intrinsics")
    kind = one_of(entry.get("camera_type"), MODELS, f"{at}.camera_type")
    names = (*MATRIX, *MODELS[kind].names.split())
    values = {name: number(given.get(name), f"{at}.intrinsics.{name}") for name in names}
    with told_of(f"{at}.intrinsics"):
        distortion = MODELS[kind].lens([values[name] for name in names[len(MATRIX) :]], f"{at}.intrinsics")
    placed = mapping(pose, f"{where}: T_imu_cam[{i}]")
    turn = [number(placed.get(name), f"{where}: T_imu_cam[{i}].{name}") for name in ("qw", "qx", "qy", "qz")]
    shift = [number(placed.get(name), f"{where}: T_imu_cam[{i}].{name}") for name in ("px", "py", "pz")]
    sides = row(extent, f"{where}: resolution[{i}]")
    if len(sides) != 2:
        raise RecipeError(f"{where}: resolution[{i}]: expected [width, height]; found {len(sides)} numbers")
    return Calibrated(
        f"cam{i}",
        camera_matrix(*(values[name] for name in MATRIX), where=f"{at}.intrinsics"),
        distortion,
        rigid(from_quaternion(turn, f"{where}: T_imu_cam[{i}]"), shift),
        size(sides[0], sides[1], f"{where}: resolution[{i}]"),
    )
