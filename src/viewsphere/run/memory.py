"""A recipe becomes samples in memory, without a disk."""

from __future__ import annotations

from collections.abc import Iterator

from viewsphere.model.recipe import Recipe
from viewsphere.model.sample import Sample
from viewsphere.run.stages import Stages, prepare


def render(recipe: Recipe) -> Iterator[Sample]:
    """Render a recipe's frames one after another in the calling process; nothing is written.

    Raises UserError for the user's mistakes, as soon as they are met.
    """
    planned = prepare(recipe)
    stages, last = Stages(), None
    for shot in planned.shots(stages.box):
        spec = shot.placements[0].model
        if spec is not last:
            stages.check_distances(planned, spec)
        last = spec
        yield from stages.render(shot)
