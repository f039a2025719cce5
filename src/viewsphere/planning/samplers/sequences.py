"""Worlds over time: every model with its company, or every random scene, is one sequence for each still viewpoint.

A sequence's things and camera motion depend only on its names, and an instant only on its number, so that shots may divide it
anywhere. Shots also contain the instants that their labels need.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence, Set
from dataclasses import replace

import numpy as np

from viewsphere.composing.composition import BoxOf
from viewsphere.composing.layouts import is_slow
from viewsphere.composing.seeds import generator
from viewsphere.composing.time_steps import is_animated
from viewsphere.composing.trajectories import instant as instant_of
from viewsphere.composing.trajectories import is_still
from viewsphere.composing.viewpoints.sequence_poses import SequencePoses
from viewsphere.errors import RecipeError
from viewsphere.labels import label_named
from viewsphere.model.annotations.tracks import Tracks
from viewsphere.model.channel import FINISHED
from viewsphere.model.instant import Instant
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Floor, Matrix4
from viewsphere.model.sensors.exposure import Exposure, Sweep, beyond
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Motion
from viewsphere.planning.samplers import SamplingContext, Standing
from viewsphere.planning.samplers.shared.moving import Moving
from viewsphere.planning.samplers.shared.random import (
    check_scene_models,
    scene_cast,
    scene_names,
    scene_split,
    scene_views,
    scenes_entry,
)
from viewsphere.planning.samplers.shared.sequence_state import SequenceState, middle, placed_targets, sequence_state, time_of
from viewsphere.plugins.sampler import SamplerSpec
from viewsphere.recipe.cameras.sequence import TimeEntry
from viewsphere.recipe.recipe import Recipe
from viewsphere.recipe.world.scenes import ScenesEntry
from viewsphere.store import Block
from viewsphere.validation.quantity import quantity

NODES = 5
"""Moments of an open shutter at which a thing's pose is recorded; poses are interpolated in between."""

AROUND = (-1.0, 0.0, 1.0)
"""Moments of the instants around one."""

RigAt = Callable[[int], Matrix4]
"""The rig's pose at an instant of a sequence."""


FLOOR = Floor(height=0.0, is_fixed=True)
"""The floor of all sequences: moving things may be above or below it."""


def _subjects(recipe: Recipe, specs: Sequence[ModelSpec]) -> tuple[str, ...]:
    """The models' keys, or the scenes' names."""
    if is_animated(recipe):
        raise RecipeError(
            "time: expected models and a scene without frames of their files, which are still pictures; found frames: leave "
            "frames out, and give the model a motion of kind clip"
        )
    if recipe.scenes is not None:
        return scene_names(recipe)
    if recipe.splits.by == "scene":
        raise RecipeError("splits.by: expected model, sequence, pose, place or frame without scenes; found scene: set scenes")
    return tuple(spec.key for spec in specs)


def _factors(context: SamplingContext) -> str:
    """The factors of the number of frames: models or scenes, sequences and instants."""
    subjects = quantity(len(context.subjects), "model" if context.recipe.scenes is None else "scene")
    views = sum(len(names) for names in _taken(context).values())
    return f"{subjects}, {quantity(views, 'sequence')} x {quantity(time_of(context).count, 'instant')}"


def _blocks(context: SamplingContext) -> tuple[Block, ...]:
    """Blocks of rows: for each viewpoint, its subjects and its instants."""
    if context.recipe.scenes is not None:
        check_scene_models(context)
    count = time_of(context).count
    return tuple(Block(tuple(names), ((view * count, (view + 1) * count),)) for view, names in _taken(context).items())


def _most_objects(recipe: Recipe) -> int:
    """The number of models: one and its company, or the most models in a scene."""
    if recipe.scenes is not None:
        return scenes_entry(recipe).most_objects
    return 1 + (recipe.scene.company.number if recipe.scene.company else 0)


def _cast(context: SamplingContext, subject: str, pose: int | None) -> tuple[ModelSpec, ...]:
    """The recipe's models in a sequence; without a pose, the model alone if company is drawn for each sequence."""
    if context.recipe.scenes is not None:
        return scene_cast(context, subject)
    return context.with_company(subject, pose)


def _split(context: SamplingContext, subject: str, pose: int) -> str:
    """The split of the model, the scene or the sequence, or one drawn from the pose, place or name."""
    by = context.recipe.splits.by
    if by == "sequence":
        return context.dealt_splits[context.sequence(subject, pose)]
    if by == "model" and context.recipe.scenes is not None:
        return scene_split(context, subject)
    return context.dealt_splits[subject] if by in ("model", "scene") else context.hashed_split(subject, pose)


def _standing(context: SamplingContext, subject: str, box_of: BoxOf) -> Iterator[Standing]:
    """The things at their places, for still cameras; nothing if they are drawn for each sequence."""
    if not context.recipe.scene.is_moved_each_frame and is_still(context.recipe.viewpoints) and not _is_slow(context.recipe):
        things = placed_targets(context, subject, None, box_of)
        count, views = time_of(context).count, context.sequences_of(subject)
        poses = [view * count for view, names in _taken(context).items() if subject in names]
        yield Standing(things, middle(things, box_of), views, poses)


def _is_slow(recipe: Recipe) -> bool:
    """Return whether placing things is too slow to run before rendering."""
    company, scenes = recipe.scene.company, recipe.scenes
    layout = company.layout if company is not None else scenes.layout if isinstance(scenes, ScenesEntry) else None
    return layout is not None and is_slow(layout)


def _shot(context: SamplingContext, subject: str, poses: Sequence[int], box_of: BoxOf, key: str, first: int) -> Shot:
    """The shot of some instants of a sequence, with the instants that their labels need."""
    start = poses[0] - poses[0] % time_of(context).count
    taken = {pose - start for pose in poses}
    state = sequence_state(context, subject, start, box_of)
    numbers = sorted(taken | _needed(context, taken))
    instants = [
        _instant(context, state, subject, start + i, box_of).model_copy(update={"recorded": i in taken}) for i in numbers
    ]
    scene = context.scene(subject, context.scene_name(start)).model_copy(update={"floor": FLOOR})
    finished = context.finished(key, first, state.things_during(numbers), scene, instants)

    def rig_at(instant: int) -> Matrix4:
        return _instant(context, state, subject, start + instant, box_of).world_from_rig

    rolls = context.recipe.camera.rolling is not None  # labels then compare the rows of all instants
    exposed = _exposures(state, [i if i in taken or rolls else None for i in numbers], context, rig_at)
    more = {"sequence": context.sequence(subject, start), "tracks": _tracks(context, subject, start)}
    return finished.model_copy(update=more | {"shutter": time_of(context).shutter, "exposures": exposed})


def _tracks(context: SamplingContext, subject: str, start: int) -> Tracks | None:
    """The points that sensors follow through a sequence."""
    if context.tracks is None or context.tracks.count is None:
        return context.tracks
    rng = generator(context.recipe.seed, "tracks", subject, context.pose_list.place(start))
    return context.tracks.model_copy(update={"seed": int(rng.integers(2**63))})


def _instant(context: SamplingContext, own: SequenceState, subject: str, pose: int, box_of: BoxOf) -> Instant:
    """The instant of a pose."""
    time, part = time_of(context), _split(context, subject, pose)
    i = pose % time.count
    if own.rig is None:
        view, at = context.sequences_of(subject)[pose], own.focus_at(i, context.recipe.viewpoints.target == "follow", box_of)
        return context.instant(subject, view, at, at, part, i).model_copy(update={"seconds": time.seconds_at(i)})
    finish, now = context.finish(subject, pose), own.rig[i]
    if not context.recipe.camera.of_viewpoints:
        now = replace(now, intrinsics=context.drawn_lens(subject, pose))
    return instant_of(now, i, time.seconds_at(i), pose, context.recipe.viewpoints.bins, split=part, finish=finish)


def _needed(context: SamplingContext, taken: Set[int]) -> set[int]:
    """The further instants that the labels of the taken ones need, and their imager's automatic exposure."""
    names = {name for sensor in context.rig.sensors for name in sensor.kept_channels(context.recipe.channels)}
    names.update(context.recipe.annotations)
    known = (label for name in names if (label := label_named(name)))
    offsets = {offset for label in known for offset in (*label.view_offsets, *label.pose_offsets)}
    offsets |= {-1, 1} if any(sensor.lidar and sensor.lidar.sweep for sensor in context.rig.sensors) else set()
    count = time_of(context).count
    compared = {number + offset for number in taken for offset in offsets if 0 <= number + offset < count}
    for sensor in context.rig.sensors:
        if sensor.imager is not None and not names.isdisjoint(FINISHED):
            compared.update(*map(sensor.imager.metering, taken))
    return compared if context.tracks is None else compared | set(context.tracks.at)


def _taken(context: SamplingContext) -> dict[int, list[str]]:
    """The subjects that are taken from each viewpoint, by the viewpoint's number."""
    assert isinstance(context.pose_list, SequencePoses)
    base = context.pose_list.base
    if context.recipe.scenes is None:
        return {view: list(context.subjects) for view in range(len(base))}
    found: defaultdict[int, list[str]] = defaultdict(list)
    for subject in context.subjects:
        for view in scene_views(context, subject):
            found[view].append(subject)
    return dict(sorted(found.items()))


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


def _exposures(
    state: SequenceState, instants: Sequence[int | None], context: SamplingContext, rig_at: RigAt
) -> tuple[Exposure | None, ...]:
    """Return the movements around each of these instants; empty for a shutter without duration.
    An instant has None where no exposure is needed (None), and where nothing moves.
    """
    time, rolling = time_of(context), context.recipe.camera.rolling
    length = time.shutter + (0.0 if rolling is None else rolling.readout * time.fps)
    if not length:
        return ()
    interval = None if rolling is None else 1 / time.fps
    return tuple(None if at is None else _exposure(state, at, time, length, interval, rig_at) for at in instants)


def _exposure(
    state: SequenceState, at: int, time: TimeEntry, length: float, interval: float | None, rig_at: RigAt
) -> Exposure | None:
    things = tuple(None if moving is None or moving.is_still else _thing(moving, at, length) for moving in state.moving)
    rig = _rig(at, time.count, rig_at)
    return None if rig is None and not any(things) else Exposure(things=things, rig=rig, interval=interval)


def _thing(moving: Moving, at: int, length: float) -> Sweep | None:
    """A thing's poses while the shutter is open, `length` instants long; for a playing animation, its poses and time steps at
    the instants around.
    """
    moments = AROUND if moving.plays_file else tuple(np.linspace(-0.5, 0.5, NODES) * length)
    motion = moving.around(at, moments)
    return None if motion.is_still else Sweep(moments=tuple(map(float, moments)), motion=motion)


def _rig(at: int, count: int, rig_at: RigAt) -> Sweep | None:
    """The rig's poses at the instants around one; its motion is continued before the first instant and after the last."""
    if count == 1:
        return None
    now = rig_at(at)
    before = rig_at(at - 1) if at else beyond(now, rig_at(at + 1))
    after = rig_at(at + 1) if at < count - 1 else beyond(now, before)
    return None if before == now == after else Sweep(moments=AROUND, motion=Motion(poses=(before, now, after)))
