"""Samplers: the shots of a recipe, and their content.

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
    """The placed objects, without scenery, for some poses of a subject (their numbers in `views`). Cameras look at `target`;
    None: the first object's centre.
    """

    things: tuple[Thing, ...]
    target: Vector | None
    views: Poses
    poses: Sequence[int]


def options_of(recipe: Recipe, kind: type[Options]) -> Options:
    """The options of a recipe's sampler, read by the sampler's class of options."""
    given = recipe.scenes.options if isinstance(recipe.scenes, SamplerEntry) else {}
    return read_options(kind, given, "scenes")
