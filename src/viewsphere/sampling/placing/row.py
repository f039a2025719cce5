"""Side by side along X, right and left of the first in turn, all facing -Y."""

from __future__ import annotations

from collections.abc import Sequence

from viewsphere.model.camera import Camera
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Matrix4
from viewsphere.sampling.placing import Draws, Room, Shape, checked, standing


def place(
    cast: Sequence[ModelSpec], room: Room, shapes: Sequence[Shape], views: Sequence[Camera], rng: Draws
) -> Sequence[Matrix4]:
    """Poses, the room's gap between neighbours' boxes; raises RecipeError where the row leaves the free floor."""
    first, *others = (shape.box for shape in shapes)
    poses = [standing(first)]
    left, right = float(first[2, 0]), float(first[4, 0])
    for i, box in enumerate(others):
        low, high = float(box[2, 0]), float(box[4, 0])
        if i % 2 == 0:
            poses.append(standing(box, right + room.gap - low))
            right += room.gap + high - low
        else:
            poses.append(standing(box, left - room.gap - high))
            left -= room.gap + high - low
    return checked(cast, room, shapes, poses)
