"""Files of text lines: orbits (CSV, Render for CNN's view files), and trajectories of TUM RGB-D and of KITTI odometry."""

from __future__ import annotations

import csv
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from viewsphere.composing.tables import known_columns
from viewsphere.composing.viewpoints.pose_files.entries import Extrinsics, Orbit, PoseFile
from viewsphere.composing.viewpoints.pose_files.lines import counted, number, read_lines, read_text
from viewsphere.composing.viewpoints.pose_files.motions import from_quaternion, motion
from viewsphere.errors import RecipeError
from viewsphere.validation.errors import nearest

NEEDED = ("azimuth", "elevation", "distance")
TILTS = ("tilt", "theta", "in_plane")
"""Names of the roll: viewsphere's, PASCAL3D+'s, and the one of pose estimators; all turn the same way."""


def _read_csv(path: Path) -> PoseFile:
    """A table with the columns azimuth, elevation, distance and, optionally, tilt (or theta); other columns are ignored.

    Degrees and metres. PASCAL3D+'s `viewpoint` fields have these names and meanings
    (https://cvgl.stanford.edu/projects/pascal3d.html).
    """
    text = read_text(path)
    delimiter = ";" if ";" in text.partition("\n")[0] else ","
    rows = csv.DictReader(text.splitlines(), delimiter=delimiter, skipinitialspace=True)
    try:
        columns = [c.strip().lower() for c in rows.fieldnames or ()]
        rows.fieldnames = columns
        for name in NEEDED:
            if name not in columns:
                found = known_columns(NEEDED, columns)
                raise RecipeError(f"{path}:1: expected columns {', '.join(NEEDED)}; found {found}{nearest(name, columns)}")
        tilt = next((name for name in TILTS if name in columns), None)
        names = (*NEEDED, tilt) if tilt else NEEDED
        entries: list[Orbit] = []
        for row in rows:
            where = f"{path}:{rows.line_num}"
            entries.append(_orbit([number(row[n], f"{where}: {n}") for n in names], where))
    except csv.Error as error:
        raise RecipeError(f"{path}:{rows.line_num}: expected CSV; found: {error}") from None
    return PoseFile(tuple(entries))


def _read_view(path: Path) -> PoseFile:
    """Lines of azimuth, elevation, tilt, distance (https://github.com/ShapeNet/RenderForCNN, `render_model_views.py`)."""
    entries: list[Orbit] = []
    for line, words in read_lines(path):
        where = f"{path}:{line}"
        azimuth, elevation, tilt, distance = counted(words, 4, where)
        entries.append(_orbit([azimuth, elevation, distance, tilt], where))
    return PoseFile(tuple(entries))


def _orbit(values: list[float], where: str) -> Orbit:
    orbit = Orbit(*values)
    if not -90 <= orbit.elevation <= 90:
        raise RecipeError(f"{where}: elevation: expected -90 to 90 degrees; found {orbit.elevation:g}")
    if orbit.distance <= 0:
        raise RecipeError(f"{where}: distance: expected metres above 0; found {orbit.distance:g}")
    return orbit


def _read_tum(path: Path) -> PoseFile:
    """Lines of time, x, y, z, qx, qy, qz, qw: camera to world (https://cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats)."""
    entries, times = list[Extrinsics](), list[float]()
    for line, words in read_lines(path):
        where = f"{path}:{line}"
        seconds, x, y, z, qx, qy, qz, qw = counted(words, 8, where)
        entries.append(motion(from_quaternion((qw, qx, qy, qz), where), np.array([x, y, z]), where))
        times.append(seconds)
    return PoseFile(tuple(entries), times=tuple(times))


def _read_kitti(path: Path) -> PoseFile:
    """Lines of 12 numbers, the rows of a 3x4 camera-to-world matrix (https://www.cvlibs.net/datasets/kitti/eval_odometry.php).

    The world is the first camera's: y points down.
    """
    entries = tuple(_from_matrix(counted(words, 12, f"{path}:{line}"), f"{path}:{line}") for line, words in read_lines(path))
    return PoseFile(entries, up="-y")


READERS: dict[str, Callable[[Path], PoseFile]] = {
    "csv": _read_csv,
    "view": _read_view,
    "tum": _read_tum,
    "kitti": _read_kitti,
}
"""Functions that read a file, by format; they raise RecipeError, with file and line."""


def _from_matrix(values: Sequence[float], where: str) -> Extrinsics:
    """A camera from the 12 (or 16) numbers of its camera-to-world matrix, row by row, OpenCV axes."""
    matrix = np.array(values[:12], np.float64).reshape(3, 4)
    return motion(matrix[:, :3], matrix[:, 3], where)
