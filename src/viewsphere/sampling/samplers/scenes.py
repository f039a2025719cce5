"""Random scenes: in each some models are drawn and placed, and the camera goes around the middle of them.

Scene k follows from the seed, its name and the models alone: it is the same however many scenes there are.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from functools import partial
from itertools import groupby

import numpy as np

from viewsphere.errors import RecipeError
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Thing
from viewsphere.recipe.draws import drawn
from viewsphere.recipe.recipe import Recipe
from viewsphere.recipe.scenes import ScenesEntry
from viewsphere.sampling.cast import mixed
from viewsphere.sampling.composition import BoxOf, center_of_all, placed, still
from viewsphere.sampling.placing import Room
from viewsphere.sampling.pose_numbers import as_ranges
from viewsphere.sampling.samplers import Standing, Stock
from viewsphere.sampling.seeds import generator, share
from viewsphere.sampling.splits import drawn_split, shared
from viewsphere.sampling.time_steps import is_animated
from viewsphere.store import Block
from viewsphere.store.index import Ranges, numbers


def subjects(recipe: Recipe, specs: Sequence[ModelSpec]) -> tuple[str, ...]:
    """The scenes' names."""
    count = _entry(recipe).count
    if recipe.scene.company is not None:
        raise RecipeError("scene.company: expected none beside scenes, which have several models each; found one: leave it out")
    if is_animated(recipe):
        raise RecipeError("scenes: expected models and a scene that stand still; found frames of a file: leave frames out")
    if count > recipe.max_frames:
        raise RecipeError(
            f"scenes.count: expected at most {recipe.max_frames:,} frames; found {count:,} scenes: set max_frames: {count} in "
            "the recipe if that is meant"
        )
    return tuple(f"scene-{number:06d}" for number in range(count))


def factors(stock: Stock) -> str:
    """Scenes, and the poses of each."""
    entry = _entry(stock.recipe)
    views = len(stock.pose_list) if entry.views is None else min(entry.views, len(stock.pose_list))
    return f"{len(stock.subjects):,} scenes of {stock.models:,} models x {views:,} poses"


def blocks(stock: Stock) -> tuple[Block, ...]:
    """All poses of every scene, or those that are drawn for each. Raises RecipeError where too few models may meet."""
    _check_models(stock)
    taken = groupby(stock.subjects, partial(_poses, stock))
    return tuple(Block(tuple(names), poses) for poses, names in taken)


def most_objects(recipe: Recipe) -> int:
    """Most models in a scene."""
    return _entry(recipe).most_objects


def cast(stock: Stock, subject: str, pose: int | None) -> tuple[ModelSpec, ...]:
    """The models of a scene, of one split where splits are by model."""
    recipe, entry = stock.recipe, _entry(stock.recipe)
    count = drawn(entry.objects, lambda path: generator(recipe.seed, *path, subject), ("scenes", "objects"))
    models = stock.model_specs
    if recipe.splits.by == "model":
        own = split(stock, subject, 0)
        models = tuple(spec for spec in models if stock.dealt_splits[spec.key] == own)
    return mixed(recipe.seed, models, count, (subject,), entry.repeat)


def split(stock: Stock, subject: str, pose: int) -> str:
    """The scene's, or what its pose, place or name draw. By model, a scene draws its split first, then models of this split;
    shares follow from the numbers of models where some of these are listed.
    """
    splits, seed = stock.recipe.splits, stock.recipe.seed
    if splits.by == "scene":
        return stock.dealt_splits[subject]
    if splits.by != "model":
        return stock.hashed_split(subject, pose)
    return drawn_split(_shares(stock), seed, (subject,))


def standing(stock: Stock, subject: str, box_of: BoxOf) -> Iterator[Standing]:
    """The models of a scene; nothing where the place they stand in is drawn for each frame."""
    if not stock.recipe.scene.is_moved_each_frame:
        things = _placed(stock, subject, None, box_of)
        views, poses = stock.pose_list.drawn_for(subject), tuple(numbers(_poses(stock, subject)))
        yield Standing(things, center_of_all(things, box_of), views, poses)


def shot(stock: Stock, subject: str, poses: Sequence[int], box_of: BoxOf, key: str, first: int) -> Shot:
    """The models of a scene, and what stands around them; cameras look at the middle of the models."""
    pose = stock.scene_pose(poses[0])
    things = _placed(stock, subject, pose, box_of)
    middle = center_of_all(things, box_of)
    if stock.composition is not None:
        things = stock.composition.things(subject, things, pose, box_of)
    views = stock.pose_list.drawn_for(subject)
    instants = [
        stock.instant(subject, views[pose], middle, middle, split(stock, subject, pose), i)
        for i, pose in enumerate(poses, first)
    ]
    scene = stock.scene(subject, stock.pose_list.name(poses[0]))
    return stock.finished(key, first, stock.repainted(things, subject, poses[0]), scene, instants)


def _entry(recipe: Recipe) -> ScenesEntry:
    assert isinstance(recipe.scenes, ScenesEntry)
    return recipe.scenes


def _poses(stock: Stock, subject: str) -> Ranges:
    """Numbers of the poses that a scene is taken from: those whose names' hashes are lowest, where they are drawn."""
    count, views = _entry(stock.recipe).views, stock.pose_list
    if count is None or count >= len(views):
        return ((0, len(views)),)
    order = sorted(range(len(views)), key=lambda i: share(stock.recipe.seed, "scene's views", subject, views.name(i)))
    return as_ranges(np.sort(np.array(order[:count], np.int64)))


def _placed(stock: Stock, subject: str, pose: str | None, box_of: BoxOf) -> tuple[Thing, ...]:
    """The models of a scene where they stand; raises RecipeError where there is no room."""
    entry, models = _entry(stock.recipe), cast(stock, subject, None)
    free = None if stock.composition is None else stock.composition.free_floor(subject, pose)
    room = Room(free, entry.gap, entry.spots, field="scenes")
    return still(models, placed(entry.placer, models, room, box_of, partial(generator, stock.recipe.seed, "layout", subject)))


def _check_models(stock: Stock) -> None:
    """Raise RecipeError where a scene may ask for more models than there are, of one split where splits are by model."""
    entry = _entry(stock.recipe)
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
