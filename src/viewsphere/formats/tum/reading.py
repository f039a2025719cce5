"""Reads sequences of TUM's RGB-D data set and of ICL-NUIM."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import StoreError
from viewsphere.files import read_text
from viewsphere.formats.shared.reading.image_lists import MISTAKES, one_line
from viewsphere.formats.shared.reading.posed_pictures import Posed, camera_of, picture_inside, posed_dataset
from viewsphere.geometry.lenses import opencv_parameters
from viewsphere.geometry.rotation import matrix_from_quaternion
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.store.foreign import ForeignDataset
from viewsphere.store.paths import is_name

APART = 0.02
"""Seconds by which a picture, its depth and its pose may differ, as in TUM's own tool."""

STEP = 1 / 5000
"""Size of a depth step, metres."""

Timed = tuple[float, list[str]]
"""A time in seconds, and the words after it."""


def read(path: Path, *, keep_going: bool = False) -> ForeignDataset:
    """The pictures of one sensor's folder, as a sequence, each with the depth and the pose that are nearest in time.

    The lens is that of `calibration.txt`, a line of fx fy cx cy [k1 k2 p1 p2 [k3]], pixels from the centre of the first pixel,
    which TUM's and ICL-NUIM's own folders lack. A negative fy means that the world is mirrored, as in ICL-NUIM; it is mirrored
    back. Pictures without a pose or a depth within 0.02 s are left out, as in TUM's tool; there are no objects.
    Raises StoreError for unreadable entries; with `keep_going` such pictures are left out and reported.
    """
    name, file = path.resolve().name, path / "calibration.txt"
    if not is_name(name):
        raise StoreError(f"{path}: expected a folder whose name a sequence can have")
    try:
        values = list(map(float, _rows(file)[0]))
    except (IndexError, ValueError):
        raise StoreError(f"{file}: expected a line of fx fy cx cy k1 k2 p1 p2 k3; found none") from None
    poses_file = min(path.glob("*.gt.freiburg"), default=path / "groundtruth.txt")
    poses, texts, problems = _timed(poses_file), [file, poses_file], list[str]()
    pictures, depths = _lists(path, texts)
    found: list[Posed] = []
    for seconds, (picture, *_) in pictures:
        pose, depth = _nearest(poses, seconds), _nearest(depths, seconds)
        if pose is None or depth is None:
            continue
        try:
            (rgb, size), (mapped, _) = picture_inside(path, picture), picture_inside(path, depth[0])
            camera = camera_of(_lens(values, size), _pose(pose, values[1] < 0))
            found.append(Posed(rgb, camera, sequence=name, instant=len(found), time=seconds, depth=mapped, step=STEP))
        except MISTAKES as error:
            problems.append(f"{path}: picture of {seconds:g} s: {one_line(error)}")
    timed = [replace(one, time=one.time - found[0].time) for one in found]
    return posed_dataset(path, timed, texts, problems, keep_going)


def _lists(path: Path, texts: list[Path]) -> tuple[list[Timed], list[Timed]]:
    """The pictures and depths of a folder with their times, from rgb.txt and depth.txt, or else from associations.txt."""
    colors, depths, pairs = path / "rgb.txt", path / "depth.txt", path / "associations.txt"
    if colors.is_file():
        texts += [colors, depths]
        return _timed(colors), _timed(depths)
    texts.append(pairs)
    found = [(float(row[i]), [row[i + 1]]) for row in _rows(pairs) if len(row) == 4 for i in (0, 2)]
    of = {kind: sorted(one for one in found if one[1][0].startswith(kind)) for kind in ("rgb", "depth")}
    return of["rgb"], of["depth"]


def _rows(file: Path) -> list[list[str]]:
    """The words of each line, without comments."""
    try:
        text = read_text(file, "MAX_RECORD_BYTES")
    except (OSError, ValueError) as error:
        raise StoreError(f"{file}: expected a text of a line each; found: {error}") from None
    return [line.split() for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]


def _timed(file: Path) -> list[Timed]:
    """The lines by their times, ascending."""
    try:
        found = sorted((float(seconds), words) for seconds, *words in _rows(file) if words)
    except ValueError as error:
        raise StoreError(f"{file}: expected seconds at the beginning of each line; found: {error}") from None
    if not np.isfinite([seconds for seconds, _ in found]).all():
        raise StoreError(f"{file}: a line does not begin with seconds")
    return found


def _nearest(rows: Sequence[Timed], seconds: float) -> list[str] | None:
    """The words of the line nearest in time; None if no line is near."""
    at = bisect_left(rows, seconds, key=lambda row: row[0])
    apart, words = min(((abs(time - seconds), words) for time, words in rows[max(at - 1, 0) : at + 1]), default=(np.inf, []))
    return words if apart <= APART else None


def _pose(words: Sequence[str], mirrored: bool) -> NDArray[np.float64]:
    """The pose world_from_camera (3, 4) from tx ty tz qx qy qz qw."""
    x, y, z, *turn = map(float, words)
    a, b, c, w = turn
    pose = np.column_stack((matrix_from_quaternion((w, a, b, c)), (x, y, z)))
    return pose[[0, 2, 1]] * (1.0, -1.0, 1.0, 1.0) if mirrored else pose


def _lens(values: Sequence[float], size: tuple[int, int]) -> Intrinsics:
    fx, fy, cx, cy, *bent = values
    if len(bent) not in (0, 4, 5):
        raise ValueError(f"expected 4, 8 or 9 numbers in calibration.txt; found {len(values)}")
    own = bent if any(bent[4:]) else bent[:4]
    lens = opencv_parameters(tuple(own)) if any(own) else None
    return Intrinsics(width=size[0], height=size[1], fx=fx, fy=abs(fy), cx=cx + 0.5, cy=cy + 0.5, distortion=lens)
