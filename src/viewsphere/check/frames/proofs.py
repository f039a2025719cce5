"""All proofs of frames: against themselves, their shots and plan, the models, and the recipe."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import accumulate, islice

import numpy as np

from viewsphere.check.failure import failure
from viewsphere.check.frames.comparing import FRAME_PROOFS
from viewsphere.check.frames.rays import RayCaster, depth_of
from viewsphere.check.frames.recomputed import CONTRADICTED, Recomputed, rows_of
from viewsphere.check.frames.recomputed_labels import RecomputedLabels
from viewsphere.check.frames.repainted import Repainted
from viewsphere.check.report import Finding, Report, in_short
from viewsphere.errors import MissingExtraError, ViewsphereError
from viewsphere.labels import channel_labels, labels, on_request
from viewsphere.model.instant import Viewpoint
from viewsphere.model.sample import MERGED, Sample
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.shot import Shot
from viewsphere.run.shots.scenery import Scenery
from viewsphere.store import Dataset, ModelInfo, Row
from viewsphere.store.index import numbers


@dataclass(frozen=True)
class Chosen:
    """The positions to recompute labels for and to repaint, the shots to recompose, each with one of its positions, and whether
    to cast rays (None: if embreex is installed).
    """

    computed: range
    painted: range
    composed: Mapping[str, int]
    rays: bool | None


def frame_report(dataset: Dataset, chosen: Chosen, positions: range, recomputed: Recomputed | None = None) -> Report:
    """The findings in the frames at these positions; `recomputed` has the recipes' plans, if known."""
    proofs = _Proofs(dataset, chosen, recomputed or Recomputed(dataset))
    for position, index, read in _frames(dataset, positions):
        if isinstance(read, Sample):
            for name, messages in proofs.of_frame(position, read):
                proofs.count(name, index, messages)
        else:
            proofs.findings.append(Finding("files", index, read))
    return proofs.report()


class _Proofs:
    """Proves frames one after another; caches shared values."""

    def __init__(self, dataset: Dataset, chosen: Chosen, recomputed: Recomputed) -> None:
        self.findings: list[Finding] = []
        self._dataset, self._chosen = dataset, chosen
        self._not_run: dict[str, str] = {}
        self._scenery, self._models = Scenery(dataset), {info.key: info for info in dataset.models}
        self._recomputed_labels = RecomputedLabels(dataset, self._scenery, self._models)
        self._caster = None if chosen.rays is False else self._make_caster()
        self._recomputed = recomputed
        self._repainted = Repainted(dataset, recomputed)
        names = (*FRAME_PROOFS, *(name for name in labels() if _is_kept(dataset, name)))
        self._checked: dict[str, dict[int, None]] = {name: {} for name in names}

    def of_frame(self, position: int, sample: Sample) -> Iterator[tuple[str, list[str]]]:
        """Every proof of a frame, and its findings."""
        yield from _proofs(self._models, sample)
        yield "shot", _carried_out(partial(_as_shot, self._dataset, self._scenery, sample))
        if position in self._chosen.computed:
            yield from self._by_models(sample)
        yield from self._by_recipe(position, sample)
        if position in self._chosen.painted:
            yield from self._by_painting(sample)

    def count(self, name: str, frame: int, messages: Iterable[str]) -> None:
        """Record that a proof checked a frame, with its findings."""
        self._checked.setdefault(name, {})[frame] = None
        self.findings += (Finding(name, frame, message) for message in messages)

    def report(self) -> Report:
        """The report so far."""
        not_run = self._not_run | self._recomputed_labels.not_run
        if self._chosen.rays is False:
            not_run["surface"] = "no rays were asked for"
        if self._scenery.notes:
            not_run["background"] = in_short(self._scenery.notes)
        if self._recomputed.why_not or self._recomputed.refused:
            not_run["recipe"] = self._recomputed.reasons or CONTRADICTED
        if self._repainted.why_not:
            not_run["repaint"] = self._repainted.reasons
        checked = {name: len(frames) for name, frames in self._checked.items()}
        return Report(checked, tuple(self.findings), not_run=not_run)

    def _by_models(self, sample: Sample) -> Iterator[tuple[str, list[str]]]:
        """The comparison of a frame with recomputed labels and with Embree's rays."""
        if self._recomputed_labels.is_possible(sample):
            try:
                for name, message in self._recomputed_labels.differences(sample):
                    yield name, [message]
            except Exception as error:
                yield "models", [failure("models and shots from which labels can be computed", error)]
        if self._caster and all(o.is_placed for o in sample.objects) and depth_of(sample.files):
            yield "surface", _carried_out(partial(self._caster.off_surface, sample))

    def _by_recipe(self, position: int, sample: Sample) -> Iterator[tuple[str, list[str]]]:
        """The comparison of a frame's shots with recomposed ones; each shot is recomposed with one of its frames."""
        for row in rows_of(self._dataset.plan, sample.index):
            if self._chosen.composed.get(row.key) == position:
                messages = _carried_out(partial(self._recomputed.of_shot, row))
                if self._recomputed.is_composed(row):
                    yield "recipe", messages

    def _by_painting(self, sample: Sample) -> Iterator[tuple[str, list[str]]]:
        """The comparison of a frame's pictures and passes with repainted ones."""
        before = self._repainted.frames
        messages = _carried_out(partial(self._repainted.differences, sample))
        if messages or self._repainted.frames > before:
            yield "repaint", messages

    def _make_caster(self) -> RayCaster | None:
        if depth_of(self._dataset.plan.channels) is None:
            self._not_run["surface"] = "needs the channels instances and depth, or depth_ray"
            return None
        try:
            return RayCaster(self._dataset, self._scenery)
        except MissingExtraError:
            if self._chosen.rays:
                raise
            self._not_run["surface"] = "install viewsphere[check]"
            return None


def indices_at(dataset: Dataset, positions: range) -> Iterator[tuple[int, Row, int]]:
    """Position, row and index of these finished frames."""
    starts = list(accumulate((row.count for row in dataset.rows), initial=0))
    for position in positions:
        number = bisect_right(starts, position) - 1
        row = dataset.rows[number]
        yield position, row, row.first + position - starts[number]


def samples_at(dataset: Dataset, positions: range) -> Iterator[tuple[int, Sample]]:
    """Index and sample of these finished frames, without those whose records cannot be read."""
    return ((index, read) for _, index, read in _frames(dataset, positions) if isinstance(read, Sample))


def _frames(dataset: Dataset, positions: range) -> Iterator[tuple[int, int, Sample | str]]:
    """Position, index and sample of these finished frames, or the problem of a record."""
    for position, row, index in indices_at(dataset, positions):
        try:
            yield position, index, dataset[position]
        except (ViewsphereError, LookupError, TypeError, ValueError, AttributeError) as error:
            problem = f"{type(error).__name__}: {error}"
            yield position, index, f"shot {row.key}: expected a readable record, found {problem}"


def _is_kept(dataset: Dataset, name: str) -> bool:
    if name in on_request():
        return any(name in part.recipe.get("annotations", ()) for part in dataset.plan.parts)
    return name in dataset.plan.channels or name not in channel_labels()


def _proofs(models: Mapping[str, ModelInfo], sample: Sample) -> Iterator[tuple[str, list[str]]]:
    """Every check of one frame against itself, with its findings; a proof that breaks off counts as failed."""
    proofs: dict[str, Callable[[], Iterable[str]]] = {name: partial(proof, sample) for name, proof in FRAME_PROOFS.items()}
    following = on_request().keys() - sample.requested  # nothing is stored for these, so nothing can be wrong
    kept = {name: label for name, label in labels().items() if name not in following and label.is_in(sample)}
    proofs |= {name: partial(label.prove, sample, models) for name, label in kept.items()}
    for name, proof in proofs.items():
        yield name, _carried_out(proof)


def _as_shot(dataset: Dataset, scenery: Scenery, sample: Sample) -> Iterator[str]:
    """Differences of a frame's record from the plan, and from its shot if that is known."""
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
        yield from _contradictions(sample, shot, place)


def _dealt_split(dataset: Dataset, row: Row, sequence: str) -> tuple[str, str | None]:
    """The name that decides a row's split (its sequence, model or scene), and that split; None if it is drawn differently.

    A part keeps the splits of earlier parts; a merged part has only its own.
    """
    part = dataset.plan.parts[row.part]
    deals = [part_of_plan.dealt_splits for part_of_plan in ((part,) if part.merged else dataset.plan.parts[: row.part + 1])]
    names = part.world(sequence), part.world(row.subject)
    found = ((name, deal[name]) for name in names for deal in deals if name in deal)
    return next(found, (names[1], None))


def _carried_out(proof: Callable[[], Iterable[str]]) -> list[str]:
    try:
        return list(proof())
    except Exception as error:
        return [failure("data that can be checked", error)]


def _contradictions(sample: Sample, shot: Shot, place: int) -> Iterator[str]:
    """Yield the contradictions between a record and the sample at a place of its shot, counted from 0."""
    _, instant, sensor = next(islice(shot.samples, place, None))
    now, camera = shot.instants[instant], shot.camera(instant, sensor)
    if not _is_same_camera(sample.known_camera, camera):
        yield "expected the camera of the shot, found another"
    wanted, found = (pose and _unnumbered(pose) for pose in (shot.viewpoint(instant, sensor), sample.known_pose))
    if wanted != found:
        yield f"expected the pose {wanted} of the shot, found {found}"
    stored = (sample.split, sample.sequence.partition(MERGED)[0], sample.sensor, sample.instant, sample.time)
    known = (now.split, shot.sequence, shot.rig.sensors[sensor].name, now.index, now.seconds)
    if stored != known:
        yield f"expected split, sequence, sensor, instant and time {known} of the shot, found {stored}"
    poses = {thing.id: pose for thing in shot.objects if (pose := thing.motion.pose_at(instant)) is not None}
    if [o.id for o in sample.objects] != list(poses):
        yield f"expected the objects {list(poses)} of the shot, found {[o.id for o in sample.objects]}"
        return
    deforming = {thing.id for thing in shot.objects if thing.motion.step_at(instant)}
    for o in sample.objects:
        if not np.array_equal(o.world_from_object, poses[o.id]):
            yield f"object {o.id}: expected it where the shot has it, found it elsewhere"
        if bool(o.track) != (o.id in deforming):
            yield f"object {o.id}: expected {'a track' if o.id in deforming else 'no track'} by the shot, found {o.track!r}"


def _is_same_camera(one: Camera | None, other: Camera) -> bool:
    return (
        one is not None
        and one.intrinsics == other.intrinsics
        and np.array_equal(one.R, other.R)
        and np.array_equal(one.t, other.t)
    )


def _unnumbered(pose: Viewpoint) -> Viewpoint:
    """The viewpoint without its number, because merged data sets renumber poses."""
    return pose.model_copy(update={"index": 0})
