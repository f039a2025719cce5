"""Prove a data set rather than trust it: files, counts, ids, masks, boxes, poses, depth and exports."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

from viewsphere.check.exports import FrameTruth, check_coco, check_native, frame_truth
from viewsphere.check.failure import failure
from viewsphere.check.frames import FRAME_PROOFS
from viewsphere.check.rays import RayCaster
from viewsphere.errors import MissingExtraError, ViewsphereError
from viewsphere.model.sample import Sample
from viewsphere.store import Dataset


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


def check(dataset: Dataset, *, sample: int = 50, rays: bool | None = None) -> Report:
    """Prove the finished frames of a data set, its COCO annotations and, if it was exported, its native JSON.

    Every frame is read whole. On `sample` frames, spread evenly, stored depth is lifted to points and compared with rays that
    Embree casts at the exported models: `rays` False leaves that out, None does too (with a note) where embreex is not
    installed. COCO annotations are made afresh if the data set has no such export. Nothing is changed.

    Raises MissingExtraError for `rays` True without embreex.
    """
    findings: list[Finding] = []
    notes: list[str] = []
    try:
        findings += [Finding("counts", None, message) for message in _counts(dataset, notes)]
    except (ViewsphereError, LookupError, TypeError, ValueError) as error:
        return Report({}, (Finding("counts", None, f"expected models that can be read, found {error}"),), ())
    caster = None if rays is False else _caster(dataset, rays is True, notes)
    chosen = set(range(0, len(dataset), max(1, -(-len(dataset) // sample)))) if caster and sample else set[int]()
    checked = dict.fromkeys(FRAME_PROOFS, 0)
    truths: list[FrameTruth] = []
    for position, (index, read) in enumerate(_frames(dataset)):
        if not isinstance(read, Sample):
            findings.append(Finding("files", index, read))
            continue
        if read.index != index:
            findings.append(Finding("ids", index, f"expected a record of frame {index}, found one of {read.index}"))
        for name, messages in _proofs(dataset, read, caster if position in chosen else None):
            checked[name] = checked.get(name, 0) + 1
            findings += [Finding(name, index, message) for message in messages]
        truths += frame_truth(read)
    checked["coco"] = len(truths)
    findings += [Finding("coco", frame, message) for frame, message in check_coco(dataset, truths, notes)]
    if (dataset.root / "native").is_dir():
        checked["native"] = len(truths)
        findings += [Finding("native", frame, message) for frame, message in check_native(dataset, truths)]
    else:
        notes.append("native: not exported, not checked")
    return Report(checked, tuple(findings), tuple(notes))


def _counts(dataset: Dataset, notes: list[str]) -> Iterator[str]:
    """Frames and models that the plan asks for and the store lacks; what a run left out on purpose is noted."""
    plan, store = dataset.plan, dataset.store
    skipped = store.skipped()
    notes += [f"{key} was left out: {reason}" for key, reason in skipped.items()]
    wanted = [s for s in plan.shots if s[0] not in skipped and s[0].rpartition("-")[0] not in skipped]
    missing = [key for key, _, _ in wanted if not store.has_shot(key)]
    if sum(count for _, _, count in plan.shots) != plan.frames:
        yield f"expected shots of {plan.frames} frames together, found {sum(count for _, _, count in plan.shots)}"
    if plan.max_objects == 1 and plan.frames != len(plan.models) * plan.poses:
        yield f"expected {len(plan.models)} models x {plan.poses} poses, found a plan of {plan.frames} frames"
    if missing:
        expected = sum(count for _, _, count in wanted)
        yield (
            f"expected {expected} frames ({len(plan.models)} models x {plan.poses} poses), found {len(dataset)}: "
            f"shot {missing[0]} is the first of {len(missing)} missing: render again to go on"
        )
    finished = {info.key: info for info in dataset.models}
    for key in plan.models:
        if key in skipped:
            continue
        if key not in finished:
            yield f"expected model {key}, found none: render again to go on"
            continue
        for file in (finished[key].obj, finished[key].glb):
            if not dataset.path(file).is_file():
                yield f"model {key}: expected {file}, found none"


def _frames(dataset: Dataset) -> Iterator[tuple[int, Sample | str]]:
    """Index and sample of every finished frame, or what is wrong with its record."""
    position = 0
    for key, first, count in dataset.plan.shots:
        if not dataset.store.has_shot(key):
            continue
        for i in range(count):
            try:
                yield first + i, dataset[position + i]
            except (ViewsphereError, LookupError, TypeError, ValueError, AttributeError) as error:
                yield first + i, f"shot {key}: expected a readable record, found {type(error).__name__}: {error}"
        position += count


def _proofs(dataset: Dataset, sample: Sample, caster: RayCaster | None) -> Iterator[tuple[str, list[str]]]:
    """Every check of one frame and what it found; a proof that cannot be carried out counts as failed."""
    models = {info.key: info for info in dataset.models}
    proofs: dict[str, Callable[[], Iterable[str]]] = {n: partial(p, sample, models) for n, p in FRAME_PROOFS.items()}
    if caster is not None:
        proofs["surface"] = partial(caster.off_surface, sample)
    for name, proof in proofs.items():
        try:
            yield name, list(proof())
        except Exception as error:
            yield name, [failure("data that can be checked", error)]


def _caster(dataset: Dataset, demanded: bool, notes: list[str]) -> RayCaster | None:
    if not {"depth", "instances"} <= set(dataset.plan.channels):
        notes.append("surface: not checked, it needs the channels depth and instances")
        return None
    try:
        return RayCaster(dataset)
    except MissingExtraError as error:
        if demanded:
            raise
        notes.append(f"surface: not checked: {error}")
        return None
