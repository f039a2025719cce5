"""Trajectories of TUM RGB-D and of KITTI odometry."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from viewsphere.composing.viewpoints.pose_files.entries import Extrinsics, PoseFile
from viewsphere.composing.viewpoints.pose_files.lines import counted, read_lines
from viewsphere.composing.viewpoints.pose_files.motions import from_matrix, from_quaternion, motion


def read_tum(path: Path) -> PoseFile:
    """Lines of time, x, y, z, qx, qy, qz, qw: camera to world (https://cvg.cit.tum.de/data/datasets/rgbd-dataset/file_formats)."""
    entries, times = list[Extrinsics](), list[float]()
    for line, words in read_lines(path):
        where = f"{path}:{line}"
        seconds, x, y, z, qx, qy, qz, qw = counted(words, 8, where)
        entries.append(motion(from_quaternion((qw, qx, qy, qz), where), np.array([x, y, z]), where))
        times.append(seconds)
    return PoseFile(tuple(entries), times=tuple(times))


def read_kitti(path: Path) -> PoseFile:
    """Lines of 12 numbers, the rows of a 3x4 camera-to-world matrix (https://www.cvlibs.net/datasets/kitti/eval_odometry.php).

    The world is the first camera's: y points down.
    """
    entries = tuple(from_matrix(counted(words, 12, f"{path}:{line}"), f"{path}:{line}") for line, words in read_lines(path))
    return PoseFile(entries, up="-y")
