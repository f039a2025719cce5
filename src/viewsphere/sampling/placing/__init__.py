"""Placers: where models that share a frame stand. One module a placer, named as its file; no placer imports another.

What a placer needs stands here: what it is asked (`Room`, `Shape`, `Draws`), and geometry on the floor (`Footprint`,
`standing`, `checked`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from viewsphere.model.camera import Camera
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Matrix4
from viewsphere.recipe.draws import RngOf
from viewsphere.sampling.placing._footprint import Footprint, Outline, footprint, outline, standing
from viewsphere.sampling.placing._obstacles import Obstacles, obstacles
from viewsphere.sampling.placing._room import Memory, Room, Spot, checked, forgetful
from viewsphere.sampling.placing._shape import Shape
from viewsphere.sampling.placing._way import Way

__all__ = [
    "Draws",
    "Footprint",
    "Memory",
    "Obstacles",
    "Outline",
    "Piece",
    "Placer",
    "Room",
    "Shape",
    "Spot",
    "Way",
    "checked",
    "draws_of",
    "footprint",
    "forgetful",
    "obstacles",
    "outline",
    "standing",
]


class Draws(Protocol):
    """Makes the generator of what is drawn for these names, such as a slot and a model's key. Equal names, equal draws: a
    placer that names what it draws for moves nothing else when a model joins the recipe.
    """

    def __call__(self, *names: str) -> np.random.Generator:
        """The generator."""
        ...


def draws_of(rng: Draws, *names: str) -> RngOf:
    """What the distributions among a placer's options are drawn with, for these names, such as a slot and a model's key."""
    return lambda path: rng("option", ".".join(path), *names)


@dataclass(frozen=True)
class Piece:
    """A piece of scenery that a placer needs: a member of a zoo family that is built to a size, (width, height, length) in
    metres, and where it stands.
    """

    family: str
    size: tuple[float, float, float]
    world_from_piece: Matrix4


class Placer(Protocol):
    """A module that places things. One with options has a class of them, `Options`, whose fields may be distributions; its
    functions are given one, nothing of it drawn, as their last argument.

    `around(cast, room, shapes, rng[, options])`, if there, gives the pieces of scenery that things stand in.
    `ways(cast, room, shapes, rng[, options])`, if there, gives the `Way` of each to its place.
    `IS_SLOW = True`: where things stand is not asked before frames are rendered.
    `NEEDS`, if there, names the packages of the extra `physics` without which it cannot place.
    """

    def place(
        self, cast: Sequence[ModelSpec], room: Room, shapes: Sequence[Shape], views: Sequence[Camera], rng: Draws, *options: Any
    ) -> Sequence[Matrix4]:
        """World from object for each member of the cast, metres, rigid; `shapes[i]` is that of `cast[i]`.

        Things stand on the floor z = 0, clear of what stands there before (`room.taken`). `views` are the cameras, as far as
        they are known before anything is placed: none where cameras look at the middle of what is placed. All randomness comes
        from `rng`. Raises RecipeError where the cast does not fit, which names the field `room.field` or `room.field`.layout.
        """
        ...
