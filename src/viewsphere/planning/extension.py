"""Parts of a data set: the frames that a recipe adds to the existing ones, and their rendering by its plan.

A frame is identified by its model's key and its pose, and a pose by its name and the camera's position. A part holds the models
x poses of its recipe without those of earlier parts. New poses, frames, categories and models continue the numbering; nothing
is renumbered.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from importlib.metadata import version
from itertools import chain, groupby
from typing import TYPE_CHECKING

import numpy as np

from viewsphere.composing.composition import BoxOf
from viewsphere.composing.sendable import Sendable
from viewsphere.composing.viewpoints.pose_numbers import (
    Indices,
    as_ranges,
    follows_from_recipe,
    has_poses_of,
    joined_digests,
    numbered,
)
from viewsphere.errors import RecipeError
from viewsphere.model.instant import Instant
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.shard import ALL, Shard
from viewsphere.model.shot import Shot
from viewsphere.model.thing import TimeStep
from viewsphere.planning.fitting import check_fit, settings
from viewsphere.planning.plan import Plan
from viewsphere.store import Block, Category, Part, PlanRecord, Row
from viewsphere.validation.quantity import quantity

if TYPE_CHECKING:
    from viewsphere.store import Store
from viewsphere.composing.viewpoints.pose_numbers import names_of
from viewsphere.store.index import Index, Ranges, numbers


@dataclass(frozen=True, eq=False)
class DatasetPart(Sendable):
    """A part of a data set, and the plan of its recipe, which renders it. `record` describes the whole data set.

    A run may have a `shard` of it: every n-th shot of each index, finished or not.
    """

    plan: Plan
    record: PlanRecord
    number: int
    shard: Shard = ALL

    @property
    def part(self) -> Part:
        """The part."""
        return self.record.parts[self.number]

    @property
    def adds_nothing(self) -> bool:
        """Return whether the data set had everything in the recipe before."""
        return not self.part.frames and not self.part.supplies

    def remembering(self, store: Store) -> DatasetPart:
        """The same part, which keeps its simulation results in the store."""
        from viewsphere.store import Simulated  # which loads what reads stores

        return replace(self, plan=self.plan.changed(memory=Simulated(store.root)))

    def __str__(self) -> str:
        """Return the additions of the part, in words."""
        plan, part = self.plan, self.part
        there = plan.frames - part.frames
        less = f" less {there:,} that are there" if there else ""
        text = f"adds {quantity(part.frames, 'frame')} ({plan.factors}{less})"
        for number, channels in part.supplies:
            text += f", and {', '.join(channels)} to {quantity(self.record.parts[number].frames, 'frame')} that are there"
        return text

    @cached_property
    def models(self) -> tuple[tuple[ModelSpec, tuple[TimeStep, ...]], ...]:
        """The recipe's kept models, with the data set's category numbers, and their time steps. A shard has the models of its
        shots and its shard of all models, so that the shards together have every model.
        """
        kept = enumerate(self.plan.kept_specs)
        specs = (spec for i, spec in kept if self.shard.is_all or self.shard.has(i) or spec.key in self._needed)
        return tuple((self._numbered(spec), self.plan.steps_of(spec)) for spec in specs)

    @cached_property
    def _needed(self) -> frozenset[str]:
        """Keys of the models that may be in the shots; the search stops once all models are found."""
        around = () if self.plan.composition is None else self.plan.composition.models
        needed, every = {spec.key for spec in around}, {spec.key for spec in self.plan.kept_specs}
        for row in self._told_apart:
            needed.update(spec.key for spec in self.cast(row))
            if every <= needed:
                break
        return frozenset(needed)

    @property
    def _told_apart(self) -> Iterator[Row]:
        """The shots, without those that show the same models as another shot."""
        if self.plan.recipe.scene.is_moved_each_frame:
            return self.rows
        return (next(index.rows_of(subject)) for index in self.indices for subject, shots in index.counts.items() if shots)

    @cached_property
    def indices(self) -> tuple[Index, ...]:
        """The indices of the shots: of its own ones, then of those with channels of older frames."""
        return tuple(replace(index, shard=self.shard) for index in self.record.indices_of(self.number))

    @property
    def rows(self) -> Iterator[Row]:
        """The shots, in the order of their indices."""
        return chain.from_iterable(self.indices)

    @cached_property
    def subjects(self) -> tuple[str, ...]:
        """The subjects of the shots, each once; of the whole part, all subjects of the plan."""
        if self.shard.is_all:
            return self.plan.varied_subjects
        return tuple(dict.fromkeys(subject for index in self.indices for subject, shots in index.counts.items() if shots))

    def find(self, key: str) -> Row | None:
        """The row of this key among the shots, None if there is none."""
        return next((row for row in (index.find(key) for index in self.indices) if row is not None), None)

    def cast(self, row: Row) -> tuple[ModelSpec, ...]:
        """The recipe's models in a shot, the frames' own model first."""
        return self.plan.cast(row.subject, self._of_recipe(row.positions[0][0]))

    def shot(self, row: Row, box_of: BoxOf, redraws: Sequence[int] = (), redraw: int = 0) -> Shot:
        """The shot of a row; `box_of`, `redraws`, `redraw` and errors as for `Plan.shot`."""
        poses = tuple(numbers(row.positions))
        poses_of_recipe = [self._of_recipe(pose) for pose in poses]
        taken_shot = self.plan.take(row.subject, poses_of_recipe, box_of, row.key, row.first, redraws, redraw)
        number_of = iter(poses)
        instants = (_at_pose(now, next(number_of)) if now.recorded else now for now in taken_shot.instants)
        return taken_shot.model_copy(
            update={
                "things": tuple(thing.model_copy(update={"model": self._numbered(thing.model)}) for thing in taken_shot.things),
                "instants": tuple(instants),
                "channels": self._channels(row.first),
            }
        )

    def whole(self, row: Row) -> Row | None:
        """Return all poses that the recipe has of a row's scene, in the recipe's numbers, as for `Plan.whole`."""
        return self.plan.whole(replace(row, positions=as_ranges(np.array(list(map(self._of_recipe, numbers(row.positions)))))))

    def _channels(self, frame: int) -> tuple[str, ...]:
        return dict(self.part.supplies).get(self.record.part_of(frame), self.part.channels)

    def _of_recipe(self, pose: int) -> int:
        """The recipe's number of a pose of the data set."""
        return pose if self._recipe_numbers is None else int(self._recipe_numbers[pose])

    @cached_property
    def _recipe_numbers(self) -> Indices | None:
        """The recipe's number of every pose of the data set, -1 for poses that the recipe lacks. None if recipe and data set
        number their poses equally.
        """
        if has_poses_of(self.record, self.plan.pose_list):
            return None
        wanted, _ = numbered(self.record, self.plan.pose_list)
        of_recipe = np.full(self.record.poses, -1, np.int64)
        of_recipe[wanted] = np.arange(len(wanted))
        return of_recipe[_first_numbers(self.record)]

    @cached_property
    def _category_ids(self) -> dict[str, int]:
        return {category.name: category.id for category in reversed(self.record.categories)}

    def _numbered(self, spec: ModelSpec) -> ModelSpec:
        if not spec.category_id:
            return spec  # background
        return spec.model_copy(update={"category_id": self._category_ids[spec.category]})


def _at_pose(now: Instant, pose: int) -> Instant:
    """The instant with the data set's number of its pose."""
    return now.model_copy(update={"viewpoint": now.viewpoint and now.viewpoint.model_copy(update={"index": pose})})


NOTHING = PlanRecord("", "", "", {}, (), (), (), (), 0, 0, 0)
"""A data set without parts."""


def whole(planned: Plan) -> DatasetPart:
    """A recipe's plan as the only part of a data set."""
    return extend(planned, NOTHING)


def resumed(planned: Plan, there: PlanRecord, number: int) -> DatasetPart:
    """An earlier part of a data set, resumed with its plan."""
    wanted, _ = numbered(there, planned.pose_list)
    return DatasetPart(planned.keeping(_splits(there.parts[:number]), wanted), there, number)


def extend(planned: Plan, there: PlanRecord) -> DatasetPart:
    """Return the additions of a recipe to a data set, as its new last part.

    Raises RecipeError if the recipe's pictures or labels do not fit the existing ones.
    """
    with planned.recipe.located():
        check_fit(planned, there)
        held_splits = _splits(there.parts)
        wanted, names = numbered(there, planned.pose_list)
        planned = planned.keeping(held_splits, wanted)
        blocks = tuple(_missing(planned, there, wanted))
        supplies = tuple(_supplies(planned, there, wanted))
        categories = _categories(planned, there)
    poses = len(names) if there.poses or len(names) else len(wanted)
    part = Part(
        digest=planned.digest,
        version=version("viewsphere"),
        name=planned.recipe.name,
        recipe=planned.recipe.model_dump(mode="json"),
        channels=_joined(there.channels, planned.recipe.channels),
        first=there.frames,
        frames=sum(block.samples for block in blocks),
        max_objects=planned.max_objects,
        blocks=blocks,
        sampler=planned.recipe.sampler,
        supplies=supplies,
        shot_frames=planned.shot_frames,
        settings=settings(planned),
        new_poses=poses,
        pose_names=None if not there.poses and follows_from_recipe(planned.pose_list) else joined_digests(names),
        dealt_splits={key: name for key, name in planned.dealt_splits.items() if key not in held_splits},
    )
    record = PlanRecord(
        version=part.version,
        digest=part.digest,
        name=part.name,
        recipe=part.recipe,
        categories=categories,
        splits=_joined(there.splits, planned.splits),
        channels=part.channels,
        models=_joined(there.models, (spec.key for spec in planned.kept_specs)),
        poses=there.poses + poses,
        frames=there.frames + part.frames,
        max_objects=max(there.max_objects, planned.max_objects),
        parts=(*there.parts, part),
    )
    return DatasetPart(planned, record, len(there.parts))


def _splits(parts: Sequence[Part]) -> dict[str, str]:
    """The split of every model, scene or sequence in these parts, if splits are by one of these."""
    return {key: split for part in parts for key, split in part.dealt_splits.items()}


def _categories(planned: Plan, there: PlanRecord) -> tuple[Category, ...]:
    """The data set's categories, then the recipe's new ones with the next numbers; names identify categories."""
    categories = {category.name: category for category in reversed(there.categories)}  # imported ones may share a name
    added: list[Category] = []
    number = max((category.id for category in there.categories), default=0)
    for category in planned.categories:
        known = categories.get(category.name)
        if known is None:
            number += 1
            categories[category.name] = replace(category, id=number)
            added.append(categories[category.name])
        elif known.supercategory != category.supercategory:
            raise RecipeError(
                f"models: expected supercategory {known.supercategory!r} for category {category.name!r}, as the data set has; "
                f"found {category.supercategory!r}"
            )
    return (*there.categories, *added)


def _missing(planned: Plan, there: PlanRecord, wanted: Sequence[int]) -> Iterator[Block]:
    """Blocks of the frames that the data set lacks: subjects in the plan's order, poses in the data set's."""
    if not there.parts:
        yield from planned.blocks
        return
    held: defaultdict[str, list[Ranges]] = defaultdict(list)
    for block in chain.from_iterable(part.blocks for part in there.parts if part.is_sampled):
        for key in block.subjects:
            held[key].append(block.positions)
    first_of, asked = _first_numbers(there), np.array(wanted, np.int64)

    @cache
    def lack(positions: Ranges, has: tuple[Ranges, ...]) -> Ranges:
        return as_ranges(np.setdiff1d(asked[_flat(positions)], first_of[_flat(chain.from_iterable(has))]))

    for block in planned.blocks:
        for poses, subjects in groupby(block.subjects, lambda key, block=block: lack(block.positions, tuple(held[key]))):
            if poses:
                yield Block(tuple(subjects), poses, block.each)


def _supplies(planned: Plan, there: PlanRecord, wanted: Sequence[int]) -> Iterator[tuple[int, tuple[str, ...]]]:
    """Wanted channels that frames of earlier parts lack: the part's number, and the channels in the table's order."""
    subjects = set(planned.varied_subjects)
    for number, part in enumerate(there.parts):
        if not part.is_sampled or not part.frames:
            continue
        _check_annotations(planned, part)
        lacking = tuple(c for c in planned.recipe.channels if c not in there.channels_of(number))
        if not lacking:
            continue
        shown = set(part.subjects)
        absent = shown - subjects
        poses = np.unique(_first_numbers(there)[_flat(chain.from_iterable(block.positions for block in part.blocks))])
        asked = np.array(wanted, np.int64)
        together = planned.recipe.scene.company is not None and subjects != shown
        if not part.is_product:
            together = planned.recipe.model_dump(mode="json")["models"] != part.recipe["models"]
        problem = (
            f"no {'model' if part.is_product else 'scene'} {min(absent)!r}"
            if absent
            else f"only {len(np.intersect1d(asked, poses)):,} of {quantity(len(poses), 'pose')}"
            if not np.isin(poses, asked).all()
            else f"{'company' if part.is_product else 'scenes'} drawn from other models"
            if together
            else None
        )
        if problem:
            raise RecipeError(
                f"channels: expected all models and poses of the data set in the recipe, to add {lacking[0]} to its frames; "
                f"found {problem}: list them, or leave {lacking[0]} out"
            )
        yield number, lacking


def _check_annotations(planned: Plan, part: Part) -> None:
    """Check that the recipe adds no annotations to existing frames: these are computed with their frames."""
    known = part.recipe.get("annotations", ())
    absent = next((name for name in planned.recipe.annotations if name not in known), None)
    if absent:
        raise RecipeError(
            f"annotations: expected those of the frames that are there ({', '.join(known) or 'none'}), which get no others; "
            f"found {absent}: leave it out, or render to another folder"
        )


def _joined(old: Sequence[str], new: Iterable[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys((*old, *new)))


def _flat(ranges: Iterable[tuple[int, int]]) -> Indices:
    """The numbers of ranges [first, stop)."""
    return np.concatenate([np.empty(0, np.int64), *(np.arange(first, stop) for first, stop in ranges)])


def _first_numbers(there: PlanRecord) -> Indices:
    """The first number of every pose: merged data sets may have a pose several times."""
    _, first, which = np.unique(names_of(there), return_index=True, return_inverse=True)
    return first[which].astype(np.int64)
