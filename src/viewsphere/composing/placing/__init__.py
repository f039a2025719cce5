"""Placers: the places of models that share a frame. A placer is one module with a `PlacerSpec`; none imports another.

Placers import from here: their inputs (`Room`, `Shape`, `Draws`), and geometry on the floor (`Footprint`, `standing`,
`checked`).
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from viewsphere.composing.placing.shared.footprint import Footprint, Outline, footprint, outline, standing
from viewsphere.composing.placing.shared.obstacles import Obstacles, obstacles
from viewsphere.composing.placing.shared.room import Memory, Room, Spot, checked, forgetful
from viewsphere.composing.placing.shared.shape import Shape
from viewsphere.geometry.rotation import matrix_from_quaternion, rigid, slerp
from viewsphere.model.scene import Matrix4
from viewsphere.recipe.draws import RngOf

State = tuple[float, ...]
"""x, y, z in metres and a unit quaternion w, x, y, z: world from object."""


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
    """Makes the generator for these names, such as a slot and a model's key. Equal names give equal draws: a placer that names
    each draw moves no other model when a model joins the recipe.
    """

    def __call__(self, *names: str) -> np.random.Generator:
        """The generator."""
        ...


def draws_of(rng: Draws, *names: str) -> RngOf:
    """The generators for the distributions among a placer's options, for these names, such as a slot and a model's key."""
    return lambda path: rng("option", ".".join(path), *names)


@dataclass(frozen=True)
class Piece:
    """A piece of scenery that a placer needs: the source of a model that is built to a size, (width, height, length) in metres,
    and its pose.
    """

    source: str
    size: tuple[float, float, float]
    world_from_piece: Matrix4


@dataclass(frozen=True)
class Way:
    """The states of a thing at ascending times, seconds from the first; it stays in the last one."""

    seconds: tuple[float, ...]
    states: tuple[State, ...]

    def pose_at(self, seconds: float) -> Matrix4:
        """World from object at a time, interpolated linearly between states."""
        after = min(max(bisect_right(self.seconds, seconds), 1), len(self.states) - 1)
        a, b = np.array(self.states[after - 1]), np.array(self.states[after])
        begin, stop = self.seconds[after - 1], self.seconds[after]
        share = min(max((seconds - begin) / (stop - begin), 0.0), 1.0)
        matrix = rigid(matrix_from_quaternion(slerp(a[3:], b[3:], share)), a[:3] + share * (b[:3] - a[:3]))
        return tuple(map(tuple, matrix.tolist()))  # type: ignore[return-value]
