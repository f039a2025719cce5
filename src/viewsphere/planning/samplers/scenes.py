"""Random scenes: each has random models in random places, and cameras around their middle."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from itertools import groupby

import numpy as np

from viewsphere.composing.composition import BoxOf, center_of_all
from viewsphere.composing.layouts import is_slow
from viewsphere.composing.time_steps import is_animated
from viewsphere.composing.viewpoints.pose_numbers import as_ranges
from viewsphere.errors import RecipeError
from viewsphere.geometry.rotation import transform
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Floor
from viewsphere.model.shot import Shot
from viewsphere.planning.samplers import SamplingContext, Standing
from viewsphere.planning.samplers.shared.random import (
    are_views_drawn,
    check_scene_models,
    scene_around,
    scene_cast,
    scene_distractors,
    scene_names,
    scene_split,
    scene_things,
    scene_views,
    scenes_entry,
)
from viewsphere.plugins.sampler import SamplerSpec
from viewsphere.recipe.recipe import Recipe
from viewsphere.store import Block
from viewsphere.store.index import Ranges, numbers
from viewsphere.validation.quantity import quantity

IN_THE_AIR = 1e-3
"""Metres between the floor and models that do not stand on it."""


def _subjects(recipe: Recipe, specs: Sequence[ModelSpec]) -> tuple[str, ...]:
    """The scenes' names."""
    if is_animated(recipe):
        raise RecipeError("scenes: expected models and a scene that stand still; found frames of a file: leave frames out")
    if recipe.splits.by == "sequence":
        raise RecipeError(
            "splits.by: expected model, scene, pose, place or frame beside still pictures; found sequence: set time"
        )
    return scene_names(recipe)


def _factors(context: SamplingContext) -> str:
    """Scenes, and the poses of each."""
    entry = scenes_entry(context.recipe)
    views = len(context.pose_list) if entry.views is None else min(entry.views, len(context.pose_list))
    return f"{quantity(len(context.subjects), 'scene')} of {quantity(context.models, 'model')} x {quantity(views, 'pose')}"


def _blocks(context: SamplingContext) -> tuple[Block, ...]:
    """Return the blocks of every scene, with all poses or the drawn ones. Raises RecipeError if too few models can share a
    scene.
    """
    check_scene_models(context)
    if not are_views_drawn(context):
        return (Block(context.subjects, ((0, len(context.pose_list)),)),)
    taken = groupby(context.subjects, partial(_poses, context))
    return tuple(Block(tuple(names), poses) for poses, names in taken)


def _most_objects(recipe: Recipe) -> int:
    """Most models in a scene."""
    return scenes_entry(recipe).most_objects


def _cast(context: SamplingContext, subject: str, pose: int | None) -> tuple[ModelSpec, ...]:
    """The models of a scene."""
    return scene_cast(context, subject)


def _split(context: SamplingContext, subject: str, pose: int) -> str:
    """The scene's split, or one drawn from the pose, place or name; with splits by model, the split drawn before the scene's
    models.
    """
    match context.recipe.splits.by:
        case "scene":
            return context.dealt_splits[subject]
        case "model":
            return scene_split(context, subject)
        case _:
            return context.hashed_split(subject, pose)


def _standing(context: SamplingContext, subject: str, box_of: BoxOf) -> Iterator[Standing]:
    """The placed models of a scene; nothing if their place is drawn for each frame."""
    if not context.recipe.scene.is_moved_each_frame and not is_slow(scenes_entry(context.recipe).layout):
        things = scene_things(context, subject, None, box_of)
        views, poses = context.pose_list.for_subject(subject), tuple(numbers(_poses(context, subject)))
        yield Standing(things, center_of_all(things, box_of), views, poses)


def _shot(context: SamplingContext, subject: str, poses: Sequence[int], box_of: BoxOf, key: str, first: int) -> Shot:
    """The shot of a scene's models and their surroundings; cameras look at the middle of the models."""
    pose = context.scene_pose(poses[0])
    targets = things = scene_things(context, subject, pose, box_of)
    middle = center_of_all(things, box_of)
    if context.composition is not None:
        things = context.composition.things(subject, things, pose, box_of, redraw=context.redraw)
    things += scene_distractors(context, subject, pose, box_of) + scene_around(context, subject, pose, box_of)
    views = context.pose_list.for_subject(subject)
    instants = [
        context.instant(subject, context.view(views, pose), middle, middle, _split(context, subject, pose), i)
        for i, pose in enumerate(poses, first // len(context.rig.sensors))
    ]
    scene = context.scene(subject, context.pose_list.name(poses[0]))
    if min(float(transform(thing.world_from_object, box_of(thing.model))[:, 2].min()) for thing in targets) > IN_THE_AIR:
        scene = scene.model_copy(update={"floor": Floor(height=0.0)})
    return context.finished(key, first, context.repainted(things, subject, poses[0]), scene, instants)


def _poses(context: SamplingContext, subject: str) -> Ranges:
    """Numbers of the poses that a scene is taken from."""
    return as_ranges(np.array(scene_views(context, subject), np.int64))


SAMPLER = SamplerSpec(
    subjects=_subjects,
    factors=_factors,
    blocks=_blocks,
    most_objects=_most_objects,
    cast=_cast,
    split=_split,
    standing=_standing,
    shot=_shot,
)
