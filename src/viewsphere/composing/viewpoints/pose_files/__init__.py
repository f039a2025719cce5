"""Files of poses: orbits (CSV, Render for CNN's view files), motions (TUM, KITTI, nerfstudio, COLMAP) and listed shots."""

from __future__ import annotations

from pathlib import Path

from viewsphere.composing.viewpoints.pose_files.entries import Arranged, Extrinsics, Orbit, PoseFile
from viewsphere.composing.viewpoints.pose_files.lines import read_lines
from viewsphere.errors import RecipeError
from viewsphere.validation.errors import one_of

FORMATS = ("csv", "view", "tum", "kitti", "nerfstudio", "colmap", "shots")
COLUMNS = {4: "view", 8: "tum", 12: "kitti"}
"""Count of numbers in a line, for formats whose lines are only numbers."""

ENDINGS = {".json": "nerfstudio", ".csv": "csv", ".jsonl": "shots"}

__all__ = ["FORMATS", "Arranged", "Extrinsics", "Orbit", "PoseFile", "read_poses"]


def read_poses(path: Path, kind: str = "auto", every: int = 1) -> PoseFile:
    """Every `every`-th pose of a file (of COLMAP: a folder), and the file's lens if it has one.

    `kind` is one of FORMATS, or `auto`: by the path's ending, and for text by the count of numbers in its first line. Raises
    RecipeError, with file and line, for an unreadable file or a file without poses.
    """
    kind = _kind(path) if kind == "auto" else kind
    poses = _read(path, kind)
    if not poses.entries:
        raise RecipeError(f"{path}: expected at least one pose; found none")
    return poses.thinned(every)


def _kind(path: Path) -> str:
    if path.is_dir():
        return "colmap"
    if path.suffix.lower() in ENDINGS:
        return ENDINGS[path.suffix.lower()]
    if path.name == "images.txt":
        return "colmap"
    number, first = next(iter(read_lines(path)), (1, []))
    if len(first) not in COLUMNS:
        raise RecipeError(
            f"{path}:{number}: expected 4 numbers in a line (azimuth elevation tilt distance), 8 (TUM) or 12 (KITTI); "
            f"found {len(first)}: say which format it is"
        )
    return COLUMNS[len(first)]


def _read(path: Path, kind: str) -> PoseFile:
    match kind:
        case "csv" | "view" | "tum" | "kitti":
            from viewsphere.composing.viewpoints.pose_files import text_files

            return text_files.READERS[kind](path)
        case "nerfstudio":
            from viewsphere.composing.viewpoints.pose_files.nerfstudio import read_nerfstudio

            return read_nerfstudio(path)
        case "colmap":
            from viewsphere.composing.viewpoints.pose_files.colmap import read_colmap

            return read_colmap(path)
        case "shots":
            from viewsphere.composing.viewpoints.pose_files.shots import read_shots

            return read_shots(path)
        case _:
            raise RecipeError(f"viewpoints.format: {one_of(kind, FORMATS)}")
