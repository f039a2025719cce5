"""A recipe becomes samples in memory, without a disk."""

from __future__ import annotations

from collections.abc import Iterator

from viewsphere.model.recipe import Recipe
from viewsphere.model.sample import Sample
from viewsphere.run.stages import Stages
from viewsphere.sampling.plan import plan


def render(recipe: Recipe) -> Iterator[Sample]:
    """Render a recipe's frames one after another in the calling process; nothing is written.

    Raises UserError for the user's mistakes, as soon as they are met.
    """
    stages = Stages()
    for shot in plan(recipe).shots():
        yield from stages.render(shot)
