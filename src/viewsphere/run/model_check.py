"""A plan's models, read before anything is rendered: what cannot be used, and which cameras would stand inside of them."""

from __future__ import annotations

from viewsphere.errors import each
from viewsphere.planning.distances import Distances
from viewsphere.planning.plan import Plan
from viewsphere.run.progress import Listener, Progress, unheard
from viewsphere.run.shots.stages import Stages


def check_models(planned: Plan, tell: Listener = unheard) -> tuple[str, ...]:
    """Read each model of a plan, place it and its cameras; returns the warnings, `<key>: <warning>`.

    Raises ModelError or RecipeError, a line each, for all files that cannot be used, and for all models and scenes without
    room or with a camera inside.
    """
    stages, specs = Stages(), planned.kept_specs
    distances = Distances(planned, stages.box)

    def warnings(number: int) -> list[str]:
        mesh = stages.model(specs[number])
        tell(Progress("models", number + 1, len(specs)))
        return [f"{specs[number].key}: {warning}" for warning in mesh.warnings]

    def stand(subject: str) -> None:
        problem = distances.problem(subject)
        if problem:
            raise problem

    found = each(warnings, range(len(specs)))
    with planned.recipe.located():
        each(stand, planned.subjects)
    return tuple(dict.fromkeys(line for lines in found for line in lines))
