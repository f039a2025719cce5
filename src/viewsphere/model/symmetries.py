"""Which rigid motions leave a model as it is."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated

import numpy as np
from pydantic import AfterValidator

from viewsphere.geometry.rotation import Float, compose, rigid, rotation_about
from viewsphere.model.frozen import Frozen
from viewsphere.model.mistakes import shown
from viewsphere.model.scene import IDENTITY, Matrix4, Vector

RIGID = 1e-4
"""How far scalar products of a motion's rows may be from 0 and 1, and the length of an axis from 1."""


def _motion(matrix: Matrix4) -> Matrix4:
    rotation = np.array(matrix)[:3, :3]
    if matrix[3] != IDENTITY[3] or np.abs(rotation @ rotation.T - np.eye(3)).max() > RIGID or np.linalg.det(rotation) < 0:
        raise ValueError("expected a rotation and a translation, 4 rows of 4 numbers whose last is [0, 0, 0, 1]; found others")
    if np.abs(np.array(matrix) - np.eye(4)).max() <= RIGID:
        raise ValueError("expected a motion; found the identity, which is a symmetry of every model")
    return matrix


def _unit(axis: Vector) -> Vector:
    length = math.sqrt(sum(value * value for value in axis))
    if abs(length - 1) > RIGID:
        raise ValueError(f"expected a vector of length 1; found {shown(axis)}, of length {length:.6g}")
    return axis


class Continuous(Frozen):
    """A model stays as it is, turned by any angle around the line through `offset` along the unit vector `axis`."""

    axis: Annotated[Vector, AfterValidator(_unit)]
    offset: Vector = (0.0, 0.0, 0.0)

    def turned(self, angle: float) -> Float:
        """The motion (4, 4) by an angle in radians, counterclockwise seen from the axis's tip."""
        rotation = rotation_about(np.array(self.axis) * angle)
        return rigid(rotation, np.array(self.offset) - (rotation * np.array(self.offset)).sum(axis=1))


class Symmetries(Frozen):
    """Motions of a model's own axes, in metres, after which its surface is where it was, as BOP's `models_info` has them.

    `discrete` are rigid (4, 4), without the identity; `continuous` any turn around an axis. All symmetries are the products of
    a discrete one, or the identity, and a turn around one of the continuous axes, or none. A ball has three continuous axes,
    which stand for all rotations. Mirror images are no motions.
    """

    discrete: tuple[Annotated[Matrix4, AfterValidator(_motion)], ...] = ()
    continuous: tuple[Continuous, ...] = ()

    def motions(self, steps: int) -> Iterator[Float]:
        """All symmetries (4, 4), the identity first, with `steps` turns around each continuous axis."""
        turns = [axis.turned(2 * math.pi * i / steps) for axis in self.continuous for i in range(1, steps)]
        for discrete in (IDENTITY, *self.discrete):
            yield np.array(discrete)
            yield from (compose(turn, discrete) for turn in turns)
