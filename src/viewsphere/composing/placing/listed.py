"""Each at the spot that the recipe lists for it."""

from __future__ import annotations

from collections.abc import Sequence

from viewsphere.composing.placing import Draws, Room, Shape, checked, standing
from viewsphere.errors import RecipeError
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Matrix4
from viewsphere.model.sensors.camera import Camera
from viewsphere.plugins.placer import PlacerSpec


def _place(
    cast: Sequence[ModelSpec], room: Room, shapes: Sequence[Shape], views: Sequence[Camera], rng: Draws
) -> Sequence[Matrix4]:
    """Poses at the room's spots, one for each of the cast.

    Raises RecipeError for another number of spots, and if things would overlap or be beyond the free floor.
    """
    if len(room.spots) != len(cast):
        raise RecipeError(f"{room.field}.layout: expected a list of {len(cast)} spots [x, y, azimuth]; found {len(room.spots)}")
    poses = [standing(shape.box, *spot) for shape, spot in zip(shapes, room.spots, strict=True)]
    return checked(cast, room, shapes, poses)


PLACER = PlacerSpec(place=_place)
