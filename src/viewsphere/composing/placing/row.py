"""Side by side along X, alternately right and left of a thing already in place or of the first one, all facing -Y."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from viewsphere.composing.placing import Draws, Room, Shape, checked, standing
from viewsphere.geometry.rotation import transform
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Matrix4
from viewsphere.model.sensors.camera import Camera
from viewsphere.plugins.placer import PlacerSpec


def _place(
    cast: Sequence[ModelSpec], room: Room, shapes: Sequence[Shape], views: Sequence[Camera], rng: Draws
) -> Sequence[Matrix4]:
    """Poses, the room's gap between neighbours' boxes; raises RecipeError if the row leaves the free floor."""
    poses: list[Matrix4] = []
    edges = [float(x) for shape, pose in room.taken for x in transform(np.array(pose), shape.box)[:, 0]]
    left, right = (min(edges), max(edges)) if edges else (math.inf, -math.inf)
    for i, shape in enumerate(shapes, len(room.taken)):
        low, high = float(shape.box[2, 0]), float(shape.box[4, 0])
        if i == 0:
            left, right = low, high
            poses.append(standing(shape.box))
        elif i % 2 == 1:
            poses.append(standing(shape.box, right + room.gap - low))
            right += room.gap + high - low
        else:
            poses.append(standing(shape.box, left - room.gap - high))
            left -= room.gap + high - low
    return checked(cast, room, shapes, poses)


PLACER = PlacerSpec(place=_place)
