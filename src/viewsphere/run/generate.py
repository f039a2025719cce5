"""A recipe becomes a data set on disk: plan minus store, then the exports."""

from __future__ import annotations

import json
import time
from collections import Counter, defaultdict
from collections.abc import Container, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import chain
from os import PathLike
from pathlib import Path

from viewsphere import plugins
from viewsphere.errors import ModelError, RecipeError, UserError, ViewsphereError, WorkerDied, joined
from viewsphere.model.share import ALL
from viewsphere.planning.distances import Distances
from viewsphere.planning.extension import Portion
from viewsphere.planning.plan import Plan
from viewsphere.recipe.formats import FormatEntry, Formats, options_of, read_formats
from viewsphere.recipe.recipe import Recipe
from viewsphere.run.chance import left_by_chance
from viewsphere.run.executors import Crew, Job, Listed, Outcome, hired
from viewsphere.run.exports.exporting import export, is_out_of_date, is_written
from viewsphere.run.exports.unused import unused
from viewsphere.run.opening import check_formats, commit, prepare, to_append, to_render
from viewsphere.run.progress import Listener, Progress, unheard
from viewsphere.run.pulse import heard, watched
from viewsphere.run.shards import share_of
from viewsphere.run.shots.precompile import is_compiled, precompile, told_to
from viewsphere.run.shots.stages import Stages, StoredBoxes
from viewsphere.run.shots.tasks import KernelTask, Kind, ModelTask
from viewsphere.run.skies import check_skies
from viewsphere.run.status import Status, status
from viewsphere.run.unpainted import unpainted
from viewsphere.run.workers.worker_count import cores, default_workers
from viewsphere.store import Dataset, Row, Store, located
from viewsphere.store.credits import write_credits
from viewsphere.store.shots.checksums import damaged_files
from viewsphere.store.shots.heartbeat import Pulse

MOST_SUBJECTS = 10_000
"""Models or scenes whose cameras are looked at before rendering, evenly over all; the others are when their turn comes."""


@dataclass(frozen=True)
class Warnings:
    """The warnings of a run, as lines: `models` by models' keys, and `files`, of which models are parts, by file names."""

    models: dict[str, tuple[str, ...]] = field(default_factory=dict[str, tuple[str, ...]])
    files: dict[str, tuple[str, ...]] = field(default_factory=dict[str, tuple[str, ...]])


@dataclass(frozen=True)
class Summary:
    """The result of a run: frames in the data set, frames it rendered itself, frames it skipped, seconds, written formats,
    notes, warnings, and how many frames are left to other shards.
    """

    root: Path
    frames: int
    rendered: int
    skipped: dict[str, str]
    seconds: float
    formats: tuple[str, ...]
    notes: tuple[str, ...] = field(default=())
    warnings: Warnings = field(default_factory=Warnings)
    missing: int = 0


def generate(
    recipe: Recipe | str | PathLike[str],
    out: Path | str,
    *,
    workers: int | None = 0,
    formats: Formats | None = None,
    keep_going: bool = False,
    append: bool = False,
    shard: tuple[int, int] | None = None,
    ray: str | None = None,
    listener: Listener | None = None,
) -> Summary:
    """Render all frames of a recipe (or of the one in this file) that `out` does not hold yet, then write the formats (default:
    the recipe's), by name or as {name: {option: value}}; options that are not said are the recipe's.

    With `append`, `out` is a finished data set, and models, poses and channels of the recipe that it lacks are added to it;
    what was there stays as it was.

    `shard` (k, n) renders the k-th of n fixed shares of the shots, counted from 0: runs of all shards, on any machines that see
    `out`, in any order, several at once, together render everything. The run after which nothing is missing writes the
    formats; others write none.

    `workers` 0 renders in the calling process; more need a `__main__` guard in the calling script. None starts one a core, and
    none where one shot or less than three seconds of work are left. `ray` is the address of a Ray cluster whose CPUs render
    instead, such as "auto" (the one that this machine is of), "host:6379" or "ray://host:10001": at most `workers` of them, 0
    or None for all; `out` is where all its machines see it.

    A model that cannot be used is an error before rendering starts, or with `keep_going` left out and reported. Raises
    UserError for the user's mistakes, and WorkerDied, when all others are made, for shots that were lost with their workers
    again and again (with `keep_going` they are left out, too); whatever was finished stays, and the same call goes on from
    there.
    """
    begun = time.monotonic()
    share = ALL if shard is None else share_of(shard)
    recipe = Recipe.of(recipe)
    planned = prepare(recipe)
    wanted = _asked(recipe, formats)
    store = Store(located(out))
    if workers != 0 and not store.place.is_shared():
        raise UserError(
            f"{store.root}: expected workers 0, as other processes do not see this process's memory; found {workers or cores()}"
        )
    portion = replace(to_append(planned, store) if append else to_render(planned, store), share=share).remembering(store)
    wanted += _others(wanted, store) if portion.number else ()
    check_formats(planned, wanted, portion.record.channels)
    with recipe.located(), _at_work(portion, store) as pulse:
        tell = heard(pulse, listener or unheard)
        notes: tuple[str, ...] = ()
        rendered, skipped = 0, dict[str, str]()
        work = Missing(portion, store)
        many = default_workers(work) if workers is None and ray is None else workers or 0
        with hired(store.root, portion, many, ray) as crew:
            if portion.adds_nothing:
                _compare_models(portion, store, crew)
            else:
                notes = _check_skies(work, tell)
                rendered, skipped = _render_part(work, crew, keep_going, tell, pulse)
            notes += crew.notes
        with store.locked():
            notes += tuple(_renew_threshold(store, recipe.keep_annotations_above))
            dataset = Dataset(store.root)
            write_credits(dataset)
        left_over = None if share.is_all else status(store.root)
        if left_over is None or left_over.complete:
            due = tuple(_due(wanted, portion, rendered > 0, store))
            notes += export(store.root, due, workers=0 if ray else cores() if workers is None else workers, listener=tell)
            store.forget_failures()
            wanted = tuple({entry.name: entry for entry in (*wanted, *due)}.values()) if share.is_all else due
    if left_over is not None and not left_over.complete:
        warnings, notes = _warnings(planned, dataset), (*notes, _left_to_others(portion, left_over))
        seconds = time.monotonic() - begun
        return Summary(store.root, len(dataset), rendered, skipped, seconds, (), notes, warnings, left_over.missing)
    left = unused(store, (*wanted, *_others(wanted, store)))
    notes += (f"note: {left}",) if left else ()
    if append and not rendered and share.is_all:
        notes += (f"{store.root}: nothing to add, it has all that the recipe asks for",)
    notes += tuple(left_by_chance(dataset, portion))
    misses = unpainted(recipe, [s for s in planned.model_specs if s.key not in skipped], store)
    warnings = _warnings(planned, dataset, misses)
    return Summary(
        store.root, len(dataset), rendered, skipped, time.monotonic() - begun, tuple(options_of(wanted)), notes, warnings
    )


@contextmanager
def _at_work(portion: Portion, store: Store) -> Generator[Pulse]:
    """Open the store for a run's portion, and show others that it is at work, and how far."""
    if portion.number:
        store.make_ready()
        opened = store.occupied()
    else:
        opened = store.opened_for(portion.record)
    with opened as own, store.telling(own, (portion.share.number, portion.share.of)) as pulse:
        yield pulse


def _due(wanted: Sequence[FormatEntry], portion: Portion, has_rendered: bool, store: Store) -> Iterator[FormatEntry]:
    """The formats that a run writes when nothing is missing: those asked for, and those that lie there and are out of date.

    A run that had nothing to render leaves alone what is written and, unless it is one of a shard, whole.
    """
    dataset, least = Dataset(store.root), portion.plan.recipe.keep_annotations_above
    anew = has_rendered or portion.part.supplies
    yield from (entry for entry in wanted if anew or not _is_done(entry, dataset, least, portion.share.is_all))
    yield from (entry for entry in _others(wanted, store) if is_out_of_date(entry.name, dataset, least))


def _is_done(entry: FormatEntry, dataset: Dataset, least: float | None, proved: bool) -> bool:
    """True if a format is written as it would be now and, with `proved`, all its files have their digests."""
    return is_written(entry, dataset, least) and not (proved and any(damaged_files(dataset.root / entry.name)))


def _left_to_others(portion: Portion, far: Status) -> str:
    """Return the message about the remaining work when a shard is done."""
    what = f"{far.missing:,} of {far.frames:,} frames are" if far.missing else "models are"
    return (
        f"{far.root}: shard {portion.share} is done, {what} left to other shards: the run that makes the last of them writes "
        "the formats"
    )


def _asked(recipe: Recipe, formats: Formats | None) -> tuple[FormatEntry, ...]:
    """The formats to write with all their options: what is asked for, else what the recipe says, else the formats' defaults."""
    known = options_of(recipe.formats)
    entries = recipe.formats if formats is None else read_formats(formats)
    return tuple(entry.over(known.get(entry.name, {})).whole() for entry in entries)


def _renew_threshold(store: Store, least: float | None) -> Iterator[str]:
    """Let the whole data set have the recipe's `keep_annotations_above`; a note where older frames had another. The store is
    locked.
    """
    found = store.plan()
    renewed = found.keeping_above(least)
    if renewed != found:
        store.save(renewed)
        kept = "all annotations" if least is None else f"annotations of what is seen more than {least:g}"
        yield f"{store.root}: exports keep {kept} now, of all frames"


def _others(wanted: Iterable[FormatEntry], store: Store) -> tuple[FormatEntry, ...]:
    """The formats that lie in the data set beside those; they keep the options that they were written with."""
    known = options_of(wanted)
    return tuple(FormatEntry(name=n) for n in plugins.names("formats") if n not in known and (store.root / n).is_dir())


def _warnings(planned: Plan, dataset: Dataset, misses: Mapping[str, tuple[str, ...]] | None = None) -> Warnings:
    """Warnings about models and files, each once; `misses` are others about models, by their keys."""
    source_of = {spec.key: Path(spec.source).name for spec in planned.kept_specs if spec.parts is not None}
    models, files = defaultdict[str, list[str]](list), defaultdict[str, list[str]](list)
    for info in dataset.models:
        named = files[source_of[info.key]] if info.key in source_of else models[info.key]
        named += info.warnings
    for key, lines in (misses or {}).items():
        models[key] += lines
    return Warnings(_said(models), _said(files))


def _said(lines: Mapping[str, list[str]]) -> dict[str, tuple[str, ...]]:
    return {key: tuple(dict.fromkeys(some)) for key, some in lines.items() if some}


def _check_skies(work: Missing, tell: Listener) -> tuple[str, ...]:
    """Notes on the skies' pictures, if there is anything left to render; raises RecipeError for one that cannot be used."""
    if next(work.rows(), None) is None:
        return ()
    return check_skies(work.portion.plan, lambda done, total: tell(Progress("skies", done, total)))


def _render_part(work: Missing, crew: Crew, keep_going: bool, tell: Listener, pulse: Pulse) -> tuple[int, dict[str, str]]:
    """Make the part's models, take it into the data set, render its shots; gives the frames made and what was left out."""
    portion, store = work.portion, work.store
    if portion.number:
        store.drop_unnamed_models()  # of appending that ended before it began
    try:
        work.skipped.update(_prepare_models(portion, store, crew, keep_going, tell))
        commit(portion, store)
    except ViewsphereError:
        if portion.number:
            store.drop_unnamed_models()
        raise
    _note_skipped(portion, store, work.skipped)  # for those who watch the run
    rendered = _render_shots(work, crew, keep_going, tell, pulse)
    _note_skipped(portion, store, work.skipped)
    return rendered, work.skipped


def _prepare_models(portion: Portion, store: Store, crew: Crew, keep_going: bool, tell: Listener) -> dict[str, str]:
    """Normalise and export every model; gives the keys left out, and why."""
    planned = portion.plan
    jobs = _model_jobs("same model" if portion.number else "model", portion)
    total = len(jobs.all)
    failed: dict[str, ViewsphereError] = {}
    tell(Progress("models", 0, total))
    for done, outcome in enumerate(crew.run(jobs), 1):
        if outcome.error is not None:
            failed[outcome.key] = outcome.error
        tell(Progress("models", done, total))
    for key, problem in _distance_problems(portion, store, failed):
        failed.setdefault(key, problem)
    own = {m.key for m in planned.model_specs} | set(planned.taken)
    stops = [e for k, e in failed.items() if not (keep_going and k in own and isinstance(e, (ModelError, RecipeError)))]
    elsewhere = {} if portion.share.is_all else store.skipped()
    if stops or (failed and own <= failed.keys() | elsewhere.keys()):
        raise joined(stops or list(failed.values()))
    return {key: str(error) for key, error in failed.items()}


def _model_jobs(kind: Kind, portion: Portion) -> Listed:
    """A job for each model, with its time steps and its credit."""
    credit_of = portion.plan.credits.get
    tasks = (ModelTask(kind, spec, steps, credit_of(spec.key)) for spec, steps in portion.models)
    return Listed(tuple(Job(task.spec.key, task.spec.key, task) for task in tasks))


def _compare_models(portion: Portion, store: Store, crew: Crew) -> None:
    """Raises StoreError where a model is no longer the one that the data set shows."""
    held = (job for job in _model_jobs("same model", portion).all if store.model_info(job.key) is not None)
    errors = [outcome.error for outcome in crew.run(Listed(tuple(held))) if outcome.error]
    if errors:
        raise joined(errors)


def _distance_problems(portion: Portion, store: Store, failed: Container[str]) -> Iterator[tuple[str, ViewsphereError]]:
    """Models or scenes that some pose's camera would stand inside of, or that have no room; each is named once."""
    distances, subjects = Distances(portion.plan, StoredBoxes(store)), portion.subjects
    for subject in subjects[:: -(-len(subjects) // MOST_SUBJECTS) or 1]:
        if any(member.key in failed for member in portion.plan.cast(subject)):
            continue
        try:
            problem = distances.problem(subject)
        except RecipeError as error:
            problem = error
        if problem:
            yield subject, problem


def _render_shots(work: Missing, crew: Crew, keep_going: bool, tell: Listener, pulse: Pulse) -> int:
    """Render the shots that the store lacks; gives the number of frames made. Failed shots land in what was left out."""
    portion, store, skipped = work.portion, work.store, work.skipped
    total, resumed, rendered = work.total, work.resumed, 0
    first = next(work.rows(), None)
    if first is not None:
        Stages().check_scenery(portion.plan)
        with portion.plan.recipe.located():
            shot = portion.shot(first, StoredBoxes(store))
        if not is_compiled(shot):
            precompile(shot, told_to(tell))
            for outcome in crew.run(Listed((Job("kernels", first.subject, KernelTask(shot)),))):
                _accept(outcome, False, skipped)

    def report() -> None:
        tell(Progress("frames", resumed + rendered, total, resumed, crew.under_way, crew.nodes))

    report()
    lost: list[ViewsphereError] = []
    for outcome in watched(crew, work, pulse, report) if first is not None else ():
        if isinstance(outcome.error, WorkerDied) and not keep_going:
            lost.append(outcome.error)  # the others are made nevertheless
        else:
            _accept(outcome, keep_going, skipped)
            if outcome.error is not None and len(skipped).bit_count() == 1:  # the list is not written for each of thousands
                _note_skipped(portion, store, skipped)
        rendered += outcome.frames
        report()
    if lost:
        raise joined(lost)
    return rendered


@dataclass(frozen=True)
class Missing:
    """The shots of a portion that the store lacks, counted out row by row: those that no model left out is in.

    What is finished is looked for once, with one look at each shot; no rows are made of models of which nothing is missing.
    `skipped` is what is left out, and why.
    """

    portion: Portion
    store: Store
    skipped: dict[str, str] = field(default_factory=dict[str, str])

    @cached_property
    def _finished(self) -> frozenset[str]:
        """Keys of the shots that were finished when this was first asked."""
        return frozenset(self.store.finished())

    @property
    def total(self) -> int:
        """Frames that the portion has, without those that are left out."""
        indices = self.portion.indices
        if not self.skipped:
            return sum(index.samples for index in indices)
        if self.portion.plan.recipe.scene.is_moved_each_frame:
            return sum(row.count for row in self._wanted())
        cast = self.portion.plan.cast
        left = [name for name in self.portion.plan.taken if name not in self.skipped]
        whole = [name for name in left if not any(member.key in self.skipped for member in cast(name))]
        return sum(index.samples_of(name) for index in indices for name in whole)

    @cached_property
    def _there(self) -> tuple[Counter[str], int]:
        """The number of shots of each model in `_finished`, and the number of their frames."""
        shots, total = Counter[str](), 0
        for _, subject, frames in chain.from_iterable(index.held(self._finished) for index in self.portion.indices):
            shots[subject] += 1
            total += frames
        return shots, total

    @cached_property
    def _left(self) -> Counter[str]:
        """The number of shots of each incomplete model that `_finished` lacks, in the models' order."""
        return sum((index.counts for index in self.portion.indices), Counter[str]()) - self._there[0]

    @property
    def resumed(self) -> int:
        """Frames of the portion that are there."""
        return self._there[1]

    def lines(self) -> Iterable[tuple[str, int]]:
        """The models of which shots are missing, and how many."""
        return self._left.items()

    def jobs(self, line: str) -> Iterator[Job]:
        """The shots of a model that are to be rendered."""
        rows = chain.from_iterable(index.of(line) for index in self.portion.indices)
        return (Job(row.key, line, row) for row in self._lacking(rows))

    def rows(self) -> Iterator[Row]:
        """Yield all shots to render."""
        whole = set(self.portion.subjects).difference(self._left)
        return self._lacking(chain.from_iterable(index.without(whole) for index in self.portion.indices))

    def _lacking(self, rows: Iterable[Row]) -> Iterator[Row]:
        left = (row for row in rows if row.key not in self._finished)
        return (row for row in left if not self.store.has_shot(row.key) and not self._lacks_model(row))

    def _wanted(self) -> Iterator[Row]:
        return (row for row in self.portion.rows if not self._lacks_model(row))

    def _lacks_model(self, row: Row) -> bool:
        """Return whether a model that was left out is in a shot; a shot that lacks company lands in `skipped`."""
        if not self.skipped:
            return False
        if row.subject in self.skipped:
            return True
        lacking = [member.key for member in self.portion.cast(row) if member.key in self.skipped]
        if lacking:
            self.skipped[row.key] = f"in it stands {lacking[0]}, which was left out"
        return bool(lacking)


def _accept(outcome: Outcome, keep_going: bool, skipped: dict[str, str]) -> None:
    if outcome.error is None:
        return
    if not (keep_going and isinstance(outcome.error, ModelError | WorkerDied)):
        raise outcome.error
    skipped[outcome.key] = str(outcome.error)


def _note_skipped(portion: Portion, store: Store, skipped: dict[str, str]) -> None:
    """Keep what was left out, of other parts and shares too."""
    own = {spec.key for spec, _ in portion.models} | set(portion.subjects)
    with store.locked():
        others = {key: why for key, why in store.skipped().items() if key not in own and portion.find(key) is None}
        others = others if portion.number or not portion.share.is_all else {}
        store.write_file("skipped.json", json.dumps(others | skipped, indent=1, sort_keys=True))
