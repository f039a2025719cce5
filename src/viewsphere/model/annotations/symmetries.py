"""The rigid motions that leave a model unchanged."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Any, cast

import numpy as np
from numpy.typing import ArrayLike
from pydantic import AfterValidator, BeforeValidator, Field

from viewsphere.geometry.rotation import Float, compose, product, rigid, rotation_about, transform
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Number
from viewsphere.model.scene import IDENTITY, Vector
from viewsphere.validation.errors import shown

MOST = 1000
"""Symmetries of one model."""

RIGID = 1e-4
"""Tolerance for scalar products of a motion's rows (0 or 1), and for the length of an axis (1)."""


def _rows(value: Any) -> Any:
    """Four rows, also of 16 numbers, row after row."""
    flat = isinstance(value, (list, tuple)) and len(cast("list[Any]", value)) == 16
    return [value[i : i + 4] for i in range(0, 16, 4)] if flat else value


def _motion(matrix: Matrix) -> Matrix:
    rotation = np.array(matrix)[:3, :3]
    if matrix[3] != IDENTITY[3]:
        raise ValueError(f"expected [0, 0, 0, 1] as the last row; found {shown(matrix[3])}")
    if np.abs((rotation[:, None] * rotation).sum(axis=2) - np.eye(3)).max() > RIGID:
        raise ValueError("the rows are not those of a rotation: each needs length 1 and right angles to the others")
    if float((np.cross(rotation[0], rotation[1]) * rotation[2]).sum()) < 0:
        raise ValueError("expected a rotation; found a mirror image, which no motion makes of a model")
    if np.abs(np.array(matrix) - np.eye(4)).max() <= RIGID:
        raise ValueError("expected a motion; found the identity, which is a symmetry of every model")
    return matrix


Row = tuple[Number, Number, Number, Number]
Matrix = tuple[Row, Row, Row, Row]
Motion = Annotated[Matrix, AfterValidator(_motion), BeforeValidator(_rows)]
"""A rigid motion that is not the identity, 4 rows of 4 numbers, or all 16 as BOP has them."""


def _unit(axis: Vector) -> Vector:
    length = math.sqrt(sum(value * value for value in axis))
    if abs(length - 1) > RIGID:
        raise ValueError(f"expected a vector of length 1; found {shown(axis)}, of length {length:.6g}")
    return axis


ALIKE = 0.01
"""Largest angle, in radians, between two rotations that count as one symmetry."""


class Continuous(Frozen):
    """A symmetry under turns by any angle around the line through `offset` along the unit vector `axis`."""

    axis: Annotated[tuple[Number, Number, Number], AfterValidator(_unit)]
    offset: tuple[Number, Number, Number] = (0.0, 0.0, 0.0)

    def turned(self, angle: float) -> Float:
        """The motion (4, 4) by an angle in radians, counterclockwise seen from the axis's tip."""
        rotation = rotation_about(np.array(self.axis) * angle)
        return rigid(rotation, np.array(self.offset) - (rotation * np.array(self.offset)).sum(axis=1))


class Symmetries(Frozen):
    """Motions in a model's own axes, metres, that map its surface onto itself, as in BOP's `models_info`.

    `discrete` are rigid motions (4, 4), without the identity; `continuous` are turns by any angle around an axis. All
    symmetries are the products of a discrete one, or the identity, and a turn around one of the continuous axes, or none. A
    ball has three continuous axes, which represent all rotations. Mirror images are not included.
    """

    discrete: tuple[Motion, ...] = Field(default=(), max_length=MOST)
    continuous: tuple[Continuous, ...] = Field(default=(), max_length=MOST)

    def motions(self, steps: int) -> Iterator[Float]:
        """Yield the symmetries (4, 4), the identity first, with `steps` turns around each continuous axis."""
        turns = [axis.turned(2 * math.pi * i / steps) for axis in self.continuous for i in range(1, steps)]
        for discrete in (IDENTITY, *self.discrete):
            yield np.array(discrete)
            yield from (compose(turn, discrete) for turn in turns)

    def unlisted(self) -> tuple[int, int] | None:
        """Indices of two discrete symmetries whose product is not listed; None if all products are, or if there are continuous
        symmetries, which join them. A bounded surface has at most one symmetry for each rotation.
        """
        if self.continuous:
            return None
        turns = np.array([IDENTITY, *self.discrete])[:, :3, :3]
        for j, after in enumerate(turns[1:]):
            traces = product(after, turns[1:]).reshape(-1, 9) @ turns.reshape(-1, 9).T
            lacking = np.flatnonzero(traces.max(axis=1) < 1 + 2 * math.cos(ALIKE))
            if len(lacking):
                return int(lacking[0]), j
        return None

    def moved(self, similarity: ArrayLike) -> Symmetries:
        """The same symmetries in other axes: `similarity` (4, 4) transforms points to those axes, and may scale them."""
        m = np.asarray(similarity, np.float64)
        scale = math.sqrt(float((m[0, :3] ** 2).sum()))
        turn = m[:3, :3] / scale

        def motion(matrix: Matrix) -> Any:
            before = np.array(matrix)
            rotation = transform(turn, transform(turn, before[:3, :3]).T).T
            place = transform(m, before[:3, 3]) - transform(rotation, m[:3, 3])
            return rigid(rotation, place).tolist()

        discrete = [motion(matrix) for matrix in self.discrete]
        continuous = [
            {"axis": (*transform(turn, c.axis).tolist(),), "offset": (*transform(m, c.offset).tolist(),)}
            for c in self.continuous
        ]
        return Symmetries.model_validate({"discrete": discrete, "continuous": continuous})
