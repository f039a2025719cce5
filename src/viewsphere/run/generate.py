"""A recipe becomes a data set on disk: plan minus store, then the exports."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path

from viewsphere import plugins
from viewsphere.errors import ModelError, RecipeError, UserError, ViewsphereError
from viewsphere.model.recipe import Recipe
from viewsphere.run.pool import Job, Outcome, run_jobs
from viewsphere.run.stages import prepare
from viewsphere.run.tasks import Task
from viewsphere.run.warm import compile_kernels
from viewsphere.sampling.plan import Plan
from viewsphere.store import Category, Dataset, PlanRecord, Store


@dataclass(frozen=True)
class Progress:
    """Where a run stands: `done` of `total`; `resumed` of them were there before this run.

    Phases are models, kernels (compiled once on a machine, then cached), frames and exports.
    """

    phase: str
    done: int
    total: int
    resumed: int = 0


@dataclass(frozen=True)
class Summary:
    """What a run left: frames in the data set, frames it rendered itself, what it skipped, seconds, formats, notes, and
    warnings about its models by their keys.
    """

    root: Path
    frames: int
    rendered: int
    skipped: dict[str, str]
    seconds: float
    formats: tuple[str, ...]
    notes: tuple[str, ...] = field(default=())
    warnings: dict[str, tuple[str, ...]] = field(default_factory=dict[str, tuple[str, ...]])


Listener = Callable[[Progress], None]


def generate(
    recipe: Recipe,
    out: Path | str,
    *,
    workers: int = 0,
    formats: Sequence[str] | None = None,
    keep_going: bool = False,
    listener: Listener | None = None,
) -> Summary:
    """Render all frames of a recipe that `out` does not hold yet, then write the formats (default: the recipe's).

    `workers` 0 renders in the calling process; more need a `__main__` guard in the calling script. A model that cannot be
    used is an error before rendering starts, or with `keep_going` left out and reported. Raises UserError for the user's
    mistakes; whatever was finished stays, and the same call goes on from there.
    """
    begun = time.monotonic()
    tell = listener or _unheard
    wanted = tuple(formats if formats is not None else recipe.formats)
    with recipe.located():
        for name in wanted:
            _check_channels(name, recipe.channels)
    planned = prepare(recipe)
    store = Store(Path(out))
    store.open_for(plan_record(planned))
    with recipe.located(), store.occupied():
        skipped = _prepare_models(planned, store, workers, keep_going, tell)
        rendered = _render_shots(planned, store, workers, keep_going, skipped, tell)
        _note_skipped(store, skipped)
        notes = export(store.root, wanted, listener=tell)
    dataset = Dataset(store.root)
    warnings = {info.key: info.warnings for info in dataset.models if info.warnings}
    return Summary(store.root, len(dataset), rendered, skipped, time.monotonic() - begun, wanted, notes, warnings)


def _check_channels(name: str, channels: Sequence[str]) -> None:
    """Raises UserError for a format that is not known, or that needs a channel which is not kept."""
    needed: Sequence[str] = getattr(plugins.load("formats", name), "CHANNELS", ())
    missing = [channel for channel in needed if channel not in channels]
    if missing:
        raise RecipeError(
            f"channels: expected {missing[0]}, which format {name} needs; found {', '.join(channels)}: "
            f"add it, or leave {name} out of formats"
        )


def _unheard(progress: Progress) -> None:
    """Nobody listens."""


def plan_record(planned: Plan) -> PlanRecord:
    """What the store keeps of a plan."""
    return PlanRecord(
        version=version("viewsphere"),
        digest=planned.digest,
        name=planned.recipe.name,
        recipe=planned.recipe.model_dump(mode="json"),
        categories=tuple(Category(c.id, c.name, c.supercategory) for c in planned.categories),
        splits=planned.splits,
        channels=planned.recipe.channels,
        models=tuple(m.key for m in planned.model_specs),
        poses=planned.poses,
        frames=planned.frames,
        max_objects=planned.max_objects,
        shots=tuple(planned.shot_table()),
    )


def _prepare_models(planned: Plan, store: Store, workers: int, keep_going: bool, tell: Listener) -> dict[str, str]:
    """Normalise and export every model; gives the keys left out, and why."""
    jobs = [Job(m.key, m.key, lambda m=m: Task("model", m.key, m.key, m.model_dump_json())) for m in planned.model_specs]
    total = len(jobs)
    failed: dict[str, ViewsphereError] = {}
    tell(Progress("models", 0, total))
    for done, outcome in enumerate(run_jobs(jobs, store.root, min(workers, total)), 1):
        if outcome.error is not None:
            failed[outcome.key] = outcome.error
        tell(Progress("models", done, total))
    for key, problem in _distance_problems(planned, store):
        failed.setdefault(key, problem)
    stops = [e for e in failed.values() if not (keep_going and isinstance(e, (ModelError, RecipeError)))]
    if stops or len(failed) == total:
        raise _joined(stops or list(failed.values()))
    return {key: str(error) for key, error in failed.items()}


def _distance_problems(planned: Plan, store: Store) -> Iterator[tuple[str, ViewsphereError]]:
    """Models that some pose's camera would stand inside of; each is named once."""
    for spec in planned.model_specs:
        info = store.model_info(spec.key)
        problem = info and planned.distance_problem(spec, info.box3d_object)
        if problem:
            yield spec.key, problem


def _joined(errors: Sequence[ViewsphereError]) -> ViewsphereError:
    """All of them, a line each; of their common type if they have one."""
    kinds = {type(e) for e in errors}
    kind = kinds.pop() if len(kinds) == 1 else UserError
    return kind("\n".join(dict.fromkeys(str(e) for e in errors)))


def _render_shots(planned: Plan, store: Store, workers: int, keep_going: bool, skipped: dict[str, str], tell: Listener) -> int:
    """Render the shots that the store lacks; gives the number of frames made. Failed shots land in `skipped`."""
    table = [row for row in planned.shot_table() if planned.shot_model(row[0]) not in skipped]
    total = sum(count for _, _, count in table)
    missing = {row[0] for row in table if not store.has_shot(row[0])}
    resumed = total - sum(count for key, _, count in table if key in missing)
    jobs = [_shot_job(planned, i, key) for i, (key, _, _) in enumerate(planned.shot_table()) if key in missing]
    rendered = 0
    if jobs:
        tell(Progress("kernels", 0, 1))
        compile_kernels(planned.shot(0))
        tell(Progress("kernels", 1, 1))
    tell(Progress("frames", resumed, total, resumed))
    for outcome in run_jobs(jobs, store.root, workers):
        _accept(outcome, keep_going, skipped)
        rendered += outcome.frames
        tell(Progress("frames", resumed + rendered, total, resumed))
    return rendered


def _shot_job(planned: Plan, index: int, key: str) -> Job:
    model = planned.shot_model(key)

    def make() -> Task:
        return Task("shot", key, model, planned.shot(index).model_dump_json())

    return Job(key, model, make)


def _accept(outcome: Outcome, keep_going: bool, skipped: dict[str, str]) -> None:
    if outcome.error is None:
        return
    if not (keep_going and isinstance(outcome.error, ModelError)):
        raise outcome.error
    skipped[outcome.key] = str(outcome.error)


def _note_skipped(store: Store, skipped: dict[str, str]) -> None:
    store.write_file("skipped.json", json.dumps(skipped, indent=1, sort_keys=True))


def export(out: Path | str, formats: Sequence[str], *, listener: Listener | None = None) -> tuple[str, ...]:
    """Write the finished frames of a data set in these formats, each to OUT/<format>; gives notes for the user.

    An older export of the same format is replaced only when the new one is whole. Raises UserError for an unknown format,
    StoreError if `out` is no data set or cannot be written.
    """
    tell = listener or _unheard
    dataset = Dataset(out)
    for done, name in enumerate(formats):
        tell(Progress("exports", done, len(formats)))
        writer: plugins.Format = plugins.load("formats", name)
        target = dataset.root / name
        with dataset.store.replacing(target) as folder:
            writer.export(dataset, folder)
    tell(Progress("exports", len(formats), len(formats)))
    kinds = dataset.link_kinds - {"hard link"}
    return tuple(
        f"{dataset.root}: files of the exports are made as a {kind}, hard links do not work here" for kind in sorted(kinds)
    )
