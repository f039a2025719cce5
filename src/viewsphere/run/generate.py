"""The rendering of a recipe into a data set on disk: first the frames that the store lacks, then the exports."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from os import PathLike
from pathlib import Path

from viewsphere import plugins
from viewsphere.errors import UserError
from viewsphere.model.shard import ALL
from viewsphere.planning.extension import DatasetPart
from viewsphere.planning.plan import Plan
from viewsphere.recipe.formats import FormatEntry, Formats, options_of, read_formats
from viewsphere.recipe.recipe import Recipe
from viewsphere.run.executors import worker_pool
from viewsphere.run.exports.exporting import export, is_out_of_date, is_written
from viewsphere.run.exports.unused import unused
from viewsphere.run.missing import Missing
from viewsphere.run.notes import left_by_chance, materials_not_found
from viewsphere.run.opening import check_formats, prepare, to_append, to_render
from viewsphere.run.progress import Listener, null_listener
from viewsphere.run.render_part import check_skies, compare_models, render_part, tee
from viewsphere.run.shards import shard_of
from viewsphere.run.status import Status, status
from viewsphere.run.workers.worker_count import cores, default_workers
from viewsphere.store import Dataset, Store, located
from viewsphere.store.credits import write_credits
from viewsphere.store.shots.checksums import damaged_files
from viewsphere.store.shots.heartbeat import HeartbeatWriter


@dataclass(frozen=True)
class Warnings:
    """The warnings of a run, as lines.

    Attributes:
        models: Lines by models' keys.
        files: Lines by file names, for files that contain several models.
    """

    models: dict[str, tuple[str, ...]] = field(default_factory=dict[str, tuple[str, ...]])
    files: dict[str, tuple[str, ...]] = field(default_factory=dict[str, tuple[str, ...]])


@dataclass(frozen=True)
class Summary:
    """The result of `viewsphere.generate`.

    Attributes:
        root: Folder of the data set.
        frames: Number of frames in the data set.
        rendered: Number of frames that this run rendered.
        skipped: Models and shots that `keep_going` left out, each with the reason.
        seconds: Duration of the run.
        formats: Names of the formats in the data set; empty if frames are missing.
        notes: Lines for the user.
        warnings: Warnings about models and files.
        missing: Number of frames left to other shards.
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
    """Render all frames of a recipe that `out` lacks, then write the formats.

    Finished frames stay if a run stops, and the same call resumes from there. An unusable model is an error before rendering
    starts.

    Args:
        recipe: The recipe, or the path or URL of its file.
        out: Folder or URL of the data set.
        workers: Number of processes that render. 0 renders in the calling process; more need a `__main__` guard in the
            calling script. None starts one per core, but none if one shot or less than three seconds of work is left.
        formats: Formats to write, each a name or {name: {option: value}}; None: those of the recipe. Missing options come
            from the recipe.
        keep_going: Leaves out unusable models and lost shots, and reports them.
        append: Adds the recipe's additional models, poses and channels to a finished data set. Existing frames do not
            change.
        shard: (k, n) renders the k-th of n fixed shares of the shots, counted from 0. Runs of all shards together render
            everything. They may run on any machines that see `out`, in any order or several at once. The run after which
            nothing is missing writes the formats.
        ray: Address of a Ray cluster whose CPUs render instead, such as "auto" (this machine's cluster), "host:6379" or
            "ray://host:10001". It uses at most `workers` CPUs, or all for 0 or None. All its machines must see `out`.
        listener: A function that receives a `Progress` whenever the run has advanced.

    Returns:
        The counts, notes and warnings of the run.

    Raises:
        UserError: The recipe, a model, the folder or an argument cannot be used.
        WorkerDied: Shots were repeatedly lost with their workers; raised after all other shots.
    """
    begun = time.monotonic()
    own_shard = ALL if shard is None else shard_of(shard)
    recipe = Recipe.ensure(recipe)
    planned = prepare(recipe)
    wanted = _asked(recipe, formats)
    store = Store(located(out))
    _check_reach(store, workers)
    portion = replace(to_append(planned, store) if append else to_render(planned, store), shard=own_shard).remembering(store)
    wanted += _others(wanted, store) if portion.number else ()
    check_formats(planned, wanted, portion.record.channels)
    with recipe.located(), _at_work(portion, store) as pulse:
        tell = tee(pulse, listener or null_listener)
        rendered, skipped, notes = _rendered(Missing(portion, store), workers, ray, keep_going, tell, pulse)
        with store.locked():
            notes += tuple(_renew_threshold(store, recipe.keep_annotations_above))
            dataset = Dataset(store.root)
            write_credits(dataset)
        left_over = None if own_shard.is_all else status(store.root)
        if left_over is None or left_over.complete:
            due = tuple(_due(wanted, portion, rendered > 0, store))
            notes += export(store.root, due, workers=0 if ray else cores() if workers is None else workers, listener=tell)
            store.forget_failures()
            wanted = _united(wanted, due) if own_shard.is_all else due
    summary = Summary(store.root, len(dataset), rendered, skipped, 0.0, (), notes, _warnings(planned, dataset))
    if left_over is not None and not left_over.complete:
        summary = replace(summary, notes=(*notes, _left_to_others(portion, left_over)), missing=left_over.missing)
    else:
        summary = _completed(summary, planned, portion, dataset, wanted, nothing_added=append and not rendered)
    return replace(summary, seconds=time.monotonic() - begun)


def _completed(
    summary: Summary,
    planned: Plan,
    portion: DatasetPart,
    dataset: Dataset,
    wanted: tuple[FormatEntry, ...],
    nothing_added: bool,
) -> Summary:
    """The summary of a run after which nothing is missing."""
    notes = (*summary.notes, *_remarks(portion, dataset, wanted, nothing_added))
    specs = [spec for spec in planned.model_specs if spec.key not in summary.skipped]
    warnings = _warnings(planned, dataset, materials_not_found(planned.recipe, specs, dataset.store))
    return replace(summary, formats=tuple(options_of(wanted)), notes=notes, warnings=warnings)


def _check_reach(store: Store, workers: int | None) -> None:
    """Raise UserError for a store in this process's memory if several processes are to render."""
    if workers != 0 and not store.place.is_shared():
        raise UserError(
            f"{store.root}: expected workers 0, as other processes do not see this process's memory; found {workers or cores()}"
        )


def _united(wanted: Iterable[FormatEntry], due: Iterable[FormatEntry]) -> tuple[FormatEntry, ...]:
    """The formats of both arguments, each once; due formats keep their own options."""
    return tuple({entry.name: entry for entry in (*wanted, *due)}.values())


def _rendered(
    work: Missing, workers: int | None, ray: str | None, keep_going: bool, tell: Listener, pulse: HeartbeatWriter
) -> tuple[int, dict[str, str], tuple[str, ...]]:
    """Render the part's missing shots, or compare its models if no shot is missing.

    Returns the number of frames rendered, the skipped models and shots with their reasons, and notes.
    """
    portion, store = work.portion, work.store
    many = default_workers(work) if workers is None and ray is None else workers or 0
    with worker_pool(store.root, portion, many, ray) as pool:
        if portion.adds_nothing:
            compare_models(portion, store, pool)
            return 0, {}, pool.notes
        notes = check_skies(work, tell)
        rendered, skipped = render_part(work, pool, keep_going, tell, pulse)
        return rendered, skipped, notes + pool.notes


def _remarks(portion: DatasetPart, dataset: Dataset, wanted: tuple[FormatEntry, ...], nothing_added: bool) -> Iterator[str]:
    """Notes about a complete data set."""
    if left := unused(dataset.store, (*wanted, *_others(wanted, dataset.store))):
        yield f"note: {left}"
    if nothing_added and portion.shard.is_all:
        yield f"{dataset.store.root}: nothing to add, it has all that the recipe asks for"
    yield from left_by_chance(dataset, portion)


@contextmanager
def _at_work(portion: DatasetPart, store: Store) -> Generator[HeartbeatWriter]:
    """Open the store for a run's portion, and publish the run's progress to other processes."""
    if portion.number:
        store.make_ready()
        opened = store.occupied()
    else:
        opened = store.opened_for(portion.record)
    with opened as own, store.telling(own, (portion.shard.number, portion.shard.of)) as pulse:
        yield pulse


def _due(wanted: Sequence[FormatEntry], portion: DatasetPart, has_rendered: bool, store: Store) -> Iterator[FormatEntry]:
    """The formats that a run writes when nothing is missing: requested formats, and existing exports that are out of date.

    A run that rendered nothing leaves up-to-date exports alone. Unless it renders a shard, it checks first that they are
    intact.
    """
    dataset, least = Dataset(store.root), portion.plan.recipe.keep_annotations_above
    anew = has_rendered or portion.part.supplies
    yield from (entry for entry in wanted if anew or not _is_done(entry, dataset, least, portion.shard.is_all))
    yield from (entry for entry in _others(wanted, store) if is_out_of_date(entry.name, dataset, least))


def _is_done(entry: FormatEntry, dataset: Dataset, least: float | None, proved: bool) -> bool:
    """True if a format's export is up to date and, with `proved`, all its files match their digests."""
    return is_written(entry, dataset, least) and not (proved and any(damaged_files(dataset.root / entry.name)))


def _left_to_others(portion: DatasetPart, far: Status) -> str:
    """Return the message about the remaining work when a shard is done."""
    what = f"{far.missing:,} of {far.frames:,} frames are" if far.missing else "models are"
    return (
        f"{far.root}: shard {portion.shard} is done, {what} left to other shards: the run that makes the last of them writes "
        "the formats"
    )


def _asked(recipe: Recipe, formats: Formats | None) -> tuple[FormatEntry, ...]:
    """The formats to write with all their options: as requested, else from the recipe, else the formats' defaults."""
    known = options_of(recipe.formats)
    entries = recipe.formats if formats is None else read_formats(formats)
    return tuple(entry.over(known.get(entry.name, {})).whole() for entry in entries)


def _renew_threshold(store: Store, least: float | None) -> Iterator[str]:
    """Apply the recipe's `keep_annotations_above` to the whole data set; yields a note if older frames had another value. The
    store is locked.
    """
    found = store.plan()
    renewed = found.keeping_above(least)
    if renewed != found:
        store.save(renewed)
        kept = "all annotations" if least is None else f"annotations of what is seen more than {least:g}"
        yield f"{store.root}: exports keep {kept} now, of all frames"


def _others(wanted: Iterable[FormatEntry], store: Store) -> tuple[FormatEntry, ...]:
    """The other formats in the data set's folder, with the options of their exports."""
    known = options_of(wanted)
    return tuple(FormatEntry(name=n) for n in plugins.names("formats") if n not in known and (store.root / n).is_dir())


def _warnings(planned: Plan, dataset: Dataset, misses: Mapping[str, tuple[str, ...]] | None = None) -> Warnings:
    """Warnings about models and files, each once; `misses` are additional warnings about models, by their keys."""
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
