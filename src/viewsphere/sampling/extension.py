"""Parts of a data set: what a recipe adds to the frames that are there, and how its plan renders them.

A frame is known by its model's key and its pose; a pose by its name and where the camera stands. A part holds models x poses
of its recipe less what earlier parts hold. Poses, frames, categories and models are numbered on; nothing is renumbered.
"""

from __future__ import annotations

import hashlib
import json
from base64 import b64decode, b64encode
from bisect import bisect_right
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.metadata import version
from itertools import chain, groupby

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import RecipeError
from viewsphere.model.instant import Instant
from viewsphere.model.mistakes import shown
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.shot import Shot
from viewsphere.recipe.recipe import Splits
from viewsphere.sampling.composition import BoxOf
from viewsphere.sampling.look import engine_look
from viewsphere.sampling.plan import Plan
from viewsphere.sampling.viewpoints import Poses
from viewsphere.store import Category, Part, PlanRecord, Row, ShotRow

FITTING = "appended frames have to fit those that are there; choose another output folder for others"

LOOK = "the engine's program"
"""Name of the setting that says how the engine paints."""

Indices = NDArray[np.int64]
Ranges = tuple[tuple[int, int], ...]


@dataclass(frozen=True, eq=False)
class Portion:
    """A part of a data set, and the plan of its recipe, which renders it. `record` is the whole data set's."""

    plan: Plan
    record: PlanRecord
    number: int

    @property
    def part(self) -> Part:
        """The part."""
        return self.record.parts[self.number]

    @property
    def adds_nothing(self) -> bool:
        """Whether all that its recipe asks for was there before."""
        return not self.part.frames and not self.part.supplies

    def __str__(self) -> str:
        """What the part adds, in words."""
        plan, part = self.plan, self.part
        there = plan.frames - part.frames
        less = f" less {there:,} that are there" if there else ""
        text = f"adds {part.frames:,} frames ({plan.factors}{less})"
        for number, channels in part.supplies:
            text += f", and {', '.join(channels)} to {self.record.parts[number].frames:,} frames that are there"
        return text

    @cached_property
    def model_specs(self) -> tuple[ModelSpec, ...]:
        """All models that the recipe keeps, with the data set's numbers of their categories."""
        return tuple(self._numbered(spec) for spec in self.plan.kept_specs)

    def shot_table(self) -> Iterator[ShotRow]:
        """Key, first frame and number of frames of every shot: its own ones, then those with channels of older frames."""
        yield from self.record.shots_of(self.number)
        yield from (row for row, _ in self.record.supplements_of(self.number))

    def shot_model(self, key: str) -> str:
        """Key of the model in the shot of this key."""
        return key.rpartition("-")[0]

    def cast(self, row: ShotRow) -> tuple[ModelSpec, ...]:
        """The recipe's models in a shot, that of its frames first."""
        model, poses = self._frames(row)
        return self.plan.cast(self.plan.model_specs[self._position[model]], int(self._of_recipe[poses[0]]))

    def shot(self, row: ShotRow, box_of: BoxOf) -> Shot:
        """A shot of the table; `box_of` and errors as for `Plan.shot`."""
        key, first, _ = row
        model, poses = self._frames(row)
        made = self.plan.take(self._position[model], self._of_recipe[poses].tolist(), box_of, key)
        return made.model_copy(
            update={
                "things": tuple(p.model_copy(update={"model": self._numbered(p.model)}) for p in made.things),
                "first": first,
                "instants": tuple(_numbered(now, first + i, int(poses[i])) for i, now in enumerate(made.instants)),
                "channels": self._channels(first),
            }
        )

    def _channels(self, frame: int) -> tuple[str, ...]:
        return dict(self.part.supplies).get(self.record.part_of(frame), self.part.channels)

    def _frames(self, row: ShotRow) -> tuple[str, Indices]:
        """The model of a shot, and its poses as the data set numbers them."""
        _, first, count = row
        shown_there = self._spans[self.record.part_of(first)]
        start, models, poses = shown_there[bisect_right(shown_there, first, key=lambda span: span[0]) - 1]
        model, pose = divmod(first - start, len(poses))
        return models[model], poses[pose : pose + count]

    @cached_property
    def _spans(self) -> dict[int, list[tuple[int, tuple[str, ...], Indices]]]:
        """First frame, models and poses of every row of the parts that are rendered."""
        numbers = (self.number, *(earlier for earlier, _ in self.part.supplies))
        spans: dict[int, list[tuple[int, tuple[str, ...], Indices]]] = {}
        for number in numbers:
            frame = self.record.parts[number].first
            spans[number] = []
            for row in self.record.parts[number].rows:
                spans[number].append((frame, row.models, _flat(row.poses)))
                frame += row.frames
        return spans

    @cached_property
    def _of_recipe(self) -> Indices:
        """The recipe's number of every pose of the data set, -1 for those that it lacks."""
        numbers, _ = _numbers(self.record, pose_names(self.plan.pose_list))
        of_recipe = np.full(self.record.poses, -1, np.int64)
        of_recipe[numbers] = np.arange(len(numbers))
        return of_recipe[_firsts(self.record)]

    @cached_property
    def _position(self) -> dict[str, int]:
        return {spec.key: i for i, spec in enumerate(self.plan.model_specs)}

    @cached_property
    def _category_ids(self) -> dict[str, int]:
        return {category.name: category.id for category in reversed(self.record.categories)}

    def _numbered(self, spec: ModelSpec) -> ModelSpec:
        if not spec.category_id:
            return spec  # background
        return spec.model_copy(update={"category_id": self._category_ids[spec.category]})


def _numbered(now: Instant, index: int, pose: int) -> Instant:
    viewpoint = now.viewpoint and now.viewpoint.model_copy(update={"index": pose})
    return now.model_copy(update={"index": index, "viewpoint": viewpoint})


def whole(planned: Plan) -> Portion:
    """A recipe's plan as the only part of a data set."""
    nothing = PlanRecord("", "", "", {}, (), (), (), (), 0, 0, 0, ())
    return extend(planned, nothing)


def extend(planned: Plan, there: PlanRecord) -> Portion:
    """What a recipe adds to a data set, as its new last part.

    Raises RecipeError where the recipe's pictures or labels would not fit those that are there.
    """
    with planned.recipe.located():
        for part in there.parts:
            _check_settings(planned, part)
            _check_splits(planned, part)
        _check_models(planned, there)
        numbers, names = _numbers(there, pose_names(planned.pose_list))
        rows = tuple(_missing(planned, there, numbers))
        supplies = tuple(_supplies(planned, there, numbers))
        categories = _categories(planned, there)
    part = Part(
        digest=planned.digest,
        version=version("viewsphere"),
        name=planned.recipe.name,
        recipe=planned.recipe.model_dump(mode="json"),
        channels=_joined(there.channels, planned.recipe.channels),
        first=there.frames,
        frames=sum(row.frames for row in rows),
        max_objects=planned.max_objects,
        rows=rows,
        supplies=supplies,
        shot_frames=planned.shot_frames,
        settings=settings(planned),
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
        poses=len(names),
        frames=there.frames + part.frames,
        max_objects=max(there.max_objects, planned.max_objects),
        shots=(*there.shots, *part.shots(part.shot_frames)),
        parts=(*there.parts, part),
        pose_names=b64encode(names.tobytes()).decode(),
    )
    return Portion(planned, record, len(there.parts))


def pose_names(views: Poses) -> NDArray[np.uint64]:
    """A 64-bit digest of the name of every pose and of where its camera stands."""
    digests = (
        hashlib.blake2b(repr((views.name(i), tuple(views.view(i)), views.target(i))).encode(), digest_size=8).digest()
        for i in range(len(views))
    )
    return np.frombuffer(b"".join(digests), np.dtype("<u8"))


def _numbers(there: PlanRecord, wanted: NDArray[np.uint64]) -> tuple[Indices, NDArray[np.uint64]]:
    """The data set's number of every wanted pose, new ones counted on; and the digests of all poses by number."""
    known = _names(there)
    number_of: dict[int, int] = {}
    for number, name in enumerate(known.tolist()):
        number_of.setdefault(name, number)
    new = [name for name in wanted.tolist() if name not in number_of]
    number_of |= {name: there.poses + i for i, name in enumerate(new)}
    names = np.concatenate([known, np.array(new, np.dtype("<u8"))])
    return np.array([number_of[name] for name in wanted.tolist()], np.int64), names


def _names(there: PlanRecord) -> NDArray[np.uint64]:
    """The digest of every pose by its number, 0 for those of which nothing is known."""
    known = np.zeros(there.poses, np.dtype("<u8"))
    given = np.frombuffer(b64decode(there.pose_names), np.dtype("<u8"))
    known[: len(given)] = given
    return known


def _firsts(there: PlanRecord) -> Indices:
    """The first number of every pose: merged data sets may have a pose several times."""
    _, first, which = np.unique(_names(there), return_index=True, return_inverse=True)
    return first[which].astype(np.int64)


def settings(planned: Plan) -> dict[str, str]:
    """Digests of what the frames of a data set have in common, by the names of the recipe's fields."""
    recipe = planned.recipe
    value = recipe.model_dump(mode="json", include={"seed", "scene", "engine", "label_alpha", "viewpoints"})
    viewpoints = value.pop("viewpoints")
    planes = () if planned.composition is None else planned.composition.images
    value |= {
        "camera": planned.intrinsics.model_dump(mode="json"),
        "viewpoints.target": viewpoints.get("target"),
        "viewpoints.bins": viewpoints.get("bins"),
        "scene's images": [file.rpartition("/")[2] for files in (planned.images, *planes) for file in files],
    }
    digests = {name: hashlib.sha256(json.dumps(value[name]).encode()).hexdigest()[:16] for name in value}
    return digests | {LOOK: engine_look(recipe.engine.name)}


def _check_settings(planned: Plan, part: Part) -> None:
    own = settings(planned)
    for name, digest in part.settings.items():
        if own[name] != digest:
            found = planned.recipe.model_dump(mode="json")
            values = [_value(recipe, name) for recipe in (part.recipe, found)]
            differ = f"{values[0]}, as the data set has; found {values[1]}"
            if values[0] == values[1]:
                differ = "what the data set has; found another"
            raise RecipeError(f"{name}: expected {differ}: {FITTING}")


def _value(recipe: object, name: str) -> str:
    for field in name.split("."):
        recipe = recipe.get(field) if isinstance(recipe, dict) else None
    return shown(recipe)


def _check_splits(planned: Plan, part: Part) -> None:
    """Splits stay what they are, but for the lists of models that are new."""
    if not part.rows:
        return
    before, now = Splits.model_validate(part.recipe["splits"]), planned.recipe.splits
    if _shares(before) != _shares(now):
        raise RecipeError(f"splits: expected {_shares(before)}, as the data set has; found {_shares(now)}: {FITTING}")
    if now.by != "model":
        return
    old = replace(planned, recipe=planned.recipe.model_copy(update={"splits": before}))
    there = set(part.models)
    for spec in planned.model_specs:
        if spec.key in there and old.split(spec, 0) != planned.split(spec, 0):
            raise RecipeError(
                f"splits: expected model {spec.key!r} in {old.split(spec, 0)!r}, where the data set has it; "
                f"found it in {planned.split(spec, 0)!r}"
            )


def _shares(splits: Splits) -> str:
    parts = (f"{name} {'listed' if isinstance(part, tuple) else f'{part:g}'}" for name, part in splits.shares.items())
    return f"{', '.join(parts)} by {splits.by}"


def _check_models(planned: Plan, there: PlanRecord) -> None:
    """File systems that do not tell capitals apart would mix two models up."""
    known = {key.casefold(): key for key in there.models}
    for spec in planned.kept_specs:
        other = known.get(spec.key.casefold(), spec.key)
        if other != spec.key:
            raise RecipeError(f"models: expected keys that differ in more than capitals; found {spec.key!r} beside {other!r}")


def _categories(planned: Plan, there: PlanRecord) -> tuple[Category, ...]:
    """The data set's, then the recipe's new ones, numbered on; a category is known by its name."""
    found = {category.name: category for category in reversed(there.categories)}  # imported ones may share a name
    added: list[Category] = []
    number = max((category.id for category in there.categories), default=0)
    for category in planned.categories:
        known = found.get(category.name)
        if known is None:
            number += 1
            found[category.name] = replace(category, id=number)
            added.append(found[category.name])
        elif known.supercategory != category.supercategory:
            raise RecipeError(
                f"models: expected supercategory {known.supercategory!r} for category {category.name!r}, as the data set has; "
                f"found {category.supercategory!r}"
            )
    return (*there.categories, *added)


def _missing(planned: Plan, there: PlanRecord, numbers: Indices) -> Iterator[Row]:
    """Rows of the frames that the data set lacks: models in the recipe's order, poses in the data set's."""
    held: defaultdict[str, list[Ranges]] = defaultdict(list)
    for row in chain.from_iterable(part.rows for part in there.parts):
        for key in row.models:
            held[key].append(row.poses)
    first_of = _firsts(there)
    lacks: dict[tuple[int, tuple[Ranges, ...]], tuple[Ranges, ...]] = {}

    def lack(model: int) -> tuple[Ranges, ...]:
        """Of each time step."""
        has, schedule = tuple(held[planned.model_specs[model].key]), planned.schedules[model]
        known = id(schedule), has
        if known not in lacks:
            there = first_of[_flat(chain.from_iterable(has))]
            found = (_ranges(np.setdiff1d(numbers[run.first : run.stop], there)) for run in schedule.runs)
            lacks[known] = tuple(poses for poses in found if poses)
        return lacks[known]

    for steps, models in groupby(range(planned.models), lack):
        keys = tuple(planned.model_specs[model].key for model in models)
        for group in (keys,) if len(steps) == 1 else ((key,) for key in keys):
            yield from (Row(group, poses) for poses in steps)


def _supplies(planned: Plan, there: PlanRecord, numbers: Indices) -> Iterator[tuple[int, tuple[str, ...]]]:
    """Channels that frames of earlier parts lack: their part's number, and the channels in the table's order."""
    models = {spec.key for spec in planned.model_specs}
    for number, part in enumerate(there.parts):
        if not part.rows or not part.frames:
            continue
        lacking = tuple(c for c in planned.recipe.channels if c not in there.channels_of(number))
        if not lacking:
            continue
        absent = set(part.models) - models
        poses = np.unique(_firsts(there)[_flat(chain.from_iterable(row.poses for row in part.rows))])
        with_company = planned.recipe.scene.company is not None
        problem = (
            f"no model {min(absent)!r}"
            if absent
            else f"only {len(np.intersect1d(numbers, poses)):,} of {len(poses):,} poses"
            if not np.isin(poses, numbers).all()
            else "company drawn from other models"
            if with_company and models != set(part.models)
            else None
        )
        if problem:
            raise RecipeError(
                f"channels: expected all models and poses of the data set in the recipe, to add {lacking[0]} to its frames; "
                f"found {problem}: list them, or leave {lacking[0]} out"
            )
        yield number, lacking


def _flat(ranges: Iterable[tuple[int, int]]) -> Indices:
    return np.concatenate([np.empty(0, np.int64), *(np.arange(first, stop) for first, stop in ranges)])


def _ranges(numbers: Indices) -> Ranges:
    """Ascending numbers as ranges [first, stop)."""
    if not len(numbers):
        return ()
    runs = np.split(numbers, np.flatnonzero(np.diff(numbers) > 1) + 1)
    return tuple((int(run[0]), int(run[-1]) + 1) for run in runs)


def _joined(old: Sequence[str], new: Iterable[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys((*old, *new)))
