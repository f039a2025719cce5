"""A 3D box. Only this module depends on the order of its eight corners.

Object axes: front -Y, up +Z; left (+X) and right (-X) are the object's own sides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Side = tuple[int, int, int]
"""The side of a box's centre on which a corner is, in x, y and z: 1 or -1 each."""

_SIDES: tuple[Side, ...] = (
    (1, 1, -1),
    (1, -1, -1),
    (-1, -1, -1),
    (-1, 1, -1),
    (1, 1, 1),
    (1, -1, 1),
    (-1, -1, 1),
    (-1, 1, 1),
)
"""The side of each corner; the order of Ruiz et al. 2019."""

_FACES: dict[str, tuple[int, int, int, int]] = {
    "bottom": (0, 1, 2, 3),
    "top": (4, 7, 6, 5),
    "right": (2, 6, 7, 3),
    "front": (1, 5, 6, 2),
    "left": (0, 4, 5, 1),
    "back": (4, 0, 3, 7),
}
"""Corners of each face, in the order of Ruiz et al. 2019 (who call the bottom `ground`)."""

_EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))
"""The twelve edges, as pairs of corners."""


@dataclass(frozen=True, eq=False)
class Box3d:
    """The eight corners of a box in the order of labels: (8, 3) metres in any axes, or (8, 2) as projected by a camera."""

    corners: Array

    @classmethod
    def between(cls, low: ArrayLike, high: ArrayLike) -> Self:
        """The axis-aligned box between its lowest and its highest corner."""
        return cls(np.where(np.array(_SIDES) > 0, np.asarray(high, np.float64), np.asarray(low, np.float64)))

    @classmethod
    def around(cls, points: Array) -> Self:
        """The axis-aligned box around points (N, 3)."""
        return cls.between(points.min(axis=0), points.max(axis=0))

    @property
    def low(self) -> Array:
        """The lowest coordinates, (3,)."""
        return self.corners.min(axis=0)

    @property
    def high(self) -> Array:
        """The highest coordinates, (3,)."""
        return self.corners.max(axis=0)

    @property
    def center(self) -> Array:
        """The middle between opposite corners, (3,)."""
        return (self.corners[2] + self.corners[4]) / 2

    @property
    def diagonal(self) -> Array:
        """The vector from the right front bottom corner to the left back top one, (3,)."""
        return self.corners[4] - self.corners[2]

    @property
    def size(self) -> tuple[float, float, float]:
        """The width along X, height along Z and length along Y of an axis-aligned box."""
        x, y, z = self.diagonal.tolist()
        return x, z, y

    @property
    def faces(self) -> dict[str, Array]:
        """The corners (4, 3) of each face, in order around it, by name: bottom, top, right, front, left, back."""
        return {name: self.corners[list(corners)] for name, corners in _FACES.items()}

    @property
    def edges(self) -> Array:
        """Both ends of each of the twelve edges, (12, 2, 3)."""
        return self.corners[np.array(_EDGES)]

    def corners_at(self, sides: Sequence[Side]) -> Array:
        """The corners on these sides of the centre, (N, 3)."""
        return self.corners[[_SIDES.index(side) for side in sides]]

    @staticmethod
    def numbered_faces() -> dict[str, tuple[int, int, int, int]]:
        """The numbers of each face's corners, by the face's name, for files that list corners by number."""
        return dict(_FACES)

    @staticmethod
    def layout() -> dict[str, Any]:
        """Faces and edges as corner numbers, and the side of each corner, for viewers that have only the corners."""
        return {"faces": _FACES, "edges": _EDGES, "signs": _SIDES}
