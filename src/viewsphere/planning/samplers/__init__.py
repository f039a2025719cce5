"""Samplers: which shots a recipe means, and what is in each.

A sampler is one module with a `SamplerSpec`; none imports another. Samplers make their shots from a `SamplingContext`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

from viewsphere.composing.viewpoints.poses import Poses
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.scene import Vector
from viewsphere.model.thing import Thing
from viewsphere.planning.samplers.shared.sampling_context import SamplingContext, lens
from viewsphere.recipe.recipe import Recipe
from viewsphere.recipe.world.scenes import SamplerEntry
from viewsphere.validation.errors import read_options

__all__ = ["SamplingContext", "Standing", "lens", "options_of"]

Options = TypeVar("Options", bound=Frozen)


@dataclass(frozen=True, eq=False)
class Standing:
    """The objects in place, without scenery, while a subject is taken from some poses (their numbers in `views`).
    Cameras look at `target`, None: the first object's centre.
    """

    things: tuple[Thing, ...]
    target: Vector | None
    views: Poses
    poses: Sequence[int]


def options_of(recipe: Recipe, kind: type[Options]) -> Options:
    """A recipe's options of its sampler, as the sampler's class of them reads them."""
    given = recipe.scenes.options if isinstance(recipe.scenes, SamplerEntry) else {}
    return read_options(kind, given, "scenes")
