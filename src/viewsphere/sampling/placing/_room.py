"""What there is room in, and whether what was placed keeps to it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from viewsphere.errors import RecipeError
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Matrix4
from viewsphere.sampling.placing._footprint import Footprint, footprint
from viewsphere.sampling.placing._shape import Shape

Spot = tuple[float, float, float]
"""(x, y) on the floor, metres, and the azimuth that a front faces there, degrees."""


@dataclass(frozen=True, eq=False)
class Room:
    """What there is room in: the floor that is free (None: all of it), the metres that stay free between any two things, at
    least, and the spots that the recipe names.
    """

    free: Footprint | None = None
    gap: float = 0.0
    spots: tuple[Spot, ...] = ()


def checked(cast: Sequence[ModelSpec], room: Room, shapes: Sequence[Shape], poses: Sequence[Matrix4]) -> Sequence[Matrix4]:
    """The same poses, of things that stand upright on the floor.

    Raises RecipeError where two are nearer than the room's gap, by their boxes, or where one but the first is beyond the free
    floor.
    """
    prints = [footprint(shape.box, pose) for shape, pose in zip(shapes, poses, strict=True)]
    for i, own in enumerate(prints):
        for j in range(i):
            if not own.apart(prints[j], room.gap):
                raise RecipeError(
                    f"scene.company.layout: expected {room.gap:g} m between all models; found {cast[j].key} and "
                    f"{cast[i].key} nearer or in one another: move them, or use layout: scatter"
                )
        if i and room.free and not room.free.contains(own):
            raise RecipeError(
                f"scene.company.layout: expected all models in the free part of the place; found {cast[i].key} beyond it"
            )
    return poses
