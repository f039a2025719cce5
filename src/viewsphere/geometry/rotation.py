"""Rotations as matrices and as unit quaternions (w, x, y, z), Hamilton's convention, active."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

Float = NDArray[np.float64]

ROTATION_TOLERANCE = 1e-5
"""Tolerance for scalar products of a rotation's rows (0 or 1)."""


def matrix_from_quaternion(quaternion: ArrayLike) -> Float:
    """Rotation matrix (3, 3) of the quaternion (w, x, y, z), of any length but zero."""
    q = np.asarray(quaternion, np.float64)
    norm = np.linalg.norm(q)
    if q.shape != (4,) or not np.isfinite(norm) or norm == 0:
        raise ValueError(f"matrix_from_quaternion: expected 4 finite numbers, not all zero, got {quaternion}")
    w, x, y, z = q / norm
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def quaternion_from_matrix(matrix: ArrayLike) -> tuple[float, float, float, float]:
    """Unit quaternion (w, x, y, z) with w >= 0 of a rotation matrix (3, 3).

    At a half turn (w = 0) the first of x, y, z that is not zero is positive, so equal rotations give equal
    numbers. The largest of the four is computed first and divides the others: no rotation is
    ill-conditioned (Shepperd 1978).
    """
    m = np.asarray(matrix, np.float64)
    if m.shape != (3, 3) or not _is_rotation(m.tolist()):
        raise ValueError(f"quaternion_from_matrix: expected a (3, 3) rotation, got {m.tolist()}")
    (a, b, c), (d, e, f), (g, h, i) = m.tolist()  # for so few numbers Python is five times as fast as numpy
    # Row i holds 4 q_i (w, x, y, z): the row of the largest q_i has the most digits.
    products = (
        (1 + a + e + i, h - f, c - g, d - b),
        (h - f, 1 + a - e - i, b + d, c + g),
        (c - g, b + d, 1 - a + e - i, f + h),
        (d - b, c + g, f + h, 1 - a - e + i),
    )
    row = products[max(range(4), key=lambda k: products[k][k])]
    w, x, y, z = row
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    q = [0.0 if abs(value / norm) < 1e-15 else value / norm for value in row]
    sign = 1.0 if next(value for value in q if value) > 0 else -1.0
    w, x, y, z = (value * sign + 0.0 for value in q)
    return w, x, y, z


def random_rotation(rng: np.random.Generator) -> Float:
    """A rotation (3, 3), uniform over all rotations: a quaternion of four numbers in the unit ball, drawn by rejection. Sines
    and logarithms are avoided, because their last digits differ between processors.
    """
    while True:
        quaternion = 2 * rng.random(4) - 1
        square = float((quaternion * quaternion).sum())
        if 1e-6 < square <= 1:
            return matrix_from_quaternion(quaternion / math.sqrt(square))


def rotation_about(vector: ArrayLike) -> Float:
    """Rotation matrix (3, 3) by |vector| radians about a vector (3,), counterclockwise seen from its tip."""
    return matrix_from_quaternion(quaternion_about(vector))


def quaternion_about(vector: ArrayLike) -> Float:
    """Unit quaternion (w, x, y, z) of a turn by |vector| radians about a vector (3,); (1, 0, 0, 0) for zero."""
    x, y, z = np.asarray(vector, np.float64).tolist()
    angle = math.sqrt(x * x + y * y + z * z)
    s = math.sin(angle / 2) / angle if angle else 0.0
    return np.array([math.cos(angle / 2), x * s, y * s, z * s])


def quaternion_product(a: ArrayLike, b: ArrayLike) -> Float:
    """Hamilton's product (4,) of two quaternions (w, x, y, z): the rotation `b` followed by `a`."""
    (p, q, r, s), (w, x, y, z) = np.asarray(a, np.float64).tolist(), np.asarray(b, np.float64).tolist()
    return np.array(
        [
            p * w - q * x - r * y - s * z,
            p * x + q * w + r * z - s * y,
            p * y - q * z + r * w + s * x,
            p * z + q * y - r * x + s * w,
        ]
    )


def rotation_vector(matrix: ArrayLike) -> Float:
    """The rotation vector (3,) of a rotation (3, 3): its axis times the angle, at most pi radians, counterclockwise seen from
    its tip. It is rounded to 1e-12, because the last digits of angles differ between processors.
    """
    w, x, y, z = quaternion_from_matrix(matrix)
    sine = math.sqrt(x * x + y * y + z * z)
    factor = 2 * math.atan2(sine, w) / sine if sine else 2.0
    return np.array([round(factor * value, 12) + 0.0 for value in (x, y, z)])


def slerp(start: ArrayLike, end: ArrayLike, share: float) -> Float:
    """The unit quaternion (4,) at a share of the shorter way from one unit quaternion (w, x, y, z) to another. The angle grows
    linearly with the share. Shoemake 1985.
    """
    a, b = np.asarray(start, np.float64), np.asarray(end, np.float64)
    if float((a * b).sum()) < 0:
        b = -b
    apart, along = math.sqrt(float(((b - a) ** 2).sum())), math.sqrt(float(((b + a) ** 2).sum()))
    angle = 2 * math.atan2(apart, along)  # unlike the arc cosine, exact for small angles
    if angle < 1e-12:
        return a
    return (math.sin((1 - share) * angle) * a + math.sin(share * angle) * b) / math.sin(angle)


def _is_rotation(rows: list[list[float]]) -> bool:
    """Return whether the rows are approximately right-handed and orthonormal."""
    a, b, c = rows
    lengths = all(abs(_dot(row, row) - 1) <= ROTATION_TOLERANCE for row in rows)
    angles = all(abs(_dot(one, other)) <= ROTATION_TOLERANCE for one, other in ((a, b), (b, c), (c, a)))
    normal = b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]
    return lengths and angles and _dot(a, normal) >= 0


def _dot(a: Sequence[float], b: Sequence[float]) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def transform(matrix: ArrayLike, points: ArrayLike) -> Float:
    """Points (..., 3) moved by the first three rows of a (3 or 4, 4) matrix, or turned by a (3, 3) matrix.

    The products are written out, because BLAS rounds differently from processor to processor.
    """
    m, p = np.asarray(matrix, np.float64), np.asarray(points, np.float64)
    columns = m[:3].T.reshape(m.shape[1], 3, *[1] * (p.ndim - 1))
    moved = columns[0] * p[..., 0] + columns[1] * p[..., 1] + columns[2] * p[..., 2]
    if m.shape[1] == 4:
        moved += columns[3]
    return np.ascontiguousarray(moved.transpose(*range(1, moved.ndim), 0))


def product(a: ArrayLike, b: ArrayLike) -> Float:
    """The matrix products a b of (..., 3, 3) and (..., 3, n); no BLAS, as in `transform`."""
    a, b = np.asarray(a, np.float64), np.asarray(b, np.float64)
    return a[..., :, :1] * b[..., :1, :] + a[..., :, 1:2] * b[..., 1:2, :] + a[..., :, 2:] * b[..., 2:, :]


def inverse(matrix: ArrayLike) -> Float:
    """Return the inverses of matrices (..., 3, 3) by their cofactors: LAPACK rounds differently on each processor."""
    m = np.asarray(matrix, np.float64)
    cofactors = np.stack([np.cross(m[..., (i + 1) % 3, :], m[..., (i + 2) % 3, :]) for i in range(3)], axis=-1)
    x, y, z = (m[..., 0, i] * cofactors[..., i, 0] for i in range(3))
    return cofactors / (x + y + z)[..., None, None]


def rigid(rotation: ArrayLike, translation: ArrayLike) -> Float:
    """The (4, 4) matrix of x -> rotation x + translation."""
    matrix = np.zeros((4, 4))
    matrix[:3, :3], matrix[:3, 3], matrix[3, 3] = rotation, translation, 1.0
    return matrix


def inverse_pose(pose: ArrayLike) -> Float:
    """The inverse (4, 4) of a pose (4, 4)."""
    known = np.asarray(pose, np.float64)
    turned = inverse(known[:3, :3])
    return rigid(turned, -transform(turned, known[:3, 3]))


def compose(a: ArrayLike, b: ArrayLike) -> Float:
    """The affine motion `b` followed by `a`, (4, 4) each; no BLAS, as in `transform`."""
    a, b = np.asarray(a, np.float64), np.asarray(b, np.float64)
    moved = a[:3, :1] * b[0] + a[:3, 1:2] * b[1] + a[:3, 2:3] * b[2]
    moved[:, 3] += a[:3, 3]
    return rigid(moved[:, :3], moved[:, 3])
