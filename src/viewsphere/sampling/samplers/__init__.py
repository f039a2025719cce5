"""Samplers: which shots a recipe means, and what is in each. One module a sampler, named as its file; none imports another.

What a sampler makes shots of (`Stock`) stands here.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Vector
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Thing
from viewsphere.recipe.recipe import Recipe
from viewsphere.sampling.composition import BoxOf
from viewsphere.sampling.samplers._stock import Stock, lens
from viewsphere.sampling.viewpoints import Poses
from viewsphere.store import Block

__all__ = ["Sampler", "Standing", "Stock", "lens"]


@dataclass(frozen=True, eq=False)
class Standing:
    """What stands there, objects alone, while a subject is taken from some poses (their numbers in `views`); cameras look at
    `target`, None: the first object's centre.
    """

    things: tuple[Thing, ...]
    target: Vector | None
    views: Poses
    poses: Sequence[int]


class Sampler(Protocol):
    """A module that says which shots a recipe means, and makes them. All its randomness follows from the recipe's seed and
    from names (`viewsphere.sampling.seeds`). `OF_ANY_SIZE = True`: its shots may have lenses of several sizes.
    """

    def subjects(self, recipe: Recipe, specs: Sequence[ModelSpec]) -> tuple[str, ...]:
        """What the frames are about: stable names, each once, fit for folders. They begin the keys of shots.

        Raises RecipeError for a recipe that the sampler cannot serve.
        """
        ...

    def factors(self, stock: Stock) -> str:
        """What the frames are the product of, in words."""
        ...

    def blocks(self, stock: Stock) -> tuple[Block, ...]:
        """The poses (numbers in `stock.pose_list`) that each subject is taken from, in the order of the frames."""
        ...

    def most_objects(self, recipe: Recipe) -> int:
        """Most of the recipe's models in one frame."""
        ...

    def cast(self, stock: Stock, subject: str, pose: int | None) -> tuple[ModelSpec, ...]:
        """The recipe's models in a frame; without a pose, those that are in all frames of the subject."""
        ...

    def split(self, stock: Stock, subject: str, pose: int) -> str:
        """The split of a frame."""
        ...

    def standing(self, stock: Stock, subject: str, box_of: BoxOf) -> Iterator[Standing]:
        """What can be known before a frame is rendered of where a subject's objects stand: all poses once, unless what stands
        there is drawn for each. Raises RecipeError where there is no room.
        """
        ...

    def shot(self, stock: Stock, subject: str, poses: Sequence[int], box_of: BoxOf, key: str, first: int) -> Shot:
        """A shot of a subject from some poses (of one time step where something moves; of one where the recipe draws its scenes
        for each frame). `first` is the number of its first sample. Raises RecipeError where there is no room.
        """
        ...
