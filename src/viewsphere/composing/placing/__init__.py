"""Placers: where models that share a frame stand. A placer is one module with a `PlacerSpec`; none imports another.

What a placer needs stands here: what it is asked (`Room`, `Shape`, `Draws`), and geometry on the floor (`Footprint`,
`standing`, `checked`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from viewsphere.composing.placing.shared.footprint import Footprint, Outline, footprint, outline, standing
from viewsphere.composing.placing.shared.obstacles import Obstacles, obstacles
from viewsphere.composing.placing.shared.room import Memory, Room, Spot, checked, forgetful
from viewsphere.composing.placing.shared.shape import Shape
from viewsphere.composing.placing.shared.way import Way
from viewsphere.model.scene import Matrix4
from viewsphere.recipe.draws import RngOf

__all__ = [
    "Draws",
    "Footprint",
    "Memory",
    "Obstacles",
    "Outline",
    "Piece",
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
    """The generators for the distributions among a placer's options, for these names, such as a slot and a model's key."""
    return lambda path: rng("option", ".".join(path), *names)


@dataclass(frozen=True)
class Piece:
    """A piece of scenery that a placer needs: the source of a model that is built to a size, (width, height, length) in
    metres, and where it stands.
    """

    source: str
    size: tuple[float, float, float]
    world_from_piece: Matrix4
