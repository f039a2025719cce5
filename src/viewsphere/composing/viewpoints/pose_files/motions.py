"""Conversion of rotations and motions from other conventions."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from viewsphere.composing.viewpoints.pose_files.entries import Extrinsics, Row
from viewsphere.errors import RecipeError
from viewsphere.geometry.rotation import matrix_from_quaternion

Float = NDArray[np.float64]

RIGHT_ANGLES = 1e-3
"""Tolerance for rotations in files, which may have few digits; the nearest rotation replaces them."""


def from_quaternion(wxyz: Sequence[float], where: str) -> Float:
    """The rotation (3, 3) of a quaternion of any length but 0."""
    length = math.hypot(*wxyz)
    if not 1e-9 <= length < math.inf:
        raise RecipeError(f"{where}: expected a quaternion; found one of length {'0' if length < 1 else 'infinity'}")
    w, x, y, z = (c / length for c in wxyz)
    return matrix_from_quaternion((w, x, y, z))


def motion(world_from_camera: Float, center: Float, where: str) -> Extrinsics:
    """A camera from its rotation to the world (3, 3), OpenCV axes, and its centre; raises RecipeError if the matrix is not a
    rotation.
    """
    rotation = nearest_rotation(world_from_camera)
    if rotation is None or np.abs(rotation - world_from_camera).max() > RIGHT_ANGLES:
        raise RecipeError(f"{where}: expected a rotation; found a matrix that is none")
    return Extrinsics(_rows(rotation.T), _row(center))


def nearest_rotation(matrix: Float) -> Float | None:
    """The rotation nearest to an approximate rotation matrix; None for a mirror image or a singular matrix.

    Newton's iteration for the polar factor (Higham 1986), written out, because LAPACK rounds differently from processor to
    processor.
    """
    for _ in range(8):
        a, b, c = matrix
        cofactors = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)])
        determinant = float((a * cofactors[0]).sum())
        if determinant < 0.5:
            return None
        matrix = (matrix + cofactors / determinant) / 2
    return matrix


def motions(poses: Float, where: Callable[[int], str]) -> tuple[Extrinsics, ...]:
    """The results of `motion` for many poses (N, 4, 4), all at once, which is a hundred times faster; `where` returns a pose's
    place for messages.
    """
    given = poses[:, :3, :3]
    turns = given
    for _ in range(8):
        a, b, c = np.moveaxis(turns, 1, 0)
        cofactors = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1)
        determinants = (a * cofactors[:, 0]).sum(axis=1)
        safe = np.where(determinants < 0.5, np.inf, determinants)  # a mirror image, or singular: halved again and again
        turns = (turns + cofactors / safe[:, None, None]) / 2
    wrong = np.flatnonzero(~(np.abs(turns - given).max(axis=(1, 2), initial=0.0) <= RIGHT_ANGLES))
    if wrong.size:
        raise RecipeError(f"{where(int(wrong[0]))}: expected a rotation; found a matrix that is none")
    rows = np.moveaxis(turns, 1, 2).tolist()
    centers = poses[:, :3, 3].tolist()
    return tuple(Extrinsics(((*r[0],), (*r[1],), (*r[2],)), (x, y, z)) for r, (x, y, z) in zip(rows, centers, strict=True))


def _row(values: Float) -> Row:
    x, y, z = (float(v) for v in values)
    return x, y, z


def _rows(matrix: Float) -> tuple[Row, Row, Row]:
    return _row(matrix[0]), _row(matrix[1]), _row(matrix[2])
