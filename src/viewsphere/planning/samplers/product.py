"""Models x poses, as in the paper: every frame shows one model from a pose, at each of its time steps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby

from viewsphere.composing.composition import BoxOf, center
from viewsphere.composing.layouts import is_slow
from viewsphere.composing.redraws import redraw_names
from viewsphere.composing.time_steps import Run, TimedPoses, at_step
from viewsphere.errors import RecipeError
from viewsphere.geometry.rotation import transform
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Floor, Scene, Vector
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Thing
from viewsphere.planning.samplers import SamplingContext, Standing
from viewsphere.plugins.sampler import SamplerSpec
from viewsphere.recipe.recipe import Recipe
from viewsphere.store import Block
from viewsphere.validation.quantity import quantity


def _subjects(recipe: Recipe, specs: Sequence[ModelSpec]) -> tuple[str, ...]:
    """The models' keys."""
    if recipe.splits.by == "scene":
        raise RecipeError("splits.by: expected model, pose, place or frame beside models x poses; found scene: set scenes")
    if recipe.splits.by == "sequence":
        raise RecipeError("splits.by: expected model, pose, place or frame beside models x poses; found sequence: set time")
    return tuple(spec.key for spec in specs)


def _factors(context: SamplingContext) -> str:
    """Models, time steps and poses."""
    if not context.timings:
        return f"{quantity(context.models, 'model')} x {quantity(len(context.pose_list), 'pose')}"
    base = context.pose_list.base if isinstance(context.pose_list, TimedPoses) else context.pose_list
    counts = {len(timing.steps) if timing else 0 for timing in context.timings}
    if len(counts) > 1:
        return f"{quantity(context.models, 'model')} of different time steps, {quantity(len(base), 'pose')}"
    moving = [timing.moving for timing in context.timings if timing]
    poses = "a pose each" if all(moving) else f"{quantity(len(base), 'pose')}{', of some a pose each' if any(moving) else ''}"
    return f"{quantity(context.models, 'model')} x {quantity(counts.pop(), 'time step')} x {poses}"


def _blocks(context: SamplingContext) -> tuple[Block, ...]:
    """Return the blocks of models and their poses, time step by time step."""
    blocks: list[Block] = []
    for schedule, members in groupby(range(context.models), lambda model: context.schedules[model]):
        keys = tuple(context.model_specs[model].key for model in members)
        runs = [((run.first, run.stop),) for run in schedule.runs]
        if len(runs) == 1:
            blocks.append(Block(keys, runs[0]))
        else:
            blocks += (Block((key,), poses) for key in keys for poses in runs)
    return tuple(blocks)


def _most_objects(recipe: Recipe) -> int:
    """The number of models: one and its company."""
    return 1 + (recipe.scene.company.number if recipe.scene.company else 0)


def _cast(context: SamplingContext, subject: str, pose: int | None) -> tuple[ModelSpec, ...]:
    """The model and its company; without a pose, the model alone if company is drawn for each frame."""
    return context.with_company(subject, pose)


def _split(context: SamplingContext, subject: str, pose: int) -> str:
    """The model's split, or one drawn from the pose, place or name."""
    return context.dealt_splits[subject] if context.recipe.splits.by == "model" else context.hashed_split(subject, pose)


def _standing(context: SamplingContext, subject: str, box_of: BoxOf) -> Iterator[Standing]:
    """The model and its company at each time step; the model alone where company is drawn for each frame."""
    spec = context.spec(subject)
    things, target = (Thing(id=1, model=spec),), None
    company = context.recipe.scene.company
    if company is not None and is_slow(company.layout):
        return
    if context.composition is not None and not context.recipe.scene.is_moved_each_frame:
        things = context.composition.targets(
            spec, None, box_of, redraw_names(context.redraw), context.memory, redraw=context.redraw
        )
        target = context.composition.center(things, box_of)
    for run in context.schedule(spec).runs:
        at = _target(context, things[0], run, target, box_of)
        yield Standing(_at(context, things, run), at, context.pose_list.for_subject(subject), range(run.first, run.stop))


def _shot(context: SamplingContext, subject: str, poses: Sequence[int], box_of: BoxOf, key: str, first: int) -> Shot:
    """The shot of a model with company and scenery, from poses of one time step."""
    spec = context.spec(subject)
    things, target = (Thing(id=1, model=spec),), None
    if context.composition is not None:
        again = context.layout_names(poses[0])
        from_there = _seen_from(context, subject, poses)
        targets = context.composition.targets(
            spec, context.scene_pose(poses[0]), box_of, again, context.memory, from_there, context.redraw
        )
        things = context.composition.things(subject, targets, context.scene_pose(poses[0]), box_of, redraw=context.redraw)
        target = context.composition.center(targets, box_of)
    things = context.repainted(things, subject, poses[0])
    run = context.schedule(spec).run_of(poses[0])
    target, placed = _target(context, things[0], run, target, box_of), _at(context, things, run)
    focus = target or center(placed[0], box_of)
    scene = _scene(context, subject, context.pose_list.name(poses[0]), run).model_copy(
        update=_floor(context, spec, things, box_of)
    )
    poses_of_subject = context.pose_list.for_subject(subject)
    views = (
        (i, context.view(poses_of_subject, pose), _split(context, subject, pose))
        for i, pose in enumerate(poses, first // len(context.rig.sensors))
    )
    instants = [context.instant(subject, view, target, focus, part, i) for i, view, part in views]
    return context.finished(key, first, placed, scene, instants)


def _seen_from(context: SamplingContext, subject: str, poses: Sequence[int]) -> tuple[float, float] | None:
    """Azimuth and elevation of the camera if shots have a single pose, else None."""
    if not context.recipe.scene.is_moved_each_frame or isinstance(context.pose_list, TimedPoses):
        return None
    view = context.viewpoint(subject, context.view(context.pose_list.for_subject(subject), poses[0]), None)
    return view.azimuth_deg, view.elevation_deg


def _target(context: SamplingContext, first: Thing, run: Run, target: Vector | None, box_of: BoxOf) -> Vector | None:
    """Return the default target of cameras, None for the first object's centre.
    The target of an animated object is its centre at the first frame, or with `follow` its centre at each time step.
    """
    moves = run.step is not None and run.step.model is not None
    if moves and context.recipe.viewpoints.target == "follow":
        target, first = None, _at(context, (first,), run)[0]
    elif target is None and moves:
        return center(first, box_of)
    if target is None and context.scenes.is_target_moved:
        target = center(first, box_of)
    return target


def _floor(context: SamplingContext, spec: ModelSpec, things: Sequence[Thing], box_of: BoxOf) -> dict[str, Floor]:
    """Return the scene's field for the ground's greatest height: the lowest point of a model over its time steps."""
    steps = context.steps_of(spec)
    if not steps or context.recipe.scene.ground == "off":
        return {}
    world = things[0].world_from_object
    return {"floor": Floor(height=min(float(transform(world, box_of(spec, step))[:, 2].min()) for step in steps))}


def _at(context: SamplingContext, things: Sequence[Thing], run: Run) -> tuple[Thing, ...]:
    """Return the placed things at a time step; company is at its own step of the same number.
    Things of the scene's file that show nothing at this step are omitted, so the ids of others shift.
    """
    if run.step is None:
        return tuple(things)
    things_there: list[Thing] = []
    for thing in things:
        number = context.position.get(thing.model.key)
        shown = at_step(None if number is None else context.timings[number], run.number)
        moved = thing if shown is None else thing.showing(shown)
        if context.blend is not None and run.step.scene is not None:
            if not context.blend.shows(moved.model, run.step.scene):
                continue
            moved = context.blend.at_frame(moved, run.step.scene)
        things_there.append(moved)
    if len(things_there) == len(things):
        return tuple(things_there)
    return tuple(p.model_copy(update={"id": i}) if p.id else p for i, p in enumerate(things_there, 1))


def _scene(context: SamplingContext, subject: str, pose: str, run: Run) -> Scene:
    scene = context.scene(subject, pose)
    if scene.blend is None or run.step is None or run.step.scene is None:
        return scene
    return scene.model_copy(update={"blend": scene.blend.model_copy(update={"frame": run.step.scene})})


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
