"""Random scenes of models, as several samplers make them: which models, of which split, and where they stand.

Scene k follows from the seed, its name and the models alone: it is the same however many scenes there are.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from functools import partial

import numpy as np

from viewsphere.errors import RecipeError
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.thing import Thing
from viewsphere.recipe.draws import drawn
from viewsphere.recipe.recipe import Recipe
from viewsphere.recipe.scenes import ScenesEntry
from viewsphere.sampling.cast import mixed
from viewsphere.sampling.composition import BoxOf, placed, still
from viewsphere.sampling.placing import Room
from viewsphere.sampling.samplers._stock import Stock
from viewsphere.sampling.seeds import generator, share
from viewsphere.sampling.splits import drawn_split, shared
from viewsphere.sampling.viewpoints import Poses


def scenes_entry(recipe: Recipe) -> ScenesEntry:
    """The recipe's random scenes."""
    assert isinstance(recipe.scenes, ScenesEntry)
    return recipe.scenes


def scene_names(recipe: Recipe) -> tuple[str, ...]:
    """The scenes' names; raises RecipeError where they have company, or are more than the frames that are wanted at most."""
    count = scenes_entry(recipe).count
    if recipe.scene.company is not None:
        raise RecipeError("scene.company: expected none beside scenes, which have several models each; found one: leave it out")
    if count > recipe.max_frames:
        raise RecipeError(
            f"scenes.count: expected at most {recipe.max_frames:,} frames; found {count:,} scenes: set max_frames: {count} in "
            "the recipe if that is meant"
        )
    return tuple(f"scene-{number:06d}" for number in range(count))


def scene_cast(stock: Stock, subject: str) -> tuple[ModelSpec, ...]:
    """The models of a scene, of one split where splits are by model."""
    recipe, entry = stock.recipe, scenes_entry(stock.recipe)
    count = drawn(entry.objects, lambda path: generator(recipe.seed, *path, subject), ("scenes", "objects"))
    models = stock.model_specs
    if recipe.splits.by == "model":
        own = scene_split(stock, subject)
        models = tuple(spec for spec in models if stock.dealt_splits[spec.key] == own)
    return mixed(recipe.seed, models, count, (subject,), entry.repeat)


def scene_split(stock: Stock, subject: str) -> str:
    """The split of a scene where splits are by model: it draws its split first, then models of this split; shares follow from
    the numbers of models where some of these are listed.
    """
    return drawn_split(_shares(stock), stock.recipe.seed, (subject,))


def scene_things(stock: Stock, subject: str, pose: str | None, box_of: BoxOf) -> tuple[Thing, ...]:
    """The models of a scene where they stand; raises RecipeError where there is no room."""
    entry, models = scenes_entry(stock.recipe), scene_cast(stock, subject)
    free = None if stock.composition is None else stock.composition.free_floor(subject, pose)
    room = Room(free, entry.gap, entry.spots, field="scenes")
    return still(models, placed(entry.placer, models, room, box_of, partial(generator, stock.recipe.seed, "layout", subject)))


def scene_views(stock: Stock, subject: str, views: Poses) -> Sequence[int]:
    """Numbers of the poses that a scene is taken from, ascending: where they are drawn, those of the lowest hashes."""
    count = scenes_entry(stock.recipe).views
    if count is None or count >= len(views):
        return range(len(views))
    order = sorted(range(len(views)), key=lambda i: share(stock.recipe.seed, "scene's views", subject, views.name(i)))
    return np.sort(np.array(order[:count], np.int64)).tolist()


def check_scene_models(stock: Stock) -> None:
    """Raise RecipeError where a scene may ask for more models than there are, of one split where splits are by model."""
    entry = scenes_entry(stock.recipe)
    groups, names = {"": stock.models}, [""]
    if stock.recipe.splits.by == "model":
        groups, names = Counter(stock.dealt_splits.values()), list(_shares(stock))
    for name in names:
        if groups[name] < (1 if entry.repeat else entry.most_objects):
            of = f" of split {name!r}" if name else ""
            raise RecipeError(
                f"scenes.objects: expected at most {groups[name]}, as there are {groups[name]} models{of}; found "
                f"{entry.most_objects}: add models, ask for fewer, or set scenes.repeat: true"
            )


def _shares(stock: Stock) -> dict[str, float]:
    """The share of the scenes that each split has, where splits are by model."""
    splits = stock.recipe.splits
    if not any(isinstance(part, tuple) for part in splits.shares.values()):
        return shared(splits)
    return {name: count / stock.models for name, count in sorted(Counter(stock.dealt_splits.values()).items())}
