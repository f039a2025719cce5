"""A recipe becomes samples in memory, without a disk."""

from __future__ import annotations

from collections.abc import Iterator

from viewsphere.geometry.box import box_vertices
from viewsphere.model.recipe import Recipe
from viewsphere.model.sample import Sample
from viewsphere.run.stages import Stages
from viewsphere.sampling.plan import check_images, plan


def render(recipe: Recipe) -> Iterator[Sample]:
    """Render a recipe's frames one after another in the calling process; nothing is written.

    Raises UserError for the user's mistakes, as soon as they are met.
    """
    planned = plan(recipe)
    check_images(planned)
    stages, last = Stages(), None
    for shot in planned.shots():
        spec = shot.placements[0].model
        if spec is not last:
            problem = planned.distance_problem(spec, box_vertices(*stages.model(spec).bounds))
            with recipe.located():
                if problem:
                    raise problem
        last = spec
        yield from stages.render(shot)
