"""COLMAP's cameras.txt or cameras.bin, and rigs.txt for the poses of several cameras (https://colmap.github.io/format.html).

Pixels are counted from the image's corner, as here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.composing.viewpoints.pose_files.colmap import colmap_camera
from viewsphere.composing.viewpoints.pose_files.lines import numbers
from viewsphere.composing.viewpoints.pose_files.motions import from_quaternion
from viewsphere.errors import RecipeError
from viewsphere.planning.rig_files.entries import Calibrated, inverse

Float = NDArray[np.float64]


def is_own(document: Mapping[str, Any]) -> bool:
    """Return whether a document has COLMAP's cameras: lines CAMERA_ID MODEL WIDTH HEIGHT PARAMS."""
    lines = document.get("lines")
    return isinstance(lines, list) and bool(lines) and all(_is_camera(line) for line in lines)


def _is_camera(line: Sequence[str]) -> bool:
    return len(line) > 4 and line[0].isdigit() and line[1].isupper()


def sensors(documents: Mapping[Path, dict[str, Any]], rectified: bool) -> tuple[Calibrated, ...]:
    """The cameras, named camera1, camera2, ... by their numbers; with a rigs.txt, those of its first rig, in its order."""
    where = ", ".join(map(str, documents))
    cameras = [(path, document) for path, document in documents.items() if is_own(document)]
    rigs = [(path, document) for path, document in documents.items() if not is_own(document)]
    if rectified or len(cameras) != 1 or len(rigs) > 1:
        raise RecipeError(f"{where}: expected COLMAP's cameras, perhaps a rigs.txt, not rectified; found another setting")
    ((path, document),) = cameras
    found = {int(line[0]): colmap_camera(line, f"{path}: camera {line[0]}") for line in document["lines"]}
    if not rigs and len(found) > 1:
        raise RecipeError(f"{path}: expected one camera, or a rigs.txt beside it in `path`; found {len(found)} cameras")
    poses = _poses(rigs[0][1].get("lines"), str(rigs[0][0])) if rigs else {next(iter(found)): np.eye(4)}
    if missing := sorted(poses.keys() - found.keys()):
        raise RecipeError(f"{path}: expected camera {missing[0]}, which the rig has; found {', '.join(map(str, found))}")
    return tuple(_calibrated(number, found[number], pose) for number, pose in poses.items())


def _calibrated(number: int, lens: Any, pose: Float) -> Calibrated:
    values = {"fx": lens.fx, "fy": lens.fy, "cx": lens.cx, "cy": lens.cy}
    return Calibrated(f"camera{number}", values, lens.distortion, pose, (lens.width, lens.height))


def _poses(lines: Any, where: str) -> dict[int, Float]:
    """The poses, rig_from_sensor, by camera: RIG_ID NUM_SENSORS TYPE ID, then TYPE ID HAS_POSE QW QX QY QZ TX TY TZ."""
    words: list[str] = lines[0] if isinstance(lines, list) and lines else []
    if len(words) < 4 or len(words) != 4 + 10 * (int(words[1]) - 1 if words[1].isdigit() else -1):
        raise RecipeError(f"{where}: expected a rig whose sensors all have poses; found {' '.join(words)!r:.60}")
    poses = {_number(words[2:4], where): np.eye(4)}
    for first in range(4, len(words), 10):
        turn, shift = numbers(words[first + 3 : first + 7], where), np.array(numbers(words[first + 7 : first + 10], where))
        poses[_number(words[first : first + 2], where)] = inverse(from_quaternion(turn, where), shift)
    return poses


def _number(words: Sequence[str], where: str) -> int:
    if words[0] != "CAMERA" or not words[1].isdigit():
        raise RecipeError(f"{where}: expected cameras as sensors; found {' '.join(words)!r:.40}")
    return int(words[1])
