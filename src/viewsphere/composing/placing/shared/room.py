"""The free space for objects, and checks that placed objects stay in it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from viewsphere.composing.placing.shared.crowd import Crowd
from viewsphere.composing.placing.shared.footprint import Footprint, Outline, first_crowded, footprint
from viewsphere.composing.placing.shared.obstacles import Obstacles
from viewsphere.composing.placing.shared.shape import Shape
from viewsphere.errors import RecipeError
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.place import Bay, Lane
from viewsphere.model.scene import Matrix4

Spot = tuple[float, float, float]
"""(x, y) on the floor, metres, and the azimuth that a front faces there, degrees."""


Memory = Callable[[Callable[[], Any]], Any]
"""Returns the plain data that the function makes, or the result stored at its first call on any machine."""


def forgetful(make: Callable[[], Any]) -> Any:
    """Return the function's result, computed on each call."""
    return make()


@dataclass(frozen=True, eq=False)
class Room:
    """The free space for objects.

    `free`: the free floor, None for the whole floor.
    `gap`: smallest distance between any two things, metres.
    `spots`: the spots that the recipe names.
    `field`: the recipe's field for the room, with which messages begin.
    `taken`: things already in place (the model that company joins, at the origin, facing -Y).
    `below`: metres from z = 0, where things stand, down to the floor, if they stand on a surface above it.
    `clearance`: metres of air above, None for no limit.
    `seen_from`: azimuth and elevation of the camera, degrees, None if unknown.
    `memory`: keeps simulated results.
    `moves`: whether the paths of things to their places are needed, too.
    `built` returns the parts of the place's mesh up to a height above the floor, within a layout's reach, metres.
    `blocked` holds these parts for the placed things.
    `lanes`, `bays` and `pavements` are the place's.
    `furniture` returns the objects on and next to them, for a place of the zoo.
    """

    free: Footprint | None = None
    gap: float = 0.0
    spots: tuple[Spot, ...] = ()
    taken: tuple[tuple[Shape, Matrix4], ...] = ()
    field: str = "scene.company"
    below: float = 0.0
    clearance: float | None = None
    seen_from: tuple[float, float] | None = None
    memory: Memory = forgetful
    moves: bool = False
    built: Callable[[float, float], Obstacles | None] | None = None
    blocked: Obstacles | None = None
    lanes: tuple[Lane, ...] = ()
    bays: tuple[Bay, ...] = ()
    pavements: tuple[Lane, ...] = ()
    furniture: Callable[[float, float], Obstacles | None] | None = None

    def obstacles(self, shapes: Sequence[Shape], reach: float) -> Room:
        """The same room with `blocked`: the parts of its place that are in the way of things of these shapes, up to `reach`
        metres from the middle.
        """
        if self.built is None or not shapes:
            return self
        highest = max(float(np.ptp(shape.box[:, 2])) for shape in shapes)
        return replace(self, blocked=self.built(highest, reach))

    def is_clear(self, own: Footprint | Outline, others: Crowd) -> bool:
        """Return whether a cover of the floor is clear of others and of the place by the gap."""
        if not others.is_clear(own, self.gap):
            return False
        return self.blocked is None or not self.blocked.meets(own.corners, self.gap)

    @property
    def prints(self) -> tuple[Footprint, ...]:
        """The footprints of the things already in place."""
        return tuple(footprint(shape.box, pose) for shape, pose in self.taken)


def checked(cast: Sequence[ModelSpec], room: Room, shapes: Sequence[Shape], poses: Sequence[Matrix4]) -> Sequence[Matrix4]:
    """The same poses, checked, for things that stand upright on the floor.

    Raises RecipeError if two things, by their boxes, are nearer than the room's gap, or nearer to a thing already in place, or
    if one is beyond the free floor.
    """
    names = ["the model that it joins"] * len(room.taken) + [spec.key for spec in cast]
    prints = [*room.prints, *(footprint(shape.box, pose) for shape, pose in zip(shapes, poses, strict=True))]
    crowded = first_crowded(prints, room.gap, len(room.taken))
    beyond = next((i for i in range(len(room.taken), len(prints)) if room.free and not room.free.contains(prints[i])), None)
    if crowded is not None and (beyond is None or crowded[0] <= beyond):
        i, j = crowded
        raise RecipeError(
            f"{room.field}.layout: expected {room.gap:g} m between all models; found {names[i]} and {names[j]} "
            "nearer or in one another: move them, or use layout: scatter"
        )
    if beyond is not None:
        raise RecipeError(
            f"{room.field}.layout: expected all models in the free part of the place; found {names[beyond]} beyond it"
        )
    return poses
