"""The checks that refuse sequences before a model is read, as far as the recipe allows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from viewsphere.composing.layouts import has_ways
from viewsphere.composing.motion import Lane
from viewsphere.composing.scene.scenery import SCENERY, SceneryPiece, draw_names, place_pieces
from viewsphere.composing.seeds import generator
from viewsphere.composing.trajectories import World
from viewsphere.composing.viewpoints.sequence_poses import SequencePoses, TrajectoryPoses
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import IDENTITY, Matrix4
from viewsphere.model.thing import Thing
from viewsphere.planning.samplers.shared.sampling_context import SamplingContext
from viewsphere.planning.samplers.shared.sequence_state import no_such_thing, piece_moving, target_moving, time_of
from viewsphere.plugins.sampler import SamplerSpec
from viewsphere.recipe.world.scenes import ScenesEntry

MOST_SUBJECTS = 1000
"""Number of subjects that are checked before rendering, the first ones; the others are checked when their shots are made."""

UNKNOWN = (np.nan, np.nan, np.nan)
"""Placeholder position of a thing whose model was not read."""


def check_sequences(planned: SamplingContext, sampler: SamplerSpec) -> None:
    """Raise RecipeError for missing lanes, for cameras that look at absent things, and for impossible motions.

    The first sequence of each subject is checked; motions drawn for later sequences are checked when these are made.
    """
    checked = set[str]()
    for subject in planned.subjects[:MOST_SUBJECTS]:
        cast = sampler.cast(planned, subject, 0)
        lanes = () if planned.composition is None else planned.composition.lanes(subject, planned.scene_pose(0))
        _check_trajectory(planned, subject, cast, lanes)
        _check_motions(planned, subject, cast, lanes, checked)
    _check_pieces(planned)


def _check_trajectory(planned: SamplingContext, subject: str, cast: Sequence[ModelSpec], lanes: tuple[Lane, ...]) -> None:
    """Compute the rig's pose at the first and at the last instant, with placeholder positions of the things."""
    assert isinstance(planned.pose_list, SequencePoses)
    if not isinstance(planned.pose_list.base, TrajectoryPoses):
        return
    time, names = time_of(planned), (subject, planned.pose_list.place(0))

    def center(wanted: int | str, instant: int) -> np.ndarray:
        _check_thing(planned, wanted, cast)
        return np.array(UNKNOWN)

    world = World(time.fps, UNKNOWN, center, partial(generator, planned.recipe.seed, "rig", *names), lanes)
    planned.pose_list.base.trajectory.poses(np.unique([0.0, time.seconds_at(time.count - 1)]), world)


def _check_thing(planned: SamplingContext, wanted: int | str, cast: Sequence[ModelSpec]) -> None:
    """Check that the thing that the camera looks at exists. It may also be scenery, which is known only once placed."""
    known = {number: spec.key for number, spec in enumerate(cast, 1)}
    scenery = planned.composition
    if isinstance(wanted, int):
        is_there = wanted <= len(known) + (0 if scenery is None else scenery.most_scenery)
    else:
        is_there = wanted in known.values() or (scenery is not None and wanted.startswith(SCENERY))
    if not is_there:
        raise no_such_thing(wanted, known)


def _check_motions(
    planned: SamplingContext, subject: str, cast: Sequence[ModelSpec], lanes: tuple[Lane, ...], checked: set[str]
) -> None:
    """Make the motions of the models, once for each model."""
    names = (subject, planned.pose_list.place(0))
    company, scenes = planned.recipe.scene.company, planned.recipe.scenes
    entry = scenes if isinstance(scenes, ScenesEntry) else company
    falls = entry is not None and has_ways(entry.layout)
    for slot, spec in enumerate(cast):
        if spec.key not in checked:
            checked.add(spec.key)
            way = _nowhere if falls and (slot or scenes is not None) else None
            target_moving(planned, Thing(id=slot + 1, model=spec), slot, names, lanes, way)


def _nowhere(seconds: float) -> Matrix4:
    """The placeholder pose of a thing whose path is not computed yet."""
    return IDENTITY


def _check_pieces(planned: SamplingContext) -> None:
    """Make the motions of a place's pieces, once for each pattern."""
    subject, pose = planned.subjects[0], planned.scene_pose(0)
    names = (subject, planned.pose_list.place(0))
    lanes = () if planned.composition is None else planned.composition.lanes(subject, pose)
    for piece in {piece.field: piece for piece in _pieces(planned, subject, pose)}.values():
        piece_moving(planned, Thing(id=0, model=piece.model), piece, names, lanes)


def _pieces(planned: SamplingContext, subject: str, pose: str | None) -> Iterator[SceneryPiece]:
    place = planned.recipe.scene.place
    if place is not None:
        yield from place_pieces(planned.recipe, place, draw_names(place.draw, subject, pose), lambda category, labels: 0)
