"""The merge of several data sets into one: categories by name, models by content, everything renumbered."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.metadata import version
from itertools import count, islice
from pathlib import Path
from typing import Any

from viewsphere.composing.viewpoints.pose_numbers import joined_digests, names_of
from viewsphere.errors import StoreError, UserError
from viewsphere.labels import (
    IdKind,
    ObjectLabel,
    SampleLabel,
    channel_labels,
    channels,
    labels,
    object_labels,
    renumbered,
    sample_labels,
)
from viewsphere.model.credit import Credit
from viewsphere.model.sample import MERGED, ObjectAnnotation, Sample
from viewsphere.model.sensors.camera import Intrinsics
from viewsphere.run.progress import Listener, Progress
from viewsphere.store import Block, Category, Dataset, ModelInfo, Part, PlanRecord, Row, Store, encode, located
from viewsphere.store.credits import write_credits
from viewsphere.store.foreign import ForeignFrame, Loaded
from viewsphere.store.index import length
from viewsphere.store.paths import files_inside
from viewsphere.store.shots.linking import link_model, link_shot
from viewsphere.validation.quantity import quantity


@dataclass(frozen=True, eq=False)
class _Source:
    """A data set, with its new numbers and names in the merged data set."""

    dataset: Dataset
    number: int
    first_frame: int
    first_pose: int
    categories: Mapping[int, Category]
    model_keys: Mapping[str, str]
    sequences: Mapping[str, str]  # new names of those that an earlier source also has

    def named(self, old: str) -> str:
        """The new name of a model or of a sequence."""
        return self.sequences.get(old) or self.model_keys.get(old, old)

    @property
    def keeps_categories(self) -> bool:
        """Return whether no category id changes."""
        return all(old == new.id for old, new in self.categories.items())

    @cached_property
    def tables(self) -> Mapping[IdKind, Mapping[int, int]]:
        """New ids by old ids, for each kind that merging renumbers. Ids of objects and parts do not change, because shots and
        models stay whole.
        """
        return {"category": {old: new.id for old, new in self.categories.items()}}

    @property
    def rows(self) -> tuple[Row, ...]:
        """Its finished shots, in its own numbering."""
        return self.dataset.rows


def merge(
    sources: Sequence[Path | str],
    out: Path | str,
    *,
    mixed: bool = False,
    keep_going: bool = False,
    listener: Listener | None = None,
) -> Dataset:
    """Join data sets into a new one in `out`, in their order; pictures are linked instead of copied if possible.

    Categories of the same name become one, with the first one's id. Models of the same key stay one if their content is equal;
    otherwise the later model gets another key. Splits are united by name. The sources do not change. Raises UserError for data
    sets with different cameras or channels, unless `mixed` allows them. Raises StoreError for unfinished data sets, unless
    `keep_going` accepts them, and for an `out` that contains other data.
    """
    datasets = [Dataset(source) for source in sources]
    _check_sources(datasets, located(out))
    if not keep_going:
        _check_whole(datasets)
    if not mixed:
        _check_alike(datasets)
    categories, models, parts = _reconciled(datasets)
    record = _plan_record(parts, categories, models)
    credits = _credits(parts)
    store = Store(located(out))
    with store.opened_for(record):
        for part in parts:
            _link_models(part, store, credits)
        targets = record.rows
        for part in parts:
            _link_frames(part, targets, store, record, listener)
        write_credits(Dataset(out))
    return Dataset(out)


def _check_sources(datasets: Sequence[Dataset], out: Path) -> None:
    roots = [dataset.root.resolve() for dataset in datasets]
    if len(roots) < 2:
        raise UserError(f"merge: expected two data sets or more; found {len(roots)}")
    for i, root in enumerate(roots):
        if root in roots[:i]:
            raise UserError(f"merge: expected every data set once; found {datasets[i].root} again")
        if root == out.resolve():
            raise UserError(f"merge: expected a new folder for the merged data set; found one of its sources, {out}")
    for dataset in datasets:
        if not len(dataset):
            raise StoreError(f"{dataset.root}: expected finished frames, found none: render first")


def _check_whole(datasets: Sequence[Dataset]) -> None:
    for dataset in datasets:
        own = {row.key for row in dataset.rows}
        added = [index for index, _ in dataset.plan.supplements]
        there = (row for key in dataset.store.finished() if (row := dataset.plan.find(key)) is not None)
        left = sum(index.samples for index in added) - sum(row.count for row in there if row.key not in own)
        if left and len(dataset) == dataset.plan.frames:
            raise StoreError(
                f"{dataset.root}: expected all channels, found {quantity(left, 'frame')} that lack those that were added last: "
                "render it to the end, or merge what is there with --keep-going"
            )
        if len(dataset) != dataset.plan.frames:
            raise StoreError(
                f"{dataset.root}: expected {quantity(dataset.plan.frames, 'frame')}, found {len(dataset):,}: "
                "render it to the end, or merge what is there with --keep-going"
            )


def _check_alike(datasets: Sequence[Dataset]) -> None:
    first = datasets[0]
    for other in datasets[1:]:
        if set(other.plan.channels) != set(first.plan.channels):
            raise UserError(
                f"{other.root}: expected the channels of {first.root}, {', '.join(first.plan.channels)}; found "
                f"{', '.join(other.plan.channels)}: join them all the same with --mixed"
            )
        if _lenses(other) != _lenses(first):
            wanted, found = _told_apart(first, other)
            raise UserError(
                f"{other.root}: expected the camera of {first.root}, {wanted}; found {found}: "
                "join them all the same with --mixed"
            )


def _lenses(dataset: Dataset) -> set[Intrinsics | None]:
    """The lenses of a data set's parts, None for pictures with an unknown lens; all frames of a part share one lens."""
    firsts = {part.first for part in dataset.plan.parts if part.frames and part.first < len(dataset)} or {0}
    cameras = (dataset[first].known_camera for first in firsts)
    return set(None if camera is None else camera.intrinsics for camera in cameras)


def _told_apart(first: Dataset, other: Dataset) -> tuple[str, str]:
    """The cameras of two data sets in words: with six digits, or with all digits if six show no difference."""
    short, whole = ((_shown(first, digits), _shown(other, digits)) for digits in (6, 17))
    return short if short[0] != short[1] else whole


def _shown(dataset: Dataset, digits: int) -> str:
    lenses = [lens for lens in _lenses(dataset) if lens]
    if len(lenses) != 1:
        return "an unknown one" if not lenses else "several"
    i = lenses[0]
    named = {"fx": i.fx, "fy": i.fy, "cx": i.cx, "cy": i.cy, **({"skew": i.skew} if i.skew else {})}
    matrix = " ".join(f"{name} {value:.{digits}g}" for name, value in named.items())
    numbers = () if i.distortion is None else i.distortion.numbers
    bent = " ".join((i.lens.name, *(f"{number:.{digits}g}" for number in numbers)))
    rolling = i.rolling and f"a rolling shutter of {i.rolling.readout:.{digits}g} s, {i.rolling.direction}"
    return ", ".join(filter(None, (f"{i.width}x{i.height} {matrix}", "" if i.lens.is_linear else bent, rolling)))


def _reconciled(datasets: Sequence[Dataset]) -> tuple[tuple[Category, ...], tuple[str, ...], tuple[_Source, ...]]:
    """Return all categories, all models' keys, and the new numbers and names of every source."""
    categories: dict[int, Category] = {}
    contents: dict[str, tuple[object, ...]] = {}
    sources: list[_Source] = []
    frames = poses = 0
    for number, dataset in enumerate(datasets):
        joined: dict[int, Category] = {}
        for category in dataset.categories:
            new = joined[category.id] = _joined(categories, category, {c.id for c in joined.values()})
            if new.name != category.name and _tells_names(dataset):
                raise UserError(
                    f"{dataset.root}: expected category {new.name!r}, spelled as in a data set before it, as captions tell its "
                    f"name; found {category.name!r}: render one of them anew with the other's spelling"
                )
        for info in dataset.models:
            if info.category_id not in joined:
                raise StoreError(f"{dataset.root}: model {info.key}: expected a category of the plan, found {info.category_id}")
        own = (info for info in dataset.models if not info.track)
        model_keys = {info.key: _key_for(contents, info, joined[info.category_id]) for info in own}
        taken = {source.sequences.get(name, name) for source in sources for name in source.dataset.sequences}
        renamed = {name: _free(name, taken) for name in dataset.sequences if name in taken}
        sources.append(_Source(dataset, number, frames, poses, joined, model_keys, renamed))
        frames += len(dataset)
        poses += dataset.plan.poses
    return tuple(sorted(categories.values(), key=lambda c: c.id)), tuple(contents), tuple(sources)


def _tells_names(dataset: Dataset) -> bool:
    """Return whether labels of the data set contain names of categories."""
    kept = {name for part in dataset.plan.parts for name in (*part.channels, *(part.recipe.get("annotations") or ()))}
    return any(labels()[name].names_categories for name in kept if name in labels())


def _free(name: str, taken: set[str]) -> str:
    """A new name for a sequence, not used by an earlier source."""
    return next(new for number in count(2) if (new := f"{name}{MERGED}{number}") not in taken)


def _joined(categories: dict[int, Category], category: Category, others: set[int]) -> Category:
    """The category of this name. If there is none, it is added with its own id or a free id.

    `others` are the ids of this data set's other categories, which must stay distinct.
    """
    name = category.name.casefold()
    same = [c for c in categories.values() if c.name.casefold() == name and c.id not in others]
    if same:
        return next((c for c in same if c.name == category.name), same[0])
    free = category.id if category.id not in categories else max(categories) + 1
    categories[free] = replace(category, id=free)
    return categories[free]


def _key_for(contents: dict[str, tuple[object, ...]], info: ModelInfo, category: Category) -> str:
    """The model's key, with a number appended if another model has that key; the key is added to `contents`."""
    steps = tuple((one.key, one.digest, one.real_size) for one in info.steps)
    said = info.symmetries, info.keypoints, info.looks, info.faces
    number, key, content = 1, info.key, (info.digest, info.real_size, category.id, steps, *said)
    while contents.get(key, content) != content:
        number += 1
        key = f"{info.key}-{number}"
    contents[key] = content
    return key


def _plan_record(sources: Sequence[_Source], categories: tuple[Category, ...], models: tuple[str, ...]) -> PlanRecord:
    plans = [source.dataset.plan for source in sources]
    made = version("viewsphere")
    name = " + ".join(dict.fromkeys(plan.name for plan in plans))
    parts = tuple(part for source in sources for part in _parts(source))
    last = sources[-1].dataset
    whole = [[source.dataset.plan.digest, [row.key for row in source.rows]] for source in sources]
    thresholds = [plan.keep_annotations_above for plan in plans if plan.keep_annotations_above is not None]
    record = PlanRecord(
        version=made,
        digest=hashlib.sha256(json.dumps(whole).encode()).hexdigest(),
        name=name,
        recipe=last.plan.recipe,
        categories=categories,
        splits=tuple(dict.fromkeys(split for plan in plans for split in plan.splits)),
        channels=tuple(name for name in channels() if any(name in plan.channels for plan in plans)),
        models=models,
        poses=sum(plan.poses for plan in plans),
        frames=sum(len(source.dataset) for source in sources),
        max_objects=max(plan.max_objects for plan in plans),
        parts=parts,
    )
    return record.keeping_above(max(thresholds)) if thresholds else record


def _parts(source: _Source) -> Iterator[Part]:
    """Yield the finished portions of the source's parts, renumbered; channels added by a later part join the others.

    An unfinished part has no digest to look it up by, since no recipe renders its remainder. All poses come with the first
    part.
    """
    plan, first, names = source.dataset.plan, source.first_frame, joined_digests(names_of(source.dataset.plan))
    for number, part in enumerate(plan.parts):
        rows = [row for row in source.rows if row.part == number]
        frames = sum(row.count for row in rows)
        whole = frames == part.frames
        blocks = (
            part.blocks
            if whole
            else tuple(Block((row.subject,), row.positions, row.count // length(row.positions)) for row in rows)
        )
        if frames:
            yield replace(
                part,
                digest=part.digest if whole else "",
                first=first,
                frames=frames,
                channels=plan.channels_of(number),
                blocks=tuple(_moved(source, part, block) for block in blocks),
                supplies=(),
                new_poses=plan.poses if first == source.first_frame else 0,
                pose_names=names if first == source.first_frame else "",
                dealt_splits={source.named(key): split for key, split in part.dealt_splits.items()},
                merged=True,
            )
        first += frames


def _moved(source: _Source, part: Part, block: Block) -> Block:
    """The block with its models' new keys and its poses' new numbers; if poses are unknown, positions are frames."""
    by = source.first_pose if part.is_sampled else source.first_frame
    worlds = {name: part.world(name) for name in block.subjects}
    subjects = tuple(source.model_keys.get(world, world) + name.removeprefix(world) for name, world in worlds.items())
    return replace(block, subjects=subjects, positions=tuple((a + by, b + by) for a, b in block.positions))


def _credits(sources: Sequence[_Source]) -> dict[str, Credit]:
    """The credit of each model, by its new key; for a model in several sources, the first known credit."""
    found: dict[str, Credit] = {}
    for source in sources:
        for info in source.dataset.models:
            if info.credit and not info.track:
                found.setdefault(source.model_keys[info.key], info.credit)
    return found


def _link_models(source: _Source, store: Store, credits: Mapping[str, Credit]) -> None:
    for info in source.dataset.models:
        if not info.track:
            key, category = source.model_keys[info.key], _of(source.categories[info.category_id])
            files = files_inside(source.dataset.root, source.dataset.path(info.obj).parent)
            link_model(store, key, info, files, **category, credit=credits.get(key))


def _link_frames(source: _Source, targets: Iterator[Row], store: Store, record: PlanRecord, listener: Listener | None) -> None:
    """Link the source's shots to the next rows of `targets`."""
    for row, target in zip(source.rows, islice(targets, len(source.rows)), strict=True):
        if not store.has_shot(target.key):
            places = zip(source.dataset.samples_of(row.key, range(row.count)), count(target.first), strict=False)
            frames = (_renumbered(source, sample, index) for sample, index in places)
            link_shot(store, target.key, frames, source.dataset.store.known_of(row.key), source.dataset.kinds[row.part])
        if listener:
            listener(Progress("frames", target.first + target.count, record.frames))


def _renumbered(source: _Source, sample: Sample, index: int) -> ForeignFrame:
    pose = sample.known_pose
    moved = replace(
        sample,
        index=index,
        extra=_with_ids(source, sample.extra, sample_labels().values()),
        sequence=source.sequences.get(sample.sequence, sample.sequence),
        known_pose=pose and pose.model_copy(update={"index": pose.index + source.first_pose}),
        objects=tuple(_moved_object(source, o) for o in sample.objects),
    )
    files = {name: source.dataset.stored(file) for name, file in sample.files.items()}
    if not source.keeps_categories:
        files |= dict(_with_category_ids(source, sample))
    return ForeignFrame(moved, files)


def _moved_object(source: _Source, o: ObjectAnnotation) -> ObjectAnnotation:
    old = o.track or o.key
    key = source.model_keys.get(old, old)
    folder, _, name = o.model.rpartition("/")
    model = f"{folder.rpartition('/')[0]}/{key}/{name}" if o.model else ""
    named = {"key": key + o.key.removeprefix(old), "track": key if o.track else ""}
    more = _with_ids(source, o.extra, object_labels())
    return replace(o, **named, model=model, extra=more, **_of(source.categories[o.category_id]))


def _with_ids(source: _Source, values: Mapping[str, Any], labels: Iterable[ObjectLabel | SampleLabel]) -> dict[str, Any]:
    """The values of labels' fields, with the ids of the merged data set."""
    ids = {field.name: field.ids for label in labels for field in label.fields}
    return {name: renumbered(value, ids.get(name), source.tables) for name, value in values.items()}


def _of(category: Category) -> dict[str, Any]:
    """Return the fields with which models and objects describe their category."""
    return {"category": category.name, "supercategory": category.supercategory, "category_id": category.id}


def _with_category_ids(source: _Source, sample: Sample) -> Iterator[tuple[str, Loaded]]:
    """The channels that contain category ids, converted to the ids of the merged data set and encoded."""
    kinds = source.dataset.kinds[source.dataset.plan.part_of(sample.index)]
    for name, label in channel_labels().items():
        if name in sample.files and label.ids and source.tables.keys() & label.ids.keys():
            array = renumbered(sample.channels[name], label.ids, source.tables)
            yield name, Loaded(kinds.suffix(label.channel), encode(label.channel, array, kinds))
