"""Close by, turned at random: one after another, uniform in a circle that grows until there is room."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from viewsphere.errors import RecipeError
from viewsphere.model.camera import Camera
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Matrix4
from viewsphere.sampling.placing import Draws, Footprint, Room, Shape, footprint, standing

TRIES = 2000
"""Spots that are tried for one model; the circle they lie in grows with each."""

GROWTH = 0.01


def place(
    cast: Sequence[ModelSpec], room: Room, shapes: Sequence[Shape], views: Sequence[Camera], rng: Draws
) -> Sequence[Matrix4]:
    """Poses, no two boxes nearer than the room's gap; raises RecipeError where no spot is found for one.

    Each member's draws are for its slot and its key.
    """
    poses: list[Matrix4] = []
    prints = list(room.prints)
    for slot, (spec, shape) in enumerate(zip(cast, shapes, strict=True)):
        pose = _pose(rng(str(slot), spec.key), room, shape, prints)
        if pose is None:
            raise RecipeError(
                f"{room.field}: expected room for {len(prints) + len(cast) - slot} models; found none for {spec.key}: ask for "
                "fewer, or for a smaller gap"
            )
        poses.append(pose)
        prints.append(footprint(shape.box, pose))
    return poses


def _pose(rng: np.random.Generator, room: Room, shape: Shape, others: Sequence[Footprint]) -> Matrix4 | None:
    """A pose clear of the others, on the free floor; None where none is found."""
    box, free = shape.box, room.free
    radius = float(others[0].half.min() + (box[4] - box[2])[:2].min() / 2) + room.gap if others else 0.0  # none is nearer
    widest = math.inf if free is None else float(np.linalg.norm(free.corners, axis=1).max())
    for _ in range(TRIES):
        turn, far, azimuth = rng.random(3)
        x, y = (radius * math.sqrt(far) * f(2 * math.pi * turn) for f in (math.cos, math.sin))
        pose = standing(box, x, y, 360.0 * float(azimuth))
        own = footprint(box, pose)
        if (free is None or free.contains(own)) and all(own.apart(other, room.gap) for other in others):
            return pose
        radius = min((1 + GROWTH) * radius, widest)
    return None
