"""The export of a data set on disk to other formats, in one pass over its samples."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, closing
from pathlib import Path

import xxhash
from pydantic import JsonValue

from viewsphere import plugins
from viewsphere.errors import UserError
from viewsphere.plugins.format import FormatSpec
from viewsphere.recipe.formats import FormatEntry, Formats, options_of, read_formats
from viewsphere.run.exports.preparing import Entries, prepared, targets
from viewsphere.run.exports.scope import refuse, scope_of
from viewsphere.run.exports.writable import writable
from viewsphere.run.progress import Listener, Progress, null_listener
from viewsphere.store import Choice, Dataset, located, new_folder
from viewsphere.store.credits import credits_text
from viewsphere.store.shots.checksums import write_checksums, written_credits, written_frames, written_least, written_options
from viewsphere.store.shots.records import ModelInfo
from viewsphere.validation.quantity import quantity


def export(
    out: Path | str,
    formats: Formats,
    *,
    output: Path | str | None = None,
    choice: Choice | None = None,
    workers: int = 0,
    listener: Listener | None = None,
) -> tuple[str, ...]:
    """Write the finished frames of a data set in these formats, each to OUT/<format> or OUTPUT/<format>.

    The folders replace older exports only when all are complete. A partial export never replaces an export of all frames.

    Args:
        out: Folder or URL of the data set.
        formats: Names of formats in a text with commas, or a list of names and of {name: {option: value}}. Missing options
            come from the export in the data set's folder, else from its recipe, else from the format's defaults.
        output: Folder for the exports; None: that of the data set.
        choice: The models and frames to export; None: all. A part needs an `output`.
        workers: Number of processes that share a long export, if there are two or more. They need a `__main__` guard in the
            calling script.
        listener: A function that receives a `Progress` whenever the export has advanced.

    Returns:
        Notes for the user, each once.

    Raises:
        UserError: A format is unknown or cannot hold the data set, or the choice has no frames or no output.
        StoreError: `out` is no data set, or a folder cannot be written.
        WorkerDied: A process was killed.
    """
    dataset = Dataset(out, choice)
    place = dataset.root if output is None else located(output)
    is_own = place.resolve() == dataset.root.resolve()
    _check_choice(dataset, is_own)
    if place.resolve().is_relative_to(dataset.store.folder.resolve()):
        raise UserError(f"--output: expected a folder outside of the data set's store; found {place}")
    entries = tuple(entry.over(_known_options(dataset, entry.name)) for entry in read_formats(formats))
    if not entries:
        return ()
    from viewsphere.run.exports.completed import lacking  # which loads what reads and draws models

    specs = {entry.name: writable(entry.name) for entry in entries}
    refuse(entries, scope_of(dataset), dataset.root)
    for entry in entries:
        lacking(dataset, specs[entry.name], entry)
    with ExitStack() as whole:
        if is_own:
            dataset.store.make_ready()
            whole.enter_context(dataset.store.occupied())
        written = [(entry, whole.enter_context(_folder(dataset, place / entry.name, is_own))) for entry in entries]
        notes = (*write(dataset, written, listener or null_listener, workers), *_lacks(dataset))
    return tuple(dict.fromkeys(notes)) + tuple(linked(dataset, dataset.root))


def linked(dataset: Dataset, where: Path | str) -> Iterator[str]:
    """Yield a note for each kind of link in a data set's exports other than hard links."""
    for kind in sorted(dataset.link_kinds - {"hard link", "download"}):
        yield f"{where}: files of the exports are made as a {kind}, hard links do not work here"


def _lacks(dataset: Dataset) -> Iterator[str]:
    """Yield a note with the number of existing frames, if the plan has more."""
    there = len(Dataset(dataset.root)) if dataset.choice.is_some else len(dataset)
    if there < dataset.plan.frames:
        yield (
            f"{dataset.root}: {there:,} of {quantity(dataset.plan.frames, 'frame')} are there to export; "
            "viewsphere status says what became of the others"
        )


def _folder(dataset: Dataset, target: Path, is_own: bool) -> AbstractContextManager[Path]:
    return dataset.store.replacing(dataset.root / target.name) if is_own else new_folder(target)


def _known_options(dataset: Dataset, name: str) -> Mapping[str, JsonValue]:
    """The options of a data set's existing export, or else of its recipe."""
    said: Formats = dataset.recipe.get("formats", ())
    return written_options(dataset.root / name) or options_of(read_formats(said)).get(name, {})


def write(dataset: Dataset, formats: Entries, tell: Listener = null_listener, workers: int = 0) -> tuple[str, ...]:
    """Write the data set in formats, each once, into these empty folders; returns notes for the user. `workers`: see `export`.

    Every sample and each of its channels is read once. Finally the digests of all files are listed, with the options.
    """
    if not formats:
        return ()
    notes: list[str] = []
    total, least = len(dataset), dataset.plan.keep_annotations_above
    with ExitStack() as stack:
        found = targets(dataset, formats)
        adds = {target.entry.name: stack.enter_context(target.writer(notes.append)) for target in found}
        made = stack.enter_context(closing(prepared(dataset, found, workers)))
        for done, parts in enumerate(made):
            tell(Progress("exports", done, total))
            for name, add in adds.items():
                add(parts[name])
    for entry, folder in formats:
        spec = plugins.load(FormatSpec, entry.name)
        own = None if spec.keeps_all_objects else least
        credited = _credits_digest(dataset.models) if spec.names_credits else None
        write_checksums(folder, entry.whole().options, own, credited, total)
    tell(Progress("exports", total, total))
    return tuple(notes)


def is_written(entry: FormatEntry, dataset: Dataset, least: float | None) -> bool:
    """Return whether a format's export in a data set's folder is up to date and complete, judged by its list of files."""
    folder = dataset.root / entry.name
    is_whole = written_frames(folder) == len(dataset) and written_options(folder) == entry.whole().options
    return is_whole and not is_out_of_date(entry.name, dataset, least)


def is_out_of_date(name: str, dataset: Dataset, least: float | None) -> bool:
    """Return whether a format's export in a data set's folder is out of date. It is if it lacks finished frames, was written
    with another visibility threshold than `least`, or has other credits than those known now.
    """
    spec, folder = plugins.load(FormatSpec, name), dataset.root / name
    if written_frames(folder) not in (None, len(dataset)) or (not spec.keeps_all_objects and written_least(folder) != least):
        return True
    return spec.names_credits and written_credits(folder) != _credits_digest(dataset.models)


def _check_choice(dataset: Dataset, is_own: bool) -> None:
    """Raise UserError for a selection of frames that is empty or that would replace an export of all frames."""
    if dataset.choice.is_some and is_own:
        raise UserError("--output: expected another folder than the data set's, beside --models or --frames; found none")
    if dataset.choice.is_some and not len(dataset):
        raise UserError(f"{dataset.root}: expected finished frames that --models and --frames fit; found none")


def _credits_digest(models: Iterable[ModelInfo]) -> str | None:
    """Digest of the file's text (xxh128, hexadecimal); None if no credit is known."""
    text = credits_text(models)
    return xxhash.xxh3_128(text.encode()).hexdigest() if text else None
