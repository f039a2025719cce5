"""A recipe becomes samples in memory, without a disk."""

from __future__ import annotations

from collections.abc import Iterator

from viewsphere.model.sample import Sample
from viewsphere.recipe.recipe import Recipe
from viewsphere.run.opening import prepare
from viewsphere.run.stages import Stages


def render(recipe: Recipe) -> Iterator[Sample]:
    """Render a recipe's frames one after another in the calling process; nothing is written.

    Raises UserError for the user's mistakes, as soon as they are met.
    """
    planned = prepare(recipe)
    stages = Stages()
    for subject in planned.subjects:
        stages.read_ahead(planned, planned.cast(subject))
        stages.check_distances(planned, subject)
        for row in planned.rows.of(subject):
            yield from stages.render(planned.shot(row, stages.box))
