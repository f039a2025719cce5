"""In the cells of a grid around things already in place or around the origin, the nearest cells first, all facing -Y."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product

from viewsphere.composing.placing import Draws, Room, Shape, checked, footprint, standing
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Matrix4
from viewsphere.model.sensors.camera import Camera
from viewsphere.plugins.placer import PlacerSpec


def _place(
    cast: Sequence[ModelSpec], room: Room, shapes: Sequence[Shape], views: Sequence[Camera], rng: Draws
) -> Sequence[Matrix4]:
    """Poses with the middle of each box in the middle of a cell, the room's gap between cells; a thing already in place has the
    first cell.

    All cells are as wide and as long as the largest boxes. Raises RecipeError if the grid exceeds the free floor.
    """
    whole = [*room.prints, *(footprint(shape.box, standing(shape.box)) for shape in shapes)]
    wide, long = (2 * max(float(own.half[k]) for own in whole) + room.gap for k in (0, 1))
    cells = _cells(len(whole))[len(room.taken) :]
    middle = whole[0].center if room.taken else whole[0].center * 0
    poses: list[Matrix4] = []
    for (column, line), shape, own in zip(cells, shapes, whole[len(room.taken) :], strict=True):
        x, y = middle - own.center + (column * wide, line * long)
        poses.append(standing(shape.box, float(x), float(y)))
    return checked(cast, room, shapes, poses)


def _cells(count: int) -> list[tuple[int, int]]:
    """Columns and rows of this many cells, from the middle outwards; of equally distant cells, front and left come first."""
    reach = math.isqrt(count) + 1
    side = range(-reach, reach + 1)
    return sorted(product(side, side), key=lambda cell: (cell[0] ** 2 + cell[1] ** 2, cell[1], cell[0]))[:count]


PLACER = PlacerSpec(place=_place)
