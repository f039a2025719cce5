"""Placers: where models that share a frame stand. One module a placer, named as its file; no placer imports another.

What a placer needs stands here: what it is asked (`Room`, `Shape`, `Draws`), and geometry on the floor (`Footprint`,
`standing`, `checked`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from viewsphere.model.camera import Camera
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Matrix4
from viewsphere.sampling.placing._footprint import Footprint, footprint, standing
from viewsphere.sampling.placing._room import Room, Spot, checked
from viewsphere.sampling.placing._shape import Shape

__all__ = ["Draws", "Footprint", "Placer", "Room", "Shape", "Spot", "checked", "footprint", "standing"]


class Draws(Protocol):
    """Makes the generator of what is drawn for these names, such as a slot and a model's key. Equal names, equal draws: a
    placer that names what it draws for moves nothing else when a model joins the recipe.
    """

    def __call__(self, *names: str) -> np.random.Generator:
        """The generator."""
        ...


class Placer(Protocol):
    """A module that places things."""

    def place(
        self, cast: Sequence[ModelSpec], room: Room, shapes: Sequence[Shape], views: Sequence[Camera], rng: Draws
    ) -> Sequence[Matrix4]:
        """World from object for each member of the cast, metres, rigid; `shapes[i]` is that of `cast[i]`.

        Things stand on the floor z = 0, clear of what stands there before (`room.taken`). `views` are the cameras, as far as
        they are known before anything is placed: none where cameras look at the middle of what is placed. All randomness comes
        from `rng`. Raises RecipeError where the cast does not fit, which names the field `room.field` or `room.field`.layout.
        """
        ...
