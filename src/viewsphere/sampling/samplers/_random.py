"""Random scenes of models, as several samplers make them: which models, of which split, and where they stand.

Scene k follows from the seed, its name and the models alone: it is the same however many scenes there are.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from functools import lru_cache, partial

from viewsphere.errors import RecipeError
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.thing import Thing
from viewsphere.recipe.draws import drawn
from viewsphere.recipe.recipe import Recipe
from viewsphere.recipe.scenes import ScenesEntry
from viewsphere.sampling.cast import balanced, mixed
from viewsphere.sampling.composition import BoxOf, placed, still
from viewsphere.sampling.placing import Room
from viewsphere.sampling.samplers._stock import Stock
from viewsphere.sampling.seeds import generator, share, shares
from viewsphere.sampling.splits import drawn_split, shared


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
    models = _models_for(stock, _group(stock, subject))
    if entry.balance == "models":
        return mixed(recipe.seed, models, _size(recipe, subject), (subject,), entry.repeat)
    cast: list[ModelSpec] = []
    for category, count in _categories(stock.untried or stock)[subject]:
        own = tuple(spec for spec in models if spec.category == category)
        cast += mixed(recipe.seed, own, count, (subject,), entry.repeat)
    return tuple(sorted(cast, key=lambda spec: share(recipe.seed, "slot", subject, spec.key)))


def _size(recipe: Recipe, subject: str) -> int:
    """How many models stand in a scene."""
    return drawn(scenes_entry(recipe).objects, lambda path: generator(recipe.seed, *path, subject), ("scenes", "objects"))


def _group(stock: Stock, subject: str) -> str:
    """The split that a scene's models are of, where splits are by model; else the empty name of all."""
    return scene_split(stock, subject) if stock.recipe.splits.by == "model" else ""


def _models_for(stock: Stock, group: str) -> tuple[ModelSpec, ...]:
    """The models that may meet in scenes of a group."""
    return tuple(spec for spec in stock.model_specs if not group or stock.dealt_splits[spec.key] == group)


@lru_cache(maxsize=2)
def _categories(stock: Stock) -> dict[str, tuple[tuple[str, int], ...]]:
    """How many objects of which categories stand in each scene."""
    recipe, repeat = stock.recipe, scenes_entry(stock.recipe).repeat
    groups: defaultdict[str, list[str]] = defaultdict(list)
    for subject in stock.subjects:
        groups[_group(stock, subject)].append(subject)
    found: dict[str, tuple[tuple[str, int], ...]] = {}
    for group, subjects in groups.items():
        there = Counter(spec.category for spec in _models_for(stock, group))
        found |= balanced(recipe.seed, {name: _size(recipe, name) for name in subjects}, there, repeat)
    return found


def scene_split(stock: Stock, subject: str) -> str:
    """The split of a scene where splits are by model: it draws its split first, then models of this split; shares follow from
    the numbers of models where some of these are listed.
    """
    return drawn_split(_shares(stock.untried or stock), stock.recipe.lasting_seed, (subject,))


def scene_things(stock: Stock, subject: str, pose: str | None, box_of: BoxOf) -> tuple[Thing, ...]:
    """The models of a scene where they stand; raises RecipeError where there is no room."""
    entry, models = scenes_entry(stock.recipe), scene_cast(stock, subject)
    free = None if stock.composition is None else stock.composition.free_floor(subject, pose)
    room, rng = Room(free, entry.gap, entry.spots, field="scenes"), partial(generator, stock.recipe.seed, "layout", subject)
    return still(models, placed(entry.placer, models, room, box_of, rng, entry.orientation))


def scene_views(stock: Stock, subject: str) -> Sequence[int]:
    """Numbers of the viewpoints that a scene is taken from, ascending: where they are drawn, those of the lowest hashes."""
    if not are_views_drawn(stock):
        return range(len(stock.views))
    hashed = shares(stock.recipe.seed, "scene's views", subject, each=stock.view_names)
    return sorted(sorted(range(len(hashed)), key=hashed.__getitem__)[: scenes_entry(stock.recipe).views])


def are_views_drawn(stock: Stock) -> bool:
    """Whether scenes are taken from some of the viewpoints each, rather than from all."""
    count = scenes_entry(stock.recipe).views
    return count is not None and count < len(stock.views)


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


@lru_cache(maxsize=2)
def _shares(stock: Stock) -> dict[str, float]:
    """The share of the scenes that each split has, where splits are by model."""
    splits = stock.recipe.splits
    if not any(isinstance(part, tuple) for part in splits.shares.values()):
        return shared(splits)
    return {name: count / stock.models for name, count in sorted(Counter(stock.dealt_splits.values()).items())}
