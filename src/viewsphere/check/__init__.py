"""Prove a data set rather than trust it: files, counts, ids, masks, boxes, poses, depth, recipes and exports."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import closing
from dataclasses import replace
from functools import partial
from typing import TypeVar

from viewsphere.check.claims import left_out, unclaimed
from viewsphere.check.cycles import Compared
from viewsphere.check.digests import damaged
from viewsphere.check.exports import export_report, exports
from viewsphere.check.frames.proofs import Chosen, frame_report, indices_at, samples_at
from viewsphere.check.frames.recomputed import Recomputed, rows_of
from viewsphere.check.frames.sources import Sources
from viewsphere.check.models import differing
from viewsphere.check.report import Finding, Report, joined
from viewsphere.errors import ViewsphereError
from viewsphere.model.channel import PASSES
from viewsphere.recipe.cameras.sequence import TimeEntry
from viewsphere.run.workers.in_order import in_order
from viewsphere.store import Dataset, PlanRecord
from viewsphere.store.credits import credits_problem
from viewsphere.store.shots.checksums import damaged_files

Value = TypeVar("Value", int, str)

FEWEST = 128
"""Number of frames from which a separate process is worth its start."""

DRAWN_AGAIN = ("min_visibility", "wanted")
"""Fields of recipes that redraw frames up to 32 times while they are composed."""

FEW_SHOTS = 4
"""Number of shots of such recipes that are recomposed: each takes as long as a second of rendering."""


def check(
    dataset: Dataset,
    *,
    sample: int | None = 50,
    rays: bool | None = None,
    frames: int | None = None,
    workers: int = 0,
    against_cycles: int = 0,
    fast: bool = False,
    repaint: int | None = 0,
) -> Report:
    """Prove the finished frames of a data set, and all its exports. Nothing is changed.

    Every file is compared with its digest, and the store may contain nothing that the plan does not name. Every frame is read
    completely. With `frames`, at most this number is read, spread evenly, and exports are left to a full check.

    The plan, `sample` models and the shots of `sample` frames, spread evenly (None: all), are remade from the stored recipe and
    compared completely. For the same frames, all labels are recomputed from the exported models. Their stored depth is lifted
    to points and compared with rays that Embree casts at these models. `rays` False skips the rays; None skips them if embreex
    is not installed. `repaint` frames (None: all) are painted again. The instance maps of `against_cycles` frames are compared
    with Cycles' own pass of object indices.

    `workers` 0 does everything in the calling process. `fast` compares only the digests of the store and of exports, and the
    content of the store with the plan. The report lists each proof that did not run, with the reason.

    Raises MissingExtraError for `rays` True without embreex, and, before any work, for `against_cycles` without Blender.
    """
    compared = Compared(dataset) if against_cycles else None
    report_of_store, is_readable = _of_store(dataset)
    if not is_readable:
        return replace(report_of_store, not_run={"all other proofs": "the records of models cannot be read"})
    if fast:
        return joined([report_of_store, _of_digests(dataset)])
    positions = _spread(range(len(dataset)), frames)
    chosen = _chosen(dataset, positions, sample, repaint, rays)
    is_whole, names = len(positions) == len(dataset), exports(dataset)
    recomputed = Recomputed(dataset)
    reports = [report_of_store, _of_models(dataset), _of_recipes(dataset, recomputed, sample)]
    reports += _reports(dataset, positions, chosen, names if is_whole else (), workers, recomputed)
    if compared is not None:
        reports.append(_by_cycles(compared, dataset, _spread(positions, against_cycles)))
    if not is_whole:
        reports.append(Report({}, (), not_run=dict.fromkeys(names, "needs all frames")))
    return _covered(joined(reports), dataset, chosen, len(positions))


def _of_store(dataset: Dataset) -> tuple[Report, bool]:
    """The proofs of the store's content, and whether the records of models can be read."""
    notes: list[str] = []
    files, damage = damaged(dataset)
    findings = [Finding("digests", None, message) for messages in damage.values() for message in messages]
    checked = {"digests": files}
    try:
        findings += [Finding("counts", None, message) for message in _missing(dataset, notes)]
    except (ViewsphereError, LookupError, TypeError, ValueError) as error:
        findings.append(Finding("counts", None, f"expected models that can be read, found {error}"))
        return Report(checked, tuple(findings)), False
    findings += [Finding("store", None, message) for message in unclaimed(dataset)]
    findings += [Finding("credits", None, message) for message in _credits(dataset)]
    checked["store"] = len(dataset)
    if owned := sum(info.credit is not None for info in dataset.models):
        checked["credits"] = owned
    return Report(checked, tuple(findings), tuple(notes)), True


def _of_digests(dataset: Dataset) -> Report:
    """The proof of exports by digests only."""
    names = exports(dataset)
    findings = [Finding(name, None, message) for name in names for message in damaged_files(dataset.root / name)]
    not_run = {"labels, plan, models": "only digests were compared, check without --fast"}
    return Report(dict.fromkeys(names, len(dataset)), tuple(findings), not_run=not_run)


def _of_models(dataset: Dataset) -> Report:
    """The proof that files of models agree with one another."""
    elsewhere: list[str] = []
    findings = [Finding("models", None, message) for _, message in differing(dataset, elsewhere)]
    not_run = {"models": f"{len(elsewhere):,} of {len(dataset.models):,} were exported elsewhere"} if elsewhere else {}
    return Report({"models": len(dataset.models)}, tuple(findings), not_run=not_run)


def _of_recipes(dataset: Dataset, recomputed: Recomputed, sample: int | None) -> Report:
    """The proofs that the plan, the left-out parts and the records of `sample` models follow from the recipes."""
    sources, untried = Sources(dataset, recomputed), list[str]()
    findings = [Finding("plan", None, message) for message in recomputed.of_plan()]
    keys = dataset.plan.models
    some = [keys[i] for i in _spread(range(len(keys)), sample)]
    findings += [Finding("sources", None, message) for _, message in sources.contradictions(some)]
    findings += [Finding("skipped", None, message) for message in left_out(dataset, sources, untried)]
    not_run = {"plan": recomputed.reasons, "recipe": recomputed.reasons, "sources": sources.reasons, "labels": _alone(dataset)}
    if untried:
        not_run["skipped"] = f"cannot be tried again: {', '.join(untried[:3])}"
    proved = len(dataset.plan.parts) - len(recomputed.why_not)
    checked = {"plan": proved, "sources": len(some) - len(sources.why_not), "skipped": len(dataset.store.skipped())}
    coverage = ((len(some), len(keys), "models made again"),) if len(some) < len(keys) else ()
    return Report(_kept(checked), tuple(findings), (), _kept(not_run), coverage)


def _kept(values: Mapping[str, Value]) -> dict[str, Value]:
    """The values that are neither 0 nor empty."""
    return {name: value for name, value in values.items() if value}


def _alone(dataset: Dataset) -> str:
    """The reason why labels of some frames cannot be recomputed: only their records are stored."""
    folder_of = dataset.store.shot_folder
    frames = sum(row.count for row in dataset.rows if not (folder_of(row.key) / "shot.json").exists())
    return f"{frames:,} frames came without their shots" if frames else ""


def _chosen(dataset: Dataset, positions: range, sample: int | None, repaint: int | None, rays: bool | None) -> Chosen:
    """The frames to recompute and repaint, and the shots to recompose."""
    computed, painted = _spread(positions, sample), _spread(positions, repaint)
    places: dict[str, int] = {}
    for position, _, frame in indices_at(dataset, computed):
        for row in rows_of(dataset.plan, frame):
            places.setdefault(row.key, position)
    keys, redrawn = list(places), any(part.recipe.get(name) is not None for part in dataset.plan.parts for name in DRAWN_AGAIN)
    if redrawn and sample is not None:
        keys = [keys[i] for i in _spread(range(len(keys)), FEW_SHOTS)]
    return Chosen(computed, painted, {key: places[key] for key in keys}, rays)


def _covered(report: Report, dataset: Dataset, chosen: Chosen, read: int) -> Report:
    """The report with the coverage of proofs that check only some frames, and with proofs that had nothing to check."""
    total, checked = len(dataset), report.checked
    shots = checked.get("recipe", 0)
    coverage = [
        *report.coverage,
        (read, total, "frames read"),
        (len(chosen.computed), total, "frames with labels computed again"),
    ]
    coverage.append((shots, len(dataset.rows), "shots composed again"))
    coverage = [pair for pair in coverage if 0 < pair[0] < pair[1]]
    if set(PASSES) & set(dataset.plan.channels):
        coverage.append((checked.get("repaint", 0), total, "frames painted again"))
    idle = dict.fromkeys((name for name, count in checked.items() if not count), "no frame has it")
    return replace(report, not_run=idle | report.not_run, coverage=tuple(coverage))


def _by_cycles(compared: Compared, dataset: Dataset, positions: range) -> Report:
    """Return the differences from Cycles' view; other checks report records that cannot be read."""
    findings: list[Finding] = []
    for frame, sample in samples_at(dataset, positions):
        findings += (Finding("cycles", frame, message) for message in compared.differences(sample))
    return Report({"cycles": compared.frames}, tuple(findings), (compared.note(),))


def _spread(positions: range, most: int | None) -> range:
    """At most `most` of the positions, spread evenly; None: all."""
    return positions if most is None else positions[:: max(1, -(-len(positions) // most))] if most else positions[:0]


def _reports(
    dataset: Dataset, positions: range, chosen: Chosen, names: Collection[str], workers: int, recomputed: Recomputed
) -> Iterator[Report]:
    """The findings in frames, chunk by chunk, and in the exports of these names."""
    size = max(FEWEST, -(-len(positions) // max(2 * workers, 1)))
    chunks = [positions[at : at + size] for at in range(0, len(positions), size)]
    prover = partial(_prover, dataset, chosen)
    if workers < 2 or len(chunks) < 2:
        yield from map(prover(recomputed), (positions, *names))
        return
    tasks = (*names, *chunks)  # each export is one long task, so they begin first
    with closing(in_order(min(workers, len(chunks)), prover, tasks)) as made:
        reports = [report for _, report in made]
    yield from (*reports[len(names) :], *reports[: len(names)])


def _prover(dataset: Dataset, chosen: Chosen, recomputed: Recomputed | None = None) -> Callable[[range | str], Report]:
    """The function that proves the frames at some positions, or the export of a name."""

    def prove(asked: range | str) -> Report:
        if isinstance(asked, str):
            return export_report(dataset, chosen.computed, asked)
        return frame_report(dataset, chosen, asked, recomputed)

    return prove


__all__ = ["Finding", "Report", "check", "exports", "lacking_models"]


def _missing(dataset: Dataset, notes: list[str]) -> Iterator[str]:
    """Frames and models of the plan that the store lacks; those left out on purpose become notes."""
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
    """Keys of the plan's models that are missing and were not left out on purpose."""
    skipped, folder = dataset.store.skipped(), dataset.store.model_folder
    return [key for key in dataset.plan.models if key not in skipped and not (folder(key) / "model.json").is_file()]


def _credits(dataset: Dataset) -> Iterator[str]:
    """Problems of the file of credits, which is written when a run ends."""
    problem = credits_problem(dataset)
    if problem:
        yield f"{problem}: render again, or mend it with viewsphere check --repair"


def _missing_shots(dataset: Dataset) -> Iterator[str]:
    """The missing frames of each part, and the missing channels that a part adds to other parts' frames."""
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
    """The factors of a plan's number of frames, in words."""
    time = next((part.recipe["time"] for part in plan.parts if part.recipe.get("time")), None)
    if time is not None:
        instants = TimeEntry.model_validate(time).count
        films = sum(len(block.subjects) * block.size for part in plan.parts for block in part.blocks) // instants
        return f"{films} sequences x {instants} instants"
    scenes = {name for part in plan.parts if part.is_sampled and not part.is_product for name in part.subjects}
    return f"{len(scenes)} scenes x {plan.poses} poses" if scenes else f"{len(plan.models)} models x {plan.poses} poses"
