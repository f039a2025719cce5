"""The state of a whole sequence: the poses of its things and its rig at all instants, however shots divide it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import numpy as np

from viewsphere.composing.composition import BoxOf, center, center_of_all, still
from viewsphere.composing.motion import Lane, Start, mover
from viewsphere.composing.placing import standing
from viewsphere.composing.redraws import redraw_names
from viewsphere.composing.scene.scenery import SceneryPiece
from viewsphere.composing.seeds import Names, generator
from viewsphere.composing.trajectories import RigPose, World, shaken
from viewsphere.composing.trajectories import standing as steady
from viewsphere.composing.viewpoints.sequence_poses import TrajectoryPoses
from viewsphere.errors import RecipeError
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import Matrix4, Vector
from viewsphere.model.thing import Motion, Thing
from viewsphere.planning.samplers.shared.moving import Moving
from viewsphere.planning.samplers.shared.random import scene_around, scene_distractors, scene_laid, scene_things
from viewsphere.planning.samplers.shared.sampling_context import SamplingContext
from viewsphere.recipe.cameras.sequence import TimeEntry
from viewsphere.recipe.world.motion import Motions
from viewsphere.validation.errors import nearest

Way = Callable[[float], Matrix4]
"""The pose of a thing at a time, seconds, on the way to its place."""


@dataclass(frozen=True, eq=False)
class SequenceState:
    """One sequence: its placed things; the movement of each, None for still ones; the default target of cameras; and the rig's
    poses at all instants, None for a still rig.
    """

    things: tuple[Thing, ...]
    moving: tuple[Moving | None, ...]
    focus: Vector
    rig: tuple[RigPose, ...] | None

    def things_during(self, instants: Sequence[int]) -> tuple[Thing, ...]:
        """The things at some instants."""
        pairs = zip(self.things, self.moving, strict=True)
        return tuple(_with(thing, moving and moving.during(instants)) for thing, moving in pairs)

    def focus_at(self, instant: int, follows: bool, box_of: BoxOf) -> Vector:
        """Return the default target of cameras at an instant; with `follows` it follows the first thing."""
        return center(_at(self.things[0], self.moving[0], instant), box_of) if follows else self.focus


def _with(thing: Thing, motion: Motion | None) -> Thing:
    """The thing with this motion; None: as it is placed."""
    return thing if motion is None else thing.model_copy(update={"motion": motion})


def _at(thing: Thing, moving: Moving | None, instant: int) -> Thing:
    """The thing as it is at an instant: as a still thing, or absent."""
    return _with(thing, moving and moving.motion_at(instant))


def time_of(context: SamplingContext) -> TimeEntry:
    """The recipe's time."""
    assert context.recipe.time is not None
    return context.recipe.time


@lru_cache(maxsize=2)
def sequence_state(context: SamplingContext, subject: str, start: int, box_of: BoxOf) -> SequenceState:
    """The sequence of a subject whose first pose has this number. The last results are cached, because shots of one sequence
    follow one another.

    Raises RecipeError if there is not enough room, and for impossible motions.
    """
    around = context.scene_pose(start)
    targets = placed_targets(context, subject, around, box_of)
    focus = middle(targets, box_of)
    names = (subject, context.pose_list.place(start), *redraw_names(context.redraw))
    lanes = () if context.composition is None else context.composition.lanes(subject, around, context.redraw)

    pieces: list[Moving | None] = []

    def piece_moved(thing: Thing, piece: SceneryPiece) -> Thing:
        pieces.append(piece_moving(context, thing, piece, names, lanes))
        return thing

    things = targets
    if context.composition is not None:
        things = context.composition.things(subject, targets, around, box_of, piece_moved, context.redraw)
    ways = _target_ways(context, subject, around, box_of)
    if context.recipe.scenes is not None:
        among, beneath = scene_distractors(context, subject, around, box_of), scene_around(context, subject, around, box_of)
        own_ways = zip(among, ways[len(targets) :], strict=True)
        moving = [_distractor_moving(context, thing, way, (*names, str(i)), lanes) for i, (thing, way) in enumerate(own_ways)]
        things, pieces = (*things, *among, *beneath), [*pieces, *moving, *[None] * len(beneath)]
    target_movements = [
        target_moving(context, thing, i, names, lanes, way) for (i, thing), way in zip(enumerate(targets), ways, strict=False)
    ]
    unmoved = SequenceState(context.repainted(things, subject, start), (*target_movements, *pieces), focus, None)
    return replace(unmoved, rig=_rig(context, unmoved, subject, start, lanes, box_of))


def placed_targets(context: SamplingContext, subject: str, pose: str | None, box_of: BoxOf) -> tuple[Thing, ...]:
    """The targets of a sequence at their places on the floor; `pose` names the draws of each sequence."""
    if context.recipe.scenes is not None:
        return scene_things(context, subject, pose, box_of)
    spec = context.spec(subject)
    if context.composition is not None:
        again = redraw_names(context.redraw)
        return context.composition.targets(spec, pose, box_of, again, context.memory, redraw=context.redraw)
    return still((spec,), (standing(box_of(spec)),))


def _target_ways(context: SamplingContext, subject: str, pose: str | None, box_of: BoxOf) -> tuple[Way | None, ...]:
    """Return the path to its place of each target of a sequence, then of each distractor; None for a thing without a path."""
    if context.recipe.scenes is not None:
        layout = scene_laid(context, subject, pose, box_of)
        return tuple(way.pose_at for way in layout.ways) or (None,) * len(layout.members)
    spec = context.spec(subject)
    company = None
    if context.composition is not None:
        company = context.composition.company(
            spec, pose, box_of, standing(box_of(spec)), redraw_names(context.redraw), context.memory, redraw=context.redraw
        )
    if company is None:
        return (None,)
    return (None, *(tuple(way.pose_at for way in company.ways) or (None,) * len(company.members)))


def middle(things: Sequence[Thing], box_of: BoxOf) -> Vector:
    """Return the default target of cameras: the middle of the placed targets."""
    return center(things[0], box_of) if len(things) == 1 else center_of_all(things, box_of)


def target_moving(
    context: SamplingContext, thing: Thing, slot: int, names: Names, lanes: tuple[Lane, ...], way: Way | None = None
) -> Moving | None:
    """Return the movement of the target with this number in the sequence of these names; None if it stands still."""
    return _moving(context, thing, *_motions(context, thing.model, slot), (*names, str(slot), thing.model.key), lanes, way)


def piece_moving(
    context: SamplingContext, thing: Thing, piece: SceneryPiece, names: Names, lanes: tuple[Lane, ...]
) -> Moving | None:
    """Return the movement of a piece of scenery in the sequence of these names; None if it stands still."""
    return _moving(context, thing, piece.motion, piece.field, (*names, piece.name), lanes)


def _distractor_moving(
    context: SamplingContext, thing: Thing, way: Way | None, names: Names, lanes: tuple[Lane, ...]
) -> Moving | None:
    """Return the movement of a model that is not labelled; None if it stands still."""
    number = {spec.key: number for spec, number in context.distractors}[thing.model.key]
    motions, field = context.recipe.models[number].motion, f"models[{number}].motion"
    return _moving(context, thing, motions, field, (*names, "distractor", thing.model.key), lanes, way)


def _moving(
    context: SamplingContext,
    thing: Thing,
    motions: Motions | None,
    field: str,
    names: Names,
    lanes: tuple[Lane, ...],
    way: Way | None = None,
) -> Moving | None:
    """Return the movement of a thing, drawn for these names; None if it stands still."""
    if motions is None:
        return None
    time, rng = time_of(context), partial(generator, context.recipe.seed, "motion", *names)
    place = context.position.get(thing.model.key)
    line = None if place is None else context.timelines[place]
    start = Start(thing.world_from_object, thing.model, time.seconds_at(time.count - 1), rng, lanes, way=way)
    return Moving(mover(motions, start.playing(line, field)), time)


def _motions(context: SamplingContext, spec: ModelSpec, slot: int) -> tuple[Motions | None, str]:
    """Return the motions of a target, and the recipe's field for them.
    The motions are those of its model, or for a target in company those of the company entry.
    """
    company = context.recipe.scene.company
    if slot and company is not None:
        return company.motion, "scene.company.motion"
    number = context.entries[context.position[spec.key]]
    return context.recipe.models[number].motion, f"models[{number}].motion"


def _rig(
    context: SamplingContext, state: SequenceState, subject: str, start: int, lanes: tuple[Lane, ...], box_of: BoxOf
) -> tuple[RigPose, ...] | None:
    """Return the rig's poses at all instants, None if it stands still."""
    time, views = time_of(context), context.sequences_of(subject)
    times = np.array([time.seconds_at(i) for i in range(time.count)])
    names = (subject, context.pose_list.place(start), *redraw_names(context.redraw))
    world = World(
        time.fps,
        state.focus,
        lambda thing, instant: np.array(_center(state, thing, instant, box_of)),
        partial(generator, context.recipe.seed, "rig", *names),
        lanes,
    )
    if isinstance(views.base, TrajectoryPoses):
        return views.base.trajectory.poses(times, world)
    shake = context.recipe.viewpoints.shake
    if shake is None:
        return None
    follows = context.recipe.viewpoints.target == "follow"
    held = []
    for i in range(time.count):
        at = state.focus_at(i, follows, box_of)
        held.append(steady(context.viewpoint(subject, views[start + i], at), at))
    return shaken(held, shake, times, world)


def _center(state: SequenceState, wanted: int | str, instant: int, box_of: BoxOf) -> Vector:
    """The centre of a thing, given by its id or its model's key, at an instant."""
    pairs = zip(state.things, state.moving, strict=True)
    thing, moving = next((pair for pair in pairs if wanted in (pair[0].id, pair[0].model.key)), (None, None))
    if thing is None:
        raise no_such_thing(wanted, {thing.id: thing.model.key for thing in state.things if thing.id})
    now = _at(thing, moving, instant)
    if not now.is_there:
        raise RecipeError(
            f"viewpoints.look: expected a thing that is there all the time; found {wanted!r}, which is not at instant {instant}"
        )
    return center(now, box_of)


def no_such_thing(wanted: int | str, known: Mapping[int, str]) -> RecipeError:
    """Return the error for a camera that looks at an absent thing; `known` are the keys of the existing things, by their
    numbers.
    """
    there = ", ".join(f"{number} ({key})" for number, key in known.items())
    return RecipeError(
        f"viewpoints.look: expected a thing's number or key: {there}; found {wanted!r}{nearest(wanted, known.values())}"
    )
