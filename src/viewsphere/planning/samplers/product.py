"""Models x poses, as in the paper: every frame is about one model, taken from a pose, at each of its time steps."""

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
from viewsphere.model.quantity import quantity
from viewsphere.model.scene import Floor, Scene, Vector
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Thing
from viewsphere.planning.samplers import Standing, Stock
from viewsphere.plugins.sampler import SamplerSpec
from viewsphere.recipe.recipe import Recipe
from viewsphere.store import Block


def subjects(recipe: Recipe, specs: Sequence[ModelSpec]) -> tuple[str, ...]:
    """The models' keys."""
    if recipe.splits.by == "scene":
        raise RecipeError("splits.by: expected model, pose, place or frame beside models x poses; found scene: set scenes")
    if recipe.splits.by == "sequence":
        raise RecipeError("splits.by: expected model, pose, place or frame beside models x poses; found sequence: set time")
    return tuple(spec.key for spec in specs)


def factors(stock: Stock) -> str:
    """Models, time steps and poses."""
    if not stock.timings:
        return f"{quantity(stock.models, 'model')} x {quantity(len(stock.pose_list), 'pose')}"
    base = stock.pose_list.base if isinstance(stock.pose_list, TimedPoses) else stock.pose_list
    counts = {len(timing.steps) if timing else 0 for timing in stock.timings}
    if len(counts) > 1:
        return f"{quantity(stock.models, 'model')} of different time steps, {quantity(len(base), 'pose')}"
    moving = [timing.moving for timing in stock.timings if timing]
    poses = "a pose each" if all(moving) else f"{quantity(len(base), 'pose')}{', of some a pose each' if any(moving) else ''}"
    return f"{quantity(stock.models, 'model')} x {quantity(counts.pop(), 'time step')} x {poses}"


def blocks(stock: Stock) -> tuple[Block, ...]:
    """Return the blocks of models and their poses, time step by time step."""
    found: list[Block] = []
    for schedule, members in groupby(range(stock.models), lambda model: stock.schedules[model]):
        keys = tuple(stock.model_specs[model].key for model in members)
        runs = [((run.first, run.stop),) for run in schedule.runs]
        if len(runs) == 1:
            found.append(Block(keys, runs[0]))
        else:
            found += (Block((key,), poses) for key in keys for poses in runs)
    return tuple(found)


def most_objects(recipe: Recipe) -> int:
    """The model and its company."""
    return 1 + (recipe.scene.company.number if recipe.scene.company else 0)


def cast(stock: Stock, subject: str, pose: int | None) -> tuple[ModelSpec, ...]:
    """The model and those that stand beside it; only the model without a pose where company is drawn for each frame."""
    return stock.with_company(subject, pose)


def split(stock: Stock, subject: str, pose: int) -> str:
    """The model's, or what its pose, place or name draw."""
    return stock.dealt_splits[subject] if stock.recipe.splits.by == "model" else stock.hashed_split(subject, pose)


def standing(stock: Stock, subject: str, box_of: BoxOf) -> Iterator[Standing]:
    """The model and its company at each time step; the model alone where company is drawn for each frame."""
    spec = stock.spec(subject)
    things, target = (Thing(id=1, model=spec),), None
    company = stock.recipe.scene.company
    if company is not None and is_slow(company.layout):
        return
    if stock.composition is not None and not stock.recipe.scene.is_moved_each_frame:
        things = stock.composition.targets(spec, None, box_of, redraw_names(stock.redraw), stock.memory, redraw=stock.redraw)
        target = stock.composition.center(things, box_of)
    for run in stock.schedule(spec).runs:
        at = _target(stock, things[0], run, target, box_of)
        yield Standing(_at(stock, things, run), at, stock.pose_list.of(subject), range(run.first, run.stop))


def shot(stock: Stock, subject: str, poses: Sequence[int], box_of: BoxOf, key: str, first: int) -> Shot:
    """The model, company and scenery, from poses of one time step."""
    spec = stock.spec(subject)
    things, target = (Thing(id=1, model=spec),), None
    if stock.composition is not None:
        again = stock.layout_names(poses[0])
        from_there = _seen_from(stock, subject, poses)
        targets = stock.composition.targets(
            spec, stock.scene_pose(poses[0]), box_of, again, stock.memory, from_there, stock.redraw
        )
        things = stock.composition.things(subject, targets, stock.scene_pose(poses[0]), box_of, redraw=stock.redraw)
        target = stock.composition.center(targets, box_of)
    things = stock.repainted(things, subject, poses[0])
    run = stock.schedule(spec).run_of(poses[0])
    target, placed = _target(stock, things[0], run, target, box_of), _at(stock, things, run)
    focus = target or center(placed[0], box_of)
    scene = _scene(stock, subject, stock.pose_list.name(poses[0]), run).model_copy(update=_floor(stock, spec, things, box_of))
    own = stock.pose_list.of(subject)
    views = (
        (i, stock.view(own, pose), split(stock, subject, pose)) for i, pose in enumerate(poses, first // len(stock.rig.sensors))
    )
    instants = [stock.instant(subject, view, target, focus, part, i) for i, view, part in views]
    return stock.finished(key, first, placed, scene, instants)


def _seen_from(stock: Stock, subject: str, poses: Sequence[int]) -> tuple[float, float] | None:
    """Azimuth and elevation of the camera of a shot's only pose; None where shots have several."""
    if not stock.recipe.scene.is_moved_each_frame or isinstance(stock.pose_list, TimedPoses):
        return None
    view = stock.viewpoint(subject, stock.view(stock.pose_list.of(subject), poses[0]), None)
    return view.azimuth_deg, view.elevation_deg


def _target(stock: Stock, first: Thing, run: Run, target: Vector | None, box_of: BoxOf) -> Vector | None:
    """Return the default target of cameras, None for the first object's centre.
    The target of an animated object is its centre at the first frame, or with `follow` its centre at each time step.
    """
    moves = run.step is not None and run.step.model is not None
    if moves and stock.recipe.viewpoints.target == "follow":
        target, first = None, _at(stock, (first,), run)[0]
    elif target is None and moves:
        return center(first, box_of)
    if target is None and stock.scenes.is_target_moved:
        target = center(first, box_of)
    return target


def _floor(stock: Stock, spec: ModelSpec, things: Sequence[Thing], box_of: BoxOf) -> dict[str, Floor]:
    """Return the scene's field for the ground's greatest height: the lowest point of a model over its time steps."""
    steps = stock.steps_of(spec)
    if not steps or stock.recipe.scene.ground == "off":
        return {}
    world = things[0].world_from_object
    return {"floor": Floor(height=min(float(transform(world, box_of(spec, step))[:, 2].min()) for step in steps))}


def _at(stock: Stock, things: Sequence[Thing], run: Run) -> tuple[Thing, ...]:
    """Return the placed things at a time step; company is at its own step of the same number.
    Things of the scene's file that show nothing at this step are omitted, so the ids of others shift.
    """
    if run.step is None:
        return tuple(things)
    found: list[Thing] = []
    for thing in things:
        number = stock.position.get(thing.model.key)
        shown = at_step(None if number is None else stock.timings[number], run.number)
        moved = thing if shown is None else thing.showing(shown)
        if stock.blend is not None and run.step.scene is not None:
            if not stock.blend.shows(moved.model, run.step.scene):
                continue
            moved = stock.blend.at_frame(moved, run.step.scene)
        found.append(moved)
    if len(found) == len(things):
        return tuple(found)
    return tuple(p.model_copy(update={"id": i}) if p.id else p for i, p in enumerate(found, 1))


def _scene(stock: Stock, subject: str, pose: str, run: Run) -> Scene:
    scene = stock.scene(subject, pose)
    if scene.blend is None or run.step is None or run.step.scene is None:
        return scene
    return scene.model_copy(update={"blend": scene.blend.model_copy(update={"frame": run.step.scene})})


SAMPLER = SamplerSpec(
    subjects=subjects,
    factors=factors,
    blocks=blocks,
    most_objects=most_objects,
    cast=cast,
    split=split,
    standing=standing,
    shot=shot,
)
