"""In the cells of a grid around the first, the nearest cells first, all facing -Y."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product

from viewsphere.model.camera import Camera
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Matrix4
from viewsphere.sampling.placing import Draws, Room, Shape, checked, standing


def place(
    cast: Sequence[ModelSpec], room: Room, shapes: Sequence[Shape], views: Sequence[Camera], rng: Draws
) -> Sequence[Matrix4]:
    """Poses with the middle of each box in the middle of a cell, the room's gap between cells.

    All cells are as wide and as long as the largest boxes. Raises RecipeError where the grid leaves the free floor.
    """
    wide, long = (max(float(shape.box[4, k] - shape.box[2, k]) for shape in shapes) + room.gap for k in (0, 1))
    middles = [((shape.box[2, :2] + shape.box[4, :2]) / 2).tolist() for shape in shapes]
    poses = [standing(shapes[0].box)]
    for (column, line), shape, (x, y) in zip(_cells(len(cast))[1:], shapes[1:], middles[1:], strict=True):
        poses.append(standing(shape.box, middles[0][0] + column * wide - x, middles[0][1] + line * long - y))
    return checked(cast, room, shapes, poses)


def _cells(count: int) -> list[tuple[int, int]]:
    """Columns and lines of so many cells, from the middle outwards; of those equally far, the front and the left come first."""
    reach = math.isqrt(count) + 1
    side = range(-reach, reach + 1)
    return sorted(product(side, side), key=lambda cell: (cell[0] ** 2 + cell[1] ** 2, cell[1], cell[0]))[:count]
