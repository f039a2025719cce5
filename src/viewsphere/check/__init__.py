"""Prove a data set rather than trust it: files, counts, ids, masks, boxes, poses, depth and exports."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import closing
from dataclasses import asdict, dataclass
from functools import partial
from itertools import accumulate
from pathlib import Path
from typing import Any

from viewsphere import plugins
from viewsphere.check.again import Again
from viewsphere.check.cycles import Compared
from viewsphere.check.digests import damaged
from viewsphere.check.failure import failure
from viewsphere.check.frames import FRAME_PROOFS
from viewsphere.check.models import differing
from viewsphere.check.rays import RayCaster
from viewsphere.check.shots import contradictions
from viewsphere.errors import MissingExtraError, ViewsphereError
from viewsphere.formats import Remark, Verified
from viewsphere.labels import channel_labels, labels, on_request
from viewsphere.model.sample import Sample
from viewsphere.recipe.formats import FormatEntry
from viewsphere.recipe.sequence import TimeEntry
from viewsphere.run.in_order import in_order
from viewsphere.run.preparing import Views
from viewsphere.run.scenery import Scenery
from viewsphere.store import Dataset, ModelInfo, PlanRecord, Row
from viewsphere.store.checksums import damaged_files, written_least, written_options
from viewsphere.store.credits import credits_problem
from viewsphere.store.index import numbers
from viewsphere.urls import here


@dataclass(frozen=True)
class Finding:
    """Something that is not what it should be; `frame` is the frame's index in the plan, None for the data set as a whole."""

    check: str
    frame: int | None
    message: str

    def __str__(self) -> str:
        where = "" if self.frame is None else f"frame {self.frame}: "
        return f"{self.check}: {where}{self.message}"


@dataclass(frozen=True)
class Report:
    """What was proved: `checked` counts the frames (or files) behind each check, `notes` say what could not be checked."""

    checked: dict[str, int]
    findings: tuple[Finding, ...]
    notes: tuple[str, ...]

    @property
    def ok(self) -> bool:
        """Whether nothing was found wrong."""
        return not self.findings

    def to_json(self) -> dict[str, Any]:
        """The report as plain data."""
        return {"ok": self.ok, **asdict(self)}


FEWEST = 128
"""Frames for which a process of their own is worth its start."""


def check(
    dataset: Dataset,
    *,
    sample: int | None = 50,
    rays: bool | None = None,
    frames: int | None = None,
    workers: int = 0,
    against_cycles: int = 0,
    fast: bool = False,
) -> Report:
    """Prove the finished frames of a data set, and all its exports.

    Every file is compared with its digest, and every frame is read whole, or with `frames` at most so many, spread evenly; the
    exports are then left to a whole check. On `sample` frames, spread evenly (None: on all), all labels are computed again from
    the exported models; and stored depth is lifted to points and compared with rays that Embree casts at these models: `rays`
    False leaves that out, None does too (with a note) where embreex is not installed. Of `against_cycles` frames, spread
    evenly, instance maps are compared with Cycles' own pass of object indices. `workers` 0 proves all in the calling
    process. `fast` compares digests alone, of the store and of exports, as fast as they are read, and what is there with the
    plan. Nothing is changed.

    Raises MissingExtraError for `rays` True without embreex, and, before any work, for `against_cycles` without Blender.
    """
    compared = Compared(dataset) if against_cycles else None
    files, damage = damaged(dataset)
    findings = [Finding("digests", None, message) for messages in damage.values() for message in messages]
    notes: list[str] = []
    try:
        findings += [Finding("counts", None, message) for message in _counts(dataset, notes)]
    except (ViewsphereError, LookupError, TypeError, ValueError) as error:
        findings.append(Finding("counts", None, f"expected models that can be read, found {error}"))
        return Report({"digests": files}, tuple(findings), ())
    if fast:
        return _by_digests(dataset, files, findings, notes)
    findings += [Finding("models", None, message) for _, message in differing(dataset, notes)]
    findings += [Finding("credits", None, message) for message in _credits(dataset)]
    positions = _spread(range(len(dataset)), frames)
    sampled = _spread(positions, sample)
    checked = {"digests": files, "models": len(dataset.models)}
    if owned := sum(info.credit is not None for info in dataset.models):
        checked["credits"] = owned
    notes += _alone(dataset)
    is_whole, names = len(positions) == len(dataset), exports(dataset)
    for found in _reports(dataset, positions, sampled, rays, names if is_whole else (), workers):
        findings += found.findings
        notes += [note for note in found.notes if note not in notes]
        checked |= {name: checked.get(name, 0) + count for name, count in found.checked.items()}
    if compared is not None:
        findings += _differing(compared, dataset, _spread(positions, against_cycles))
        checked["cycles"] = compared.frames
        notes.append(compared.note())
    if not is_whole:
        notes.append(f"{len(positions):,} of {len(dataset):,} frames were read")
        notes += [f"{name}: not checked, that needs all frames" for name in names]
    return Report(checked, tuple(findings), tuple(notes))


def _by_digests(dataset: Dataset, files: int, findings: list[Finding], notes: list[str]) -> Report:
    """What is proved without reading what is in files: their digests, those of exports too."""
    names = exports(dataset)
    findings += [Finding("credits", None, message) for message in _credits(dataset)]
    for name in names:
        findings += [Finding(name, None, message) for message in damaged_files(dataset.root / name)]
    notes.append("only digests were compared: check without --fast proves the labels")
    return Report({"digests": files, **dict.fromkeys(names, len(dataset))}, tuple(findings), tuple(notes))


def _differing(compared: Compared, dataset: Dataset, positions: range) -> Iterator[Finding]:
    """What Cycles sees otherwise; records that cannot be read are found by others."""
    for _, frame, sample in _frames(dataset, positions):
        if not isinstance(sample, str):
            yield from (Finding("cycles", frame, message) for message in compared.differences(sample))


def _spread(positions: range, most: int | None) -> range:
    """At most so many of the positions, spread evenly; None: all."""
    return positions if most is None else positions[:: max(1, -(-len(positions) // most))] if most else positions[:0]


def _reports(
    dataset: Dataset, positions: range, sampled: range, rays: bool | None, names: Collection[str], workers: int
) -> Iterator[Report]:
    """What is wrong with frames, chunk by chunk, and with the exports of these names."""
    size = max(FEWEST, -(-len(positions) // max(2 * workers, 1)))
    chunks = [positions[at : at + size] for at in range(0, len(positions), size)]
    prover = partial(_prover, dataset, sampled, rays)
    if workers < 2 or len(chunks) < 2:
        yield from map(prover(), (positions, *names))
        return
    tasks = (*names, *chunks)  # each export is one long task, so they begin first
    with closing(in_order(min(workers, len(chunks)), prover, tasks)) as made:
        reports = [report for _, report in made]
    yield from (*reports[len(names) :], *reports[: len(names)])


def _prover(dataset: Dataset, sampled: range, rays: bool | None) -> Callable[[range | str], Report]:
    """Says what is wrong with the frames at some positions, or with the export of a name."""
    return lambda asked: (
        _export_report(dataset, sampled, asked) if isinstance(asked, str) else _frame_proofs(dataset, sampled, rays, asked)
    )


def _frame_proofs(dataset: Dataset, sampled: range, rays: bool | None, positions: range) -> Report:
    """What is wrong with the frames at these positions."""
    scenery, models = Scenery(dataset), {info.key: info for info in dataset.models}
    notes: list[str] = []
    findings: list[Finding] = []
    caster = None if rays is False else _caster(dataset, scenery, rays is True, notes)
    again = Again(dataset, scenery, models)
    checked = dict.fromkeys([*FRAME_PROOFS, *(name for name in labels() if _is_kept(dataset, name))], 0)
    for position, index, read in _frames(dataset, positions):
        if not isinstance(read, Sample):
            findings.append(Finding("files", index, read))
            continue
        found = [*_proofs(models, read), ("shot", _carried_out(partial(_as_shot, dataset, scenery, read)))]
        found += _proofs_by_models(read, again, caster) if position in sampled else ()
        for name, messages in found:
            findings += (Finding(name, index, message) for message in messages)
        for name in dict.fromkeys(name for name, _ in found):
            checked[name] = checked.get(name, 0) + 1
    return Report(checked, tuple(findings), (*notes, *scenery.notes))


def exports(dataset: Dataset) -> dict[str, Any]:
    """The formats, by their names, that lie in the data set's folder."""
    return {name: plugins.load("formats", name) for name in plugins.names("formats") if (dataset.root / name).is_dir()}


def _export_report(dataset: Dataset, sampled: Collection[int], name: str) -> Report:
    """What is wrong with an export."""
    notes: list[str] = []
    proof = _export_proof(Views(dataset), dataset.root / name, plugins.load("formats", name), sampled, notes)
    findings = tuple(Finding(name, frame, message) for frame, message in proof)
    return Report({name: len(dataset)}, findings, tuple(notes))


def _export_proof(views: Views, folder: Path, module: Verified, sampled: Collection[int], notes: list[str]) -> Iterator[Remark]:
    """What digests and its format find in an export; a proof that cannot be carried out counts as failed."""
    yield from ((None, message) for message in damaged_files(folder))
    if not hasattr(module, "verify"):
        notes.append(f"{folder.name}: only digests are checked, the format has no proof")
        return
    try:
        entry = FormatEntry(name=folder.name, options=written_options(folder))
        with here(folder) as local:
            yield from module.verify(views.of(entry, written_least(folder)), local, sampled, *entry.arguments())
    except Exception as error:
        yield None, failure("an export that can be checked", error)


def _counts(dataset: Dataset, notes: list[str]) -> Iterator[str]:
    """Frames and models that the plan asks for and the store lacks; what a run left out on purpose is noted."""
    plan, store = dataset.plan, dataset.store
    skipped = store.skipped()
    notes += [f"{key} was left out: {reason}" for key, reason in skipped.items()]
    if sum(part.frames for part in plan.parts) != plan.frames:
        yield f"expected parts of {plan.frames} frames together, found {sum(part.frames for part in plan.parts)}"
    for number, (part, index) in enumerate(zip(plan.parts, plan.indices, strict=True), 1):
        if part.frames != index.samples:
            yield f"part {number}: expected {index.samples} frames, found a plan of {part.frames}"
    yield from _missing_shots(dataset)
    yield from (f"expected model {key}, found none: render again to go on" for key in lacking_models(dataset))
    for info in dataset.models:
        for file in (info.obj, info.glb):
            if not dataset.path(file).is_file():
                yield f"model {info.key}: expected {file}, found none"


def lacking_models(dataset: Dataset) -> list[str]:
    """Keys of the models that the plan asks for, and that were not left out on purpose, of which there is nothing."""
    skipped, folder = dataset.store.skipped(), dataset.store.model_folder
    return [key for key in dataset.plan.models if key not in skipped and not (folder(key) / "model.json").is_file()]


def _credits(dataset: Dataset) -> Iterator[str]:
    """What is wrong with the file of credits, which is written when a run ends."""
    problem = credits_problem(dataset)
    if problem:
        yield f"{problem}: render again, or mend it with viewsphere check --repair"


def _missing_shots(dataset: Dataset) -> Iterator[str]:
    """What is missing of each part, and of the channels that each one added to others."""
    plan, store = dataset.plan, dataset.store
    for gap in store.gaps(plan):
        what = _factors(plan)
        if len(plan.parts) > 1:
            channels = dict.fromkeys(name for _, names in plan.parts[gap.part].supplies for name in names)
            what = f"{', '.join(channels)} of older frames, " if gap.is_added else ""
            what += f"part {gap.part + 1}, recipe {plan.parts[gap.part].name!r}"
        yield (
            f"expected {gap.of} frames ({what}), found {gap.of - gap.frames}: shot {gap.first.key} is the first of "
            f"{gap.shots} missing: render again to go on"
        )


def _factors(plan: PlanRecord) -> str:
    """What a plan's frames are the product of, in words."""
    time = next((part.recipe["time"] for part in plan.parts if part.recipe.get("time")), None)
    if time is not None:
        instants = TimeEntry.model_validate(time).count
        films = sum(len(block.subjects) * block.size for part in plan.parts for block in part.blocks) // instants
        return f"{films} sequences x {instants} instants"
    scenes = {name for part in plan.parts if part.is_sampled and not part.is_product for name in part.subjects}
    return f"{len(scenes)} scenes x {plan.poses} poses" if scenes else f"{len(plan.models)} models x {plan.poses} poses"


def _frames(dataset: Dataset, positions: range) -> Iterator[tuple[int, int, Sample | str]]:
    """Position, index and sample of these finished frames, or what is wrong with a record."""
    starts = list(accumulate((row.count for row in dataset.rows), initial=0))
    for position in positions:
        number = bisect_right(starts, position) - 1
        row = dataset.rows[number]
        index = row.first + position - starts[number]
        try:
            yield position, index, dataset[position]
        except (ViewsphereError, LookupError, TypeError, ValueError, AttributeError) as error:
            problem = f"{type(error).__name__}: {error}"
            yield position, index, f"shot {row.key}: expected a readable record, found {problem}"


def _alone(dataset: Dataset) -> Iterator[str]:
    """A note on frames of which nothing is known but what their records say."""
    folder_of = dataset.store.shot_folder
    frames = sum(row.count for row in dataset.rows if not (folder_of(row.key) / "shot.json").exists())
    if frames:
        yield f"{frames:,} frames came without their shots: nothing is computed again, they are proved against themselves alone"


def _is_kept(dataset: Dataset, name: str) -> bool:
    if name in on_request():
        return any(name in part.recipe.get("annotations", ()) for part in dataset.plan.parts)
    return name in dataset.plan.channels or name not in channel_labels()


def _proofs(models: Mapping[str, ModelInfo], sample: Sample) -> Iterator[tuple[str, list[str]]]:
    """Every check of one frame against itself and what it found; a proof that cannot be carried out counts as failed."""
    proofs: dict[str, Callable[[], Iterable[str]]] = {name: partial(proof, sample) for name, proof in FRAME_PROOFS.items()}
    following = on_request().keys() - sample.asked  # of these nothing is kept, so nothing can be wrong
    kept = {name: label for name, label in labels().items() if name not in following and label.is_in(sample)}
    proofs |= {name: partial(label.prove, sample, models) for name, label in kept.items()}
    for name, proof in proofs.items():
        yield name, _carried_out(proof)


def _as_shot(dataset: Dataset, scenery: Scenery, sample: Sample) -> Iterator[str]:
    """What a frame's record says otherwise than the plan, and than its shot if that is known."""
    row = dataset.plan.row_at(sample.index)
    shot, place = scenery.shot(row.key), sample.index - row.first
    if sample.known_pose and dataset.plan.parts[row.part].is_product:
        poses = tuple(numbers(row.positions))
        wanted = poses[place * len(poses) // row.count]
        if sample.pose.index != wanted:
            yield f"expected pose {wanted} of the plan, found {sample.pose.index}"
    name, split = _dealt_split(dataset, row, sample.sequence)
    if split is not None and sample.split != split:
        yield f"expected split {split!r}, which the plan dealt to {name}, found {sample.split!r}"
    if shot:
        yield from contradictions(sample, shot, place)


def _dealt_split(dataset: Dataset, row: Row, sequence: str) -> tuple[str, str | None]:
    """Whether a row is dealt its split with its sequence or with its model or scene, and that split: None where splits are
    drawn otherwise. What an earlier part dealt stays; a merged part knows its own alone.
    """
    part = dataset.plan.parts[row.part]
    deals = [one.dealt_splits for one in ((part,) if part.merged else dataset.plan.parts[: row.part + 1])]
    names = part.world(sequence), part.world(row.subject)
    found = ((name, deal[name]) for name in names for deal in deals if name in deal)
    return next(found, (names[1], None))


def _proofs_by_models(sample: Sample, again: Again, caster: RayCaster | None) -> Iterator[tuple[str, list[str]]]:
    """What a frame's labels are, computed again, and what Embree sees."""
    if again.is_possible(sample):
        try:
            for name, message in again.differences(sample):
                yield name, [message]
        except Exception as error:
            yield "models", [failure("models and shots from which labels can be computed", error)]
    if caster and all(o.is_placed for o in sample.objects) and {"depth", "instances"} <= sample.files.keys():
        yield "surface", _carried_out(partial(caster.off_surface, sample))


def _carried_out(proof: Callable[[], Iterable[str]]) -> list[str]:
    try:
        return list(proof())
    except Exception as error:
        return [failure("data that can be checked", error)]


def _caster(dataset: Dataset, scenery: Scenery, demanded: bool, notes: list[str]) -> RayCaster | None:
    if not {"depth", "instances"} <= set(dataset.plan.channels):
        notes.append("surface: not checked, it needs the channels depth and instances")
        return None
    try:
        return RayCaster(dataset, scenery)
    except MissingExtraError as error:
        if demanded:
            raise
        notes.append(f"surface: not checked: {error}")
        return None
