"""Redraws of draws that do not fit: the parts of a recipe that they change, and their number.

A frame's redraw changes its viewpoint, jitter and company; a scene's redraw changes its place, its models and where they stand.
Both are keyed by stable names and the number of the redraw, and number 0 is the original draw.
"""

from __future__ import annotations

from viewsphere.composing.layouts import is_slow
from viewsphere.composing.seeds import Names
from viewsphere.limits import limits
from viewsphere.recipe.cameras.viewpoints import Jitter, Normal, Sphere
from viewsphere.recipe.draws import is_random, span
from viewsphere.recipe.recipe import Recipe
from viewsphere.recipe.world.scenes import ScenesEntry

RANDOM = Sphere | Normal | Jitter
"""Kinds of random viewpoints."""

SLOW_SHARE = 8
"""A simulated layout is redrawn this many times less often: each of its redraws already tries ten falls, seconds each."""

SAME_MODELS = 8
"""Redraws of one choice of models: most scenes fit with other places; choosing other models would favour small ones."""


def redraws_frames(recipe: Recipe) -> bool:
    """Return whether a still frame has its own viewpoint, jitter or company that can be drawn again."""
    if recipe.time is not None:
        return False
    company, jitter = recipe.scene.company, recipe.scene.jitter
    if isinstance(recipe.viewpoints, RANDOM) or (company is not None and company.draw == "per_frame"):
        return True
    return jitter.draw == "per_frame" and is_random(jitter)


def _redraws_scenes(recipe: Recipe) -> bool:
    """Return whether the recipe draws where its models stand, or the place around them."""
    scene = recipe.scene
    if recipe.scenes is not None and not isinstance(recipe.scenes, ScenesEntry):
        return False
    is_company_placed = scene.company is not None and not scene.company.spots
    if recipe.scenes is not None or is_company_placed or scene.planes or redraws_place(recipe):
        return True
    return recipe.time is not None and (is_random(recipe.viewpoints) or isinstance(recipe.viewpoints, RANDOM))


def redraws_place(recipe: Recipe) -> bool:
    """Return whether a scene's redraw changes its place. The categories of a labelled place are planned, so it stays."""
    place = recipe.scene.place
    return place is not None and bool(place.prefix) and place.draw != "fixed" and place.labels != "own"


def is_redrawn(recipe: Recipe) -> bool:
    """Return whether cameras that do not fit can be redrawn: early checks leave them to the shot."""
    return redraws_frames(recipe) or _redraws_scenes(recipe)


def scene_draws(recipe: Recipe) -> int:
    """The number of draws of a scene, the original included; after every `_redraws_each` of them it drops one object more."""
    if not _redraws_scenes(recipe):
        return 1
    scenes, company = recipe.scenes, recipe.scene.company
    most = scenes.most_objects if isinstance(scenes, ScenesEntry) else company.number if company is not None else 0
    return _redraws_each(recipe) * (1 + most - least_objects(recipe, most))


def _redraws_each(recipe: Recipe) -> int:
    """Draws of a scene with the same number of objects."""
    scenes, company = recipe.scenes, recipe.scene.company
    layout = scenes.layout if isinstance(scenes, ScenesEntry) else company.layout if company is not None else None
    return max(2, limits.MAX_REDRAWS // SLOW_SHARE) if layout is not None and is_slow(layout) else limits.MAX_REDRAWS


def fewer(recipe: Recipe, redraw: int) -> int:
    """The number of objects that a redraw drops from a scene with more than its least number."""
    return redraw // _redraws_each(recipe) if redraw else 0


def least_objects(recipe: Recipe, objects: int) -> int:
    """The fewest objects that redraws may leave of a scene with this many; listed and balanced scenes keep all."""
    scenes, company = recipe.scenes, recipe.scene.company
    if isinstance(scenes, ScenesEntry):
        return objects if scenes.spots or scenes.balance == "category" else int(span(scenes.objects)[0])
    if company is None or company.count is None or company.spots:
        return objects
    return int(span(company.count)[0])


def redraw_names(redraw: int, each: int = 1) -> Names:
    """The names of a redraw; the original has none. `each`: how many redraws share a draw."""
    number = redraw - redraw % each
    return (f"redraw {number}",) if number else ()
