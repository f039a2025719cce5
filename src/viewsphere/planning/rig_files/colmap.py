"""COLMAP's cameras.txt or cameras.bin, and rigs.txt for the poses of several cameras (https://colmap.github.io/format.html).

Pixels are counted from the image's corner, as here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.composing.viewpoints.pose_files.colmap import colmap_cameras
from viewsphere.composing.viewpoints.pose_files.lines import IDENTIFIER, numbers
from viewsphere.composing.viewpoints.pose_files.motions import from_quaternion
from viewsphere.errors import RecipeError
from viewsphere.planning.rig_files.entries import Calibrated, inverse
from viewsphere.validation.errors import shown

Float = NDArray[np.float64]


def is_own(document: dict[str, Any]) -> bool:
    """Return whether a document has COLMAP's cameras: lines CAMERA_ID MODEL WIDTH HEIGHT PARAMS."""
    lines: list[list[str]] = document.get("lines", [])
    return bool(lines) and all(_is_camera(line) for line in lines)


def _is_camera(line: Sequence[str]) -> bool:
    return len(line) > 4 and IDENTIFIER.fullmatch(line[0]) is not None and line[1].isupper()


def sensors(documents: Mapping[Path, dict[str, Any]], rectified: bool) -> tuple[Calibrated, ...]:
    """The cameras, named camera1, camera2, ... by their numbers; with a rigs.txt, those of its first rig, in its order."""
    where = ", ".join(map(str, documents))
    cameras = [(path, document) for path, document in documents.items() if is_own(document)]
    rigs = [(path, document) for path, document in documents.items() if not is_own(document)]
    if rectified or len(cameras) != 1 or len(rigs) > 1:
        raise RecipeError(f"{where}: expected COLMAP's cameras, perhaps a rigs.txt, not rectified; found another setting")
    ((path, document),) = cameras
    found = colmap_cameras((line, f"{path}: camera {line[0]}") for line in document["lines"])
    if not rigs and len(found) > 1:
        raise RecipeError(f"{path}: expected one camera, or a rigs.txt beside it in `path`; found {len(found)} cameras")
    poses = _poses(rigs[0][1].get("lines", []), str(rigs[0][0])) if rigs else {next(iter(found)): np.eye(4)}
    if missing := sorted(poses.keys() - found.keys()):
        raise RecipeError(f"{path}: expected camera {missing[0]}, which the rig has; found {shown(list(found))}")
    return tuple(_calibrated(number, found[number], pose) for number, pose in poses.items())


def _calibrated(number: int, lens: Any, pose: Float) -> Calibrated:
    values = {"fx": lens.fx, "fy": lens.fy, "cx": lens.cx, "cy": lens.cy}
    return Calibrated(f"camera{number}", values, lens.distortion, pose, (lens.width, lens.height))


def _poses(lines: list[list[str]], where: str) -> dict[int, Float]:
    """The poses, rig_from_sensor, by camera: RIG_ID NUM_SENSORS TYPE ID, then TYPE ID HAS_POSE QW QX QY QZ TX TY TZ."""
    words = lines[0] if lines else []
    if len(words) < 4 or len(words) != 4 + 10 * (int(words[1]) - 1 if IDENTIFIER.fullmatch(words[1]) else -1):
        raise RecipeError(f"{where}: expected a rig whose sensors all have poses; found {' '.join(words)!r:.60}")
    poses = {_number(words[2:4], where): np.eye(4)}
    for first in range(4, len(words), 10):
        turn, shift = numbers(words[first + 3 : first + 7], where), np.array(numbers(words[first + 7 : first + 10], where))
        if (camera := _number(words[first : first + 2], where)) in poses:
            raise RecipeError(f"{where}: expected every camera of the rig once; found {camera} again: leave one out")
        poses[camera] = inverse(from_quaternion(turn, where), shift)
    return poses


def _number(words: Sequence[str], where: str) -> int:
    if words[0] != "CAMERA" or not IDENTIFIER.fullmatch(words[1]):
        raise RecipeError(f"{where}: expected cameras as sensors; found {' '.join(words)!r:.40}")
    return int(words[1])
