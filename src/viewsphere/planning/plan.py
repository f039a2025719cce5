"""The plan: the frames of a recipe, with their order, splits and units of work. No mesh is read."""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from itertools import chain, repeat
from os import PathLike
from pathlib import Path
from typing import Any, Self, TypeVar

import numpy as np

from viewsphere import plugins
from viewsphere.assets.animation.clip import Timeline
from viewsphere.assets.metadata.sidecars import said_of
from viewsphere.composing.composition import BoxOf, Numbering, compose
from viewsphere.composing.filling import filled
from viewsphere.composing.redraws import scene_draws
from viewsphere.composing.scene.pictures import check_pictures, proportions, scene_pictures
from viewsphere.composing.seeds import Names, share
from viewsphere.composing.time_steps import check_keys, timed
from viewsphere.composing.viewpoints.sequence_poses import SequencePoses, poses_of
from viewsphere.errors import RecipeError, each
from viewsphere.model.credit import Credit
from viewsphere.model.fields.notebook import Shown
from viewsphere.model.instant import Instant
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.scene import IDENTITY, Floor
from viewsphere.model.sensors.rig import Rig
from viewsphere.model.shot import Shot
from viewsphere.model.thing import Motion, Thing
from viewsphere.planning.checks.lenses import check_fill, check_lenses, check_rigid
from viewsphere.planning.checks.models import (
    check_all_frames,
    check_distractors,
    check_frames,
    check_recipe,
    check_sizes,
    check_specs,
)
from viewsphere.planning.checks.sequences import check_sequences
from viewsphere.planning.checks.warnings import doubtful_views, unlit
from viewsphere.planning.clips import with_clips
from viewsphere.planning.credits import credits_of, unlicensed
from viewsphere.planning.engine_digest import engine_options, script_digest
from viewsphere.planning.imagers import check_imager
from viewsphere.planning.models import Listing, categories, left_out, numbered_specs, unusable
from viewsphere.planning.rigs import rig_of, with_distances
from viewsphere.planning.samplers import SamplingContext, Standing, lens
from viewsphere.planning.splits import expected, quotas
from viewsphere.planning.tracks import tracks_digest, tracks_of
from viewsphere.plugins.engine import EngineSpec
from viewsphere.plugins.sampler import SamplerSpec
from viewsphere.recipe.draws import span
from viewsphere.recipe.recipe import Recipe
from viewsphere.recipe.world.finish import JitterEntry
from viewsphere.store import Block, Category, Row
from viewsphere.store.index import Index, Ranges, length, numbers, under, without

Made = TypeVar("Made")

COUNTED = 200_000
"""Largest number of frames, or scenes, whose splits are counted one by one."""

SHOT_FRAMES = 16
"""Most frames of a shot, unless the recipe or the caller sets another number."""


@dataclass(frozen=True, eq=False)
class Plan(Shown, SamplingContext):
    """The frames to render: the poses of every subject, in order. Its memory does not grow with the number of frames.

    Attributes:
        categories: The categories of the models, in the order of their ids.
        shot_frames: Most frames of a shot, the unit of rendering and resuming.
        credits: The known credits, by the keys of models that the data set keeps.
        unusable: A warning for each name of a source with models that cannot be used.
    """

    categories: tuple[Category, ...] = ()
    shot_frames: int = SHOT_FRAMES
    credits: Mapping[str, Credit] = field(default_factory=dict[str, Credit])  # known ones, by keys of models that are kept
    unusable: tuple[str, ...] = ()

    @cached_property
    def sampler(self) -> SamplerSpec:
        """The sampler that makes the shots."""
        return plugins.load(SamplerSpec, self.recipe.sampler)

    @property
    def images(self) -> tuple[str, ...]:
        """Absolute paths of the scene's picture files, by field; the composition holds those of planes."""
        return tuple(file for files in self.pictures.values() for file in files)

    @property
    def poses(self) -> int:
        """Number of poses; with movement, over all time steps."""
        return len(self.pose_list)

    @property
    def frames(self) -> int:
        """Number of frames."""
        return self.rows.samples

    @property
    def time_steps(self) -> int | None:
        """Time steps that all models have, 0 if nothing moves; None if they have different numbers."""
        counts = {len(timing.steps) if timing else 0 for timing in self.timings}
        return counts.pop() if len(counts) == 1 else None if counts else 0

    @property
    def factors(self) -> str:
        """The factors whose product is the number of frames, in words."""
        sensors = len(self.rig.sensors)
        more = {"sensors": sensors if sensors > 1 else 0, "variations": len(self.recipe.variations or ())}
        return self.sampler.factors(self) + "".join(f" x {count} {what}" for what, count in more.items() if count)

    @property
    def max_objects(self) -> int:
        """Most objects in one frame."""
        scenery = 0 if self.composition is None else self.composition.most_scenery
        return self.sampler.most_objects(self.recipe) + scenery

    @property
    def kept_specs(self) -> tuple[ModelSpec, ...]:
        """The models that the data set keeps: the recipe's, then labelled scenery's."""
        return self.model_specs + (() if self.composition is None else self.composition.models)

    @property
    def kept_keys(self) -> Iterator[tuple[str, ModelSpec]]:
        """The keys of all models that the data set keeps, and of their time steps."""
        for spec in self.kept_specs:
            frames = (None, *(step.frame for step in self.steps_of(spec)))
            yield from ((spec.key_at(frame), spec) for frame in frames)

    @property
    def splits(self) -> tuple[str, ...]:
        """Names of the splits, in the recipe's order."""
        return tuple(self.recipe.splits.shares)

    @cached_property
    def split_counts(self) -> dict[str, int]:
        """Split -> number of its frames; for more than `COUNTED` hashed frames, the expected number."""
        by, drawn = self.recipe.splits.by, self.recipe.scenes is not None and self.recipe.splits.by == "model"
        counts = Counter({name: 0 for name in self.splits})
        if by in ("model", "scene", "sequence") and not (drawn and len(self.varied_subjects) > COUNTED):
            for block in self.blocks:
                for subject in block.subjects:
                    counts[self.split(subject, block.positions[0][0])] += block.size * block.each
        elif drawn:
            some = Counter(self.split(subject, 0) for subject in self.varied_subjects[:COUNTED])
            counts = Counter(quotas({name: some[name] / COUNTED for name in self.splits}, self.frames))
        elif by == "pose" and len(self.blocks) == 1 and self.poses <= COUNTED:
            for pose in numbers(self.blocks[0].positions):
                counts[self.split(self.varied_subjects[0], pose)] += len(self.varied_subjects) * len(self.rig.sensors)
        elif self.frames <= COUNTED:
            taken = (self.split(s, i) for block in self.blocks for s in block.subjects for i in numbers(block.positions))
            counts.update(chain.from_iterable(repeat(name, len(self.rig.sensors)) for name in taken))
        else:
            counts = Counter(expected(self.recipe.splits, self.frames))
        return {name: counts[name] for name in self.splits}

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """The warnings about settings that are probably unintended."""
        by = self.recipe.splits.by
        warnings = [
            f"split {name!r} is empty: {_empty(self.recipe.splits.shares[name], by)}"
            for name, count in self.split_counts.items()
            if count == 0
        ]
        scene = self.recipe.scene
        lowest = self.pose_list.lowest_elevation + min(span(scene.jitter.elevation)[0], 0.0)
        if lowest < 0 and (scene.has_ground or scene.place is not None):
            warnings.append(
                f"elevations go down to {lowest:g}: from below, the ground hides the models; set scene.ground: off to see them"
            )
        for name, recipe in self.recipe.conditions.items():
            warnings += (
                message.replace("scene", f"variations.{name}", 1) if name else message for message in unlit(recipe.scene)
            )
        doubts = doubtful_views(self.recipe, self.pose_list, self.rig)
        if self.blend is not None:
            warnings += self.blend.warnings
        warnings += (*self.unusable, *left_out(self.recipe))
        return tuple(map(self.recipe.locate, (*self.recipe.warnings, *warnings, *doubts)))

    @property
    def notes(self) -> tuple[str, ...]:
        """The notes for publishing: missing licences of models; and the effects of format options on the data set."""
        options = chain.from_iterable(entry.notes(self.categories) for entry in self.recipe.formats)
        return (*unlicensed((spec.key for spec in self.kept_specs), self.credits), *options)

    def split(self, subject: str, pose: int) -> str:
        """The split of a frame.

        Args:
            subject: The subject, one of `varied_subjects`.
            pose: The number of the pose, counted from 0.

        Returns:
            The name of the split.
        """
        return self.sampler.split(self, self.world(subject), pose)

    def keeping(self, splits: Mapping[str, str], poses: Sequence[int] = ()) -> Plan:
        """The plan for a data set that has some of its models, scenes and sequences in these splits, and uses these numbers for
        the plan's poses.
        """
        numbered = self if not isinstance(self.pose_list, SequencePoses) else self._numbering(self.pose_list.instants, poses)
        kept = {key: name for key, name in splits.items() if key in numbered.dealt_splits}
        return _composed(numbered.changed(kept_splits=kept)) if kept else numbered

    def changed(self, **fields: Any) -> Self:
        """The plan with other values of fields that do not affect its blocks, which are not computed again."""
        changed_plan = replace(self, **fields)
        if "blocks" in vars(self):
            vars(changed_plan)["blocks"] = self.blocks
        return changed_plan

    def _numbering(self, instants: int, poses: Sequence[int]) -> Plan:
        """The plan with its sequences numbered as in a data set that has these numbers for their poses."""
        numbers = tuple(pose // instants for pose in poses[::instants])
        return self if numbers == tuple(range(len(numbers))) else _composed(self.changed(sequence_numbers=numbers))

    @cached_property
    def blocks(self) -> tuple[Block, ...]:
        """The blocks of subjects and their poses, time step by time step, each for all sensors."""
        blocks = (replace(block, each=len(self.rig.sensors)) for block in self.sampler.blocks(self))
        return tuple(replace(block, subjects=self._taken(block.subjects)) for block in blocks)

    @cached_property
    def varied_subjects(self) -> tuple[str, ...]:
        """The subjects of pictures; with variations, each subject under each variation."""
        return self._taken(self.subjects)

    def _taken(self, subjects: Sequence[str]) -> tuple[str, ...]:
        names = tuple(self.recipe.variations or ("",))
        return tuple(under(subject, name) for subject in subjects for name in names)

    def world(self, subject: str) -> str:
        """The subject without its variation."""
        return subject if self.recipe.variations is None else without(subject)[0]

    @cached_property
    def _under(self) -> Mapping[str, Self]:
        """The plan under each variation; all share computed values, except light and finish."""
        return {name: self._with_variation(recipe, name) for name, recipe in self.recipe.conditions.items()}

    def _with_variation(self, recipe: Recipe, variation: str) -> Self:
        """Return the plan of one variation; the two share all values that do not depend on the scene."""
        varied = replace(self, recipe=recipe, original=self, variation=variation)
        known = {field.name for field in fields(self)} | {"scenes", "varied_subjects", "blocks", "rows", "_under"}
        vars(varied).update({name: value for name, value in vars(self).items() if name not in known})
        return varied

    @cached_property
    def rows(self) -> Index:
        """The index of all shots."""
        return Index(self.blocks, 0, self.shot_frames, 0)

    @property
    def shot_count(self) -> int:
        """Number of shots."""
        return len(self.rows)

    def shot(self, row: Row | int, box_of: BoxOf, redraws: Sequence[int] = (), redraw: int = 0) -> Shot:
        """The shot of a row, with room for all its objects.

        Args:
            row: A row of `rows`, or its number, counted from 0.
            box_of: A function that returns the box of a model, for things on the floor and targets of cameras.
            redraws: The number of redraws of each pose's random values (its viewpoint, its own company); empty: no redraws.
            redraw: The first draw of the scene to try.

        Returns:
            The shot in the first draw of its scene, from `redraw` on, that has enough room.

        Raises:
            IndexError: There is no row of this number.
            RecipeError: No draw has enough room. Errors of `box_of` pass through.
        """
        row = self.rows[row] if isinstance(row, int) else row
        return self.take(row.subject, tuple(numbers(row.positions)), box_of, row.key, row.first, redraws, redraw)

    def take(
        self,
        subject: str,
        poses: Sequence[int],
        box_of: BoxOf,
        key: str = "",
        first: int = 0,
        redraws: Sequence[int] = (),
        redraw: int = 0,
    ) -> Shot:
        """A shot of some poses (their numbers) of a subject at one time step: a single pose if the recipe draws scenes for each
        frame. `first` is the number of its first sample, `redraws` and `redraw` as for `shot`.
        """
        key = key or f"{subject}-{poses[0]:06d}"
        names = (self.world(subject), self.scene_pose(poses[0]) or "")
        return self._fitting(redraw, lambda number: self._taken_at(number, subject, poses, box_of, key, first, redraws), names)

    def standing(self, subject: str, box_of: BoxOf) -> Sequence[Standing]:
        """The places of a subject's objects, as far as known before rendering, in the first draw with enough room."""
        return self._fitting(
            0, lambda number: tuple(self.sampler.standing(self.redrawn(number), subject, box_of)), (subject, "")
        )

    def _fitting(self, redraw: int, make: Callable[[int], Made], names: Names = ()) -> Made:
        """The result of the first fitting draw of a scene, from this number on; raises the first draw's RecipeError if none
        fits. `names` identify a scene whose first fitting draw is cached for later calls.
        """
        problems: list[RecipeError] = []
        for number in range(max(redraw, self._fits.get(names, 0)), max(redraw + 1, self.draws)):
            try:
                fitting = make(number)
            except RecipeError as error:
                problems.append(error)
                continue
            if names and redraw == 0 and number:
                self._fits[names] = number
            return fitting
        raise problems[0]

    @cached_property
    def _fits(self) -> dict[Names, int]:
        """Cache: the first fitting draw of each scene whose original draw does not fit."""
        return {}

    @cached_property
    def draws(self) -> int:
        """The number of draws of each scene, the original included."""
        return scene_draws(self.recipe)

    def whole(self, row: Row) -> Row | None:
        """All poses of a row's scene, or sequence, as one row; None if the row has all of them, or if no redraw affects all."""
        if self.draws == 1 or (self.recipe.time is None and self.recipe.scene.is_moved_each_frame):
            return None
        positions, each = self._positions[row.subject], len(self.rig.sensors)
        if isinstance(self.pose_list, SequencePoses):
            start = row.positions[0][0] - row.positions[0][0] % self.pose_list.instants
            positions = ((start, start + self.pose_list.instants),)
        if positions == row.positions:
            return None
        return Row(row.subject, row.subject, 0, length(positions) * each, row.part, positions)

    @cached_property
    def _positions(self) -> dict[str, Ranges]:
        """The poses of each subject, at its first time step."""
        return {subject: block.positions for block in reversed(self.blocks) for subject in block.subjects}

    def _taken_at(
        self, redraw: int, subject: str, poses: Sequence[int], box_of: BoxOf, key: str, first: int, redraws: Sequence[int]
    ) -> Shot:
        variation, context = "", self
        if self.recipe.variations is not None:
            subject, variation = without(subject)
            context = self._under[variation]
        context = context.redrawn(redraw)
        context = context.with_redraws(dict(zip(poses, redraws, strict=True))) if any(redraws) else context
        with self.recipe.located():
            made = self.sampler.shot(context, subject, poses, box_of, key, first)
            shot = _off_center(context, subject, filled(made, self.recipe.scenes is not None))
            if variation:
                named = {"variation": variation, "sequence": shot.sequence and under(shot.sequence, variation)}
                shot = shot.model_copy(update=named)
            if self.recipe.empty is None:
                return shot
            shares = (share(self.recipe.seed, "empty", subject, self.pose_list.name(pose)) for pose in poses)
            return _emptied(shot, [number < self.recipe.empty for number in shares], box_of)

    def cast(self, subject: str, pose: int | None = None) -> tuple[ModelSpec, ...]:
        """The recipe's models in a frame of a subject, from a pose (its number); without a pose, the models in all of its
        frames.
        """
        return self.sampler.cast(self, self.world(subject), pose)

    def shots(self, box_of: BoxOf) -> Iterator[Shot]:
        """Yield all shots in order, made one by one.

        Args:
            box_of: A function that returns the box of a model, as for `shot`.

        Returns:
            An iterator over the shots.

        Raises:
            RecipeError: A shot has not enough room. Errors of `box_of` pass through.
        """
        return (self.shot(row, box_of) for row in self.rows)

    @cached_property
    def digest(self) -> str:
        """SHA-256 of everything that determines a store of this plan: the recipe, the models, the backgrounds and the chunks.

        Files are identified by their names, so that folders can move; the store itself checks the content of model files.
        """
        planes = () if self.composition is None else self.composition.images
        value = [
            self.recipe.digest,
            [_by_name(spec) for spec in self.kept_specs],
            [_by_name(spec) for spec, _ in self.distractors],
            self.pose_list.digest,
            [Path(image).name for files in (self.images, *planes) for image in files],
            self.shot_frames,
            None if self.blend is None else self.blend.digest,
            script_digest(self.recipe),
            None if self.own_rig is None else self.own_rig.model_dump(mode="json"),
            None if self.tracks is None else tracks_digest(self.tracks),
        ]
        return hashlib.sha256(json.dumps(value, separators=(",", ":")).encode()).hexdigest()


def _by_name(spec: ModelSpec) -> dict[str, Any]:
    return spec.model_dump(mode="json") | {"source": Path(spec.source).name}


def plan(recipe: Recipe | str | PathLike[str], shot_frames: int | None = None) -> Plan:
    """Return the plan of a recipe, frame by frame, without reading a mesh.

    Args:
        recipe: The recipe, or the path or URL of its file.
        shot_frames: Most frames of a shot, for recipes without their own setting.

    Returns:
        The number, order, splits and units of work of all frames. Its memory does not grow with their number.

    Raises:
        RecipeError: A field is invalid, a file is missing, an engine or format is unknown, or the plan exceeds `max_frames`.
    """
    recipe = Recipe.ensure(recipe)
    with recipe.located():
        check_recipe(recipe)
        check_imager(recipe)
        views = poses_of(recipe.viewpoints, recipe.time, recipe.seed, recipe.folder)
        own = lens(recipe, views)
        rig = rig_of(recipe, own)
        recipe = with_distances(recipe, rig or Rig.single(own))
        if rig is None:  # those of a rig are checked together with it
            check_lenses(recipe, Rig.single(own))
        check_fill(recipe, rig or Rig.single(own), views)
        listing = Listing(recipe)
        check_frames(recipe, views, listing)
        found = numbered_specs(recipe, listing)
        numbered = tuple((spec, number) for spec, number in found if spec.category_id)
        distractors = tuple((spec, number) for spec, number in found if not spec.category_id)
        check_distractors(recipe)
        specs, timings, views = timed(recipe, numbered, views)
        lines: tuple[Timeline | None, ...] = (None,) * len(specs)
        if recipe.time is not None:
            specs, lines = with_clips(recipe, numbered)
            check_rigid(recipe, specs, lines)
        check_specs(recipe, specs)
        most = recipe.shot_frames or shot_frames or SHOT_FRAMES
        frames = 1 if recipe.is_new_each_frame and recipe.time is None else most
        timings = timings if any(timings) else ()
        sampler = plugins.load(SamplerSpec, recipe.sampler)
        check_sizes(recipe, views, sampler)
        planned = Plan(
            recipe,
            specs,
            views,
            scene_pictures(recipe),
            sampler.subjects(recipe, specs),
            timings=timings,
            categories=categories(recipe, listing),
            unusable=tuple(unusable(listing)),
            shot_frames=frames,
            own_rig=rig,
            entries=tuple(number for _, number in numbered),
            timelines=lines,
            distractors=distractors,
            tracks=tracks_of(recipe, rig or Rig.single(lens(recipe, views))),
        )
        check_all_frames(recipe, planned.frames, planned.factors)
        if timings or any(lines):
            check_keys(planned.kept_keys)
        planned = _composed(planned)
        if recipe.time is not None:
            check_sequences(planned, planned.sampler)
        return planned.changed(credits=_credits(planned))


def _credits(planned: Plan) -> dict[str, Credit]:
    """The known credits of the models that a plan keeps."""
    entries = zip(planned.model_specs, planned.entries, strict=True)
    credits = {spec.key: planned.recipe.models[number].credit for spec, number in entries}
    return credits_of(planned.kept_specs, {key: credit for key, credit in credits.items() if credit is not None})


def _composed(planned: Plan) -> Plan:
    """The plan with the surroundings of its models. With splits by model, a frame shows only models of one split."""
    recipe, specs = planned.recipe, planned.model_specs
    if not recipe.scene.is_composed:
        return planned
    dealt = planned.dealt_splits if recipe.splits.by == "model" else {}
    splits = [dealt.get(spec.key, "") for spec in specs]
    numbering = Numbering(planned.subjects, planned.pose_list, planned.schedules if planned.timings else ())
    composition = compose(recipe, planned.subjects, specs, categories(recipe), splits, numbering)
    return planned.changed(categories=composition.categories, composition=composition)


def check_engine(recipe: Recipe) -> None:
    """Check that the engine accepts its options; raises UserError if it does not, or if its extra is missing."""
    engine = plugins.load(EngineSpec, recipe.engine.name)
    with recipe.located():
        engine.check(engine_options(recipe))


def check_sidecars(planned: Plan) -> None:
    """Check that the models' sidecars are valid; raises ModelError, a line per error. No model is read."""
    each(said_of, planned.kept_specs)


def check_images(planned: Plan) -> None:
    """Check that the picture files of the scene and its planes are pictures; raises RecipeError for the first that is not."""
    with planned.recipe.located():
        check_pictures(planned.recipe, planned.pictures)
        for i, files in enumerate(() if planned.composition is None else planned.composition.images):
            field = "images" if planned.recipe.scene.planes[i].image is None else "image"
            for path in files:
                proportions(path, f"scene.planes[{i}].{field}")


def _emptied(shot: Shot, empty: Sequence[bool], box_of: BoxOf) -> Shot:
    """A shot of still pictures without its targets at the `empty` instants; scenery and ground remain.

    All shots of such a recipe use this function, also those without an empty picture: the rendering of a thing must not depend
    on the other pictures of its shot.
    """
    things = tuple(_absent(thing, empty) if thing.is_target else thing for thing in shot.things)
    scene = shot.scene
    if scene.ground is not None:
        height = _lowest(shot, box_of) if scene.floor is None else scene.floor.height
        scene = scene.model_copy(update={"floor": Floor(height=height, is_fixed=True)})
    return shot.model_copy(update={"things": things, "scene": scene})


def _lowest(shot: Shot, box_of: BoxOf) -> float:
    """The lowest point of a single model, whose axes are the world's; placed things stand on z = 0."""
    first = shot.things[0]
    return float(box_of(first.model, first.step)[:, 2].min()) + 0.0 if first.world_from_object == IDENTITY else 0.0


def _absent(thing: Thing, empty: Sequence[bool]) -> Thing:
    """The still thing, absent at the `empty` instants."""
    at = thing.motion.poses[0]
    motion = Motion(poses=tuple(None if is_empty else at for is_empty in empty), steps=thing.motion.steps, moves=True)
    return thing.model_copy(update={"motion": motion})


def _off_center(context: SamplingContext, subject: str, shot: Shot) -> Shot:
    """The shot with its cameras moved in their picture planes by the recipe's jitter. Their targets keep the distance along the
    camera's axis, and so their size. Cameras without their own viewpoint do not move.
    """
    if context.recipe.scene.jitter.off_center == JitterEntry().off_center:
        return shot
    instants = tuple(_moved(context, subject, shot, i) for i in range(len(shot.instants)))
    return shot.model_copy(update={"instants": instants})


def _moved(context: SamplingContext, subject: str, shot: Shot, i: int) -> Instant:
    now, lens = shot.instants[i], shot.camera(i).intrinsics
    view = now.viewpoint
    if view is None:
        return now
    right, down = context.scenes.jitter(subject, context.jitter_name(view.index)).off_center
    pose = np.array(now.world_from_rig)
    away = 1.0 if lens.lens.is_parallel else view.distance
    x, y = -right * lens.width * away / lens.fx, -down * lens.height * away / lens.fy
    by = x * pose[:3, 0] + y * pose[:3, 1]
    pose[:3, 3] += by
    target = tuple((np.array(view.target or now.focus) + by).tolist())
    rows = tuple(map(tuple, pose.tolist()))
    return now.model_copy(
        update={"world_from_rig": rows, "focus": target, "viewpoint": view.model_copy(update={"target": target})}
    )


def _empty(share: object, by: str) -> str:
    """The reason why a split with this share is empty, and the fix."""
    if share == "set":
        return "no model's set lists it. Leave it out, or give it a share or a list of models"
    return f"too few {by}s for its share; list models for it, or split by something else"
