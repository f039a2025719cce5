"""Shots that a file lists, each with its camera and the poses of its models."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from pathlib import Path

from viewsphere.composing.composition import BoxOf
from viewsphere.composing.time_steps import is_animated
from viewsphere.composing.viewpoints.pose_files import Arranged, Extrinsics
from viewsphere.composing.viewpoints.poses import ListedPoses, placed, pose_file, world_turn
from viewsphere.errors import RecipeError, each
from viewsphere.files import written_path
from viewsphere.model.listed import ListedObject
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import IDENTITY
from viewsphere.model.sensors.rig import Rig
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Motion, Thing
from viewsphere.planning.imagers import with_imager
from viewsphere.planning.samplers import SamplingContext, Standing
from viewsphere.plugins.sampler import SamplerSpec
from viewsphere.recipe.cameras.viewpoints import PoseList
from viewsphere.recipe.recipe import Recipe
from viewsphere.store import Block
from viewsphere.validation.errors import Nearest, one_of
from viewsphere.validation.quantity import quantity


def _subjects(recipe: Recipe, specs: Sequence[ModelSpec]) -> tuple[str, ...]:
    """The shots' names. Raises RecipeError, a line per error, for shots with models or splits that the recipe lacks."""
    _check(recipe)
    path, shots = _file(recipe)
    keys = {spec.key for spec in specs}
    say_splits = any(shot.said.split for shot in shots)
    if recipe.splits.by == "model" or (recipe.splits.by == "scene" and say_splits):
        how = "frame, as shots say their splits" if say_splits else "scene, pose, place or frame beside sampler: listed"
        raise RecipeError(f"splits.by: expected {how}; found {recipe.splits.by}: set splits: {{by: frame}}")

    hint = Nearest()

    def name(shot: Arranged) -> str:
        where, split = f"{path}:{shot.line}", shot.said.split
        if split is not None and split not in recipe.splits.shares:
            known = tuple(recipe.splits.shares)
            raise RecipeError(f"{where}: split: {one_of(split, known)}")
        for i, one in enumerate(shot.said.objects):
            if one.model not in keys:
                raise RecipeError(
                    f"{where}: objects[{i}].model: expected the key of a model of the recipe; found {one.model!r}"
                    f"{hint(one.model, keys)}"
                )
        return shot.name

    return tuple(each(name, shots))


def _factors(context: SamplingContext) -> str:
    """The number of shots."""
    return f"{quantity(len(context.subjects), 'listed shot')} of {quantity(context.models, 'model')}"


def _blocks(context: SamplingContext) -> tuple[Block, ...]:
    """Every shot from its own camera, in the file's order."""
    return tuple(Block((name,), ((i, i + 1),)) for i, name in enumerate(context.subjects))


def _most_objects(recipe: Recipe) -> int:
    """Most models in a shot."""
    return max(len(shot.places) for shot in _file(recipe)[1])


def _cast(context: SamplingContext, subject: str, pose: int | None) -> tuple[ModelSpec, ...]:
    """The models of a shot, in the order of their ids."""
    return tuple(context.spec(listed_object.model) for listed_object in _shots(context)[subject].said.objects)


def _split(context: SamplingContext, subject: str, pose: int) -> str:
    """The shot's own split, else one drawn from its name."""
    if context.recipe.splits.by == "scene":
        return context.dealt_splits[subject]
    return _shots(context)[subject].said.split or context.hashed_split(subject, pose)


def _standing(context: SamplingContext, subject: str, box_of: BoxOf) -> Iterator[Standing]:
    """Nothing: the positions of listed cameras are intended, so they are not checked."""
    return iter(())


def _shot(context: SamplingContext, subject: str, poses: Sequence[int], box_of: BoxOf, key: str, first: int) -> Shot:
    """The shot with its models at the file's poses, their surroundings, and its camera."""
    (pose,) = poses
    things = _things(context, _shots(context)[subject])
    if context.composition is not None:
        things = context.composition.things(subject, things, context.scene_pose(pose), box_of)
    view, number = context.view(context.pose_list, pose), first // len(context.rig.sensors)
    now = context.instant(subject, view, view.target, (0.0, 0.0, 0.0), _split(context, subject, pose), number)
    scene = context.scene(subject, context.pose_list.name(pose))
    things, lens = context.repainted(things, subject, pose), now.intrinsics
    if context.own_rig is not None or lens is None:
        return context.finished(key, first, things, scene, [now])
    finished = context.finished(key, first, things, scene, [now.model_copy(update={"intrinsics": None})])
    return finished.model_copy(update={"rig": with_imager(context.recipe, Rig.single(lens))})


def _things(context: SamplingContext, shot: Arranged) -> tuple[Thing, ...]:
    """The objects of a shot, with poses converted from the file's world by the recipe's viewpoints."""
    entry, file = _listed(context).viewpoints, _listed(context).file
    turn = world_turn(entry, file)

    def thing(number: int, listed_object: ListedObject, place: Extrinsics) -> Thing:
        a, b, c = ((x, y, z, w) for x, y, z, w in placed(place, turn, entry)[:3].tolist())
        motion = Motion.still((a, b, c, IDENTITY[3]))
        return Thing(id=number, model=context.spec(listed_object.model), motion=motion, scenery=listed_object.scenery)

    pairs = zip(shot.said.objects, shot.places, strict=True)
    return tuple(thing(number, listed_object, place) for number, (listed_object, place) in enumerate(pairs, 1))


def _listed(context: SamplingContext) -> ListedPoses:
    assert isinstance(context.pose_list, ListedPoses)
    return context.pose_list


@lru_cache(maxsize=2)
def _shots(context: SamplingContext) -> dict[str, Arranged]:
    """The shots by their names."""
    return {shot.name: shot for shot in _listed(context).file.shots}


def _file(recipe: Recipe) -> tuple[Path, tuple[Arranged, ...]]:
    """The file of shots, and the shots in use. Raises RecipeError if the viewpoints are not such a file."""
    entry = recipe.viewpoints
    if isinstance(entry, PoseList):
        path = recipe.folder / written_path(entry.path)
        poses = pose_file(path, entry)
        if poses.shots:
            return path, poses.shots
    raise RecipeError(
        "viewpoints: expected a file of shots beside sampler: listed; found another kind of viewpoints: set viewpoints: "
        "{kind: file, path: shots.jsonl}"
    )


def _check(recipe: Recipe) -> None:
    """Raise RecipeError for settings that listed shots do not support."""
    if recipe.time is not None:
        raise RecipeError("time: expected none beside sampler: listed, whose shots are still pictures; found one: leave it out")
    if is_animated(recipe):
        raise RecipeError("models: expected models that stand still beside sampler: listed; found frames: leave frames out")
    if recipe.scene.company is not None:
        raise RecipeError("scene.company: expected none beside sampler: listed, which says what is there; found one")
    lenses = [repr(shot.said.camera) for shot in _file(recipe)[1]] if recipe.rig and recipe.camera.of_viewpoints else []
    if len(set(lenses)) > 1:
        raise RecipeError("rig: expected shots of one lens beside a rig and camera: {of_viewpoints: true}; found several")


SAMPLER = SamplerSpec(
    subjects=_subjects,
    factors=_factors,
    blocks=_blocks,
    most_objects=_most_objects,
    cast=_cast,
    split=_split,
    standing=_standing,
    shot=_shot,
    of_any_size=True,
)
