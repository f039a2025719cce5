"""A data set on disk in other formats: one pass over its samples for all of them."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import AbstractContextManager, ExitStack
from pathlib import Path

from pydantic import JsonValue

from viewsphere import plugins
from viewsphere.errors import UserError
from viewsphere.formats import Format
from viewsphere.model.channel import missing
from viewsphere.model.rig import CAMERA
from viewsphere.model.sample import Sample
from viewsphere.recipe.formats import FormatEntry, Formats, options_of, read_formats
from viewsphere.run.progress import Listener, Progress, unheard
from viewsphere.store import Choice, Dataset, Exported, new_folder
from viewsphere.store.checksums import read_least, read_options, write_checksums


def export(
    out: Path | str,
    formats: Formats,
    *,
    output: Path | str | None = None,
    choice: Choice | None = None,
    listener: Listener | None = None,
) -> tuple[str, ...]:
    """Write the finished frames of a data set in these formats, each to OUT/<format>, or OUTPUT/<format>; gives notes for the
    user. A format is its name, or {name: {option: value}}; options that are not said are those of the export in the data set's
    folder, else its recipe's, else the format's defaults.

    All are put in place, and take that of older exports, only when all are whole; an export of all frames is not replaced by
    one of a choice of them. Raises UserError for an unknown format or a choice without output or frames, StoreError if `out`
    is no data set or one of the folders cannot be written.
    """
    dataset = Dataset(out, choice)
    place = dataset.root if output is None else Path(output)
    is_own = place.resolve() == dataset.root.resolve()
    _check_choice(dataset, is_own)
    if place.resolve().is_relative_to(dataset.store.folder.resolve()):
        raise UserError(f"--output: expected a folder outside of the data set's store; found {place}")
    entries = tuple(entry.over(_known_options(dataset, entry.name)) for entry in read_formats(formats))
    for entry in entries:  # before the first of them is written
        writable(entry.name)
        entry.arguments()
    with ExitStack() as whole:
        folders = {name: whole.enter_context(_folder(dataset, place / name, is_own)) for name in options_of(entries)}
        notes = write(dataset, folders, options_of(entries), listener or unheard)
    kinds = dataset.link_kinds - {"hard link"}
    return tuple(dict.fromkeys(notes)) + tuple(
        f"{dataset.root}: files of the exports are made as a {kind}, hard links do not work here" for kind in sorted(kinds)
    )


def _folder(dataset: Dataset, target: Path, is_own: bool) -> AbstractContextManager[Path]:
    return dataset.store.replacing(dataset.root / target.name) if is_own else new_folder(target)


def _known_options(dataset: Dataset, name: str) -> Mapping[str, JsonValue]:
    """The options that a data set's export was written with, or that its recipe says."""
    said: Formats = dataset.recipe.get("formats", ())
    return read_options(dataset.root / name) or options_of(read_formats(said)).get(name, {})


def write(
    dataset: Dataset,
    folders: Mapping[str, Path],
    options: Mapping[str, Mapping[str, JsonValue]] | None = None,
    tell: Listener = unheard,
) -> tuple[str, ...]:
    """Write the data set in formats, by their names, into these empty folders; gives notes for the user.

    `options`: of formats, by their names. Every sample is read once, and so is each of its channels. At last the digests of all
    files are listed, with the options.
    """
    if not folders:
        return ()
    notes: list[str] = []
    total = len(dataset)
    with ExitStack() as stack:
        formats = {name: _format(name) for name in folders}
        least = dataset.plan.keep_annotations_above
        given = {name: shown_to(module, dataset, least) for name, module in formats.items()}
        entries = {name: FormatEntry(name=name, options=dict((options or {}).get(name, {}))) for name in folders}
        adds = {
            name: stack.enter_context(formats[name].writer(given[name], at, notes.append, *entries[name].arguments()))
            for name, at in folders.items()
        }
        for done, sample in enumerate(dataset):
            tell(Progress("exports", done, total))
            for name, add in adds.items():
                _check_sensor(dataset, name, formats[name], sample)
                add(given[name].shown(sample))
    for name, folder in folders.items():
        write_checksums(folder, entries[name].whole().options, least if _leaves_out(formats[name]) else None)
    tell(Progress("exports", total, total))
    return tuple(notes)


def shown_to(module: object, dataset: Dataset, least: float | None) -> Dataset:
    """The data set as a format sees it: without annotations of what is seen no more than `least`, but for one that writes
    scenes.
    """
    if least is None or not _leaves_out(module):
        return dataset
    shown = Exported(dataset.root, dataset.choice, least)
    shown.link_kinds = dataset.link_kinds
    return shown


def keeps_others(name: str, folder: Path, least: float | None) -> bool:
    """Whether a format's export in a folder keeps other annotations than those of what is seen more than `least`."""
    return _leaves_out(_format(name)) and read_least(folder) != least


def _leaves_out(module: object) -> bool:
    """Whether a format leaves annotations out; one that writes scenes says `ANNOTATES = False`."""
    return getattr(module, "ANNOTATES", True)


def _check_sensor(dataset: Dataset, name: str, module: Format, sample: Sample) -> None:
    """Raise UserError where a sensor keeps less than all channels, and lacks one that the format needs of every frame."""
    lacking = missing(getattr(module, "CHANNELS", ()), sample.files)
    if sample.sensor != CAMERA and lacking:
        raise UserError(
            f"{dataset.root}: format {name}: expected channel {lacking[0]} of every frame, found none of sensor "
            f"{sample.sensor} (frame {sample.index}): leave {name} out, or render that sensor with {lacking[0]}"
        )


def writable(name: str) -> Format:
    """The format of this name; raises UserError for one that is not known or does not work here."""
    module = _format(name)
    getattr(module, "check", lambda: None)()
    return module


def _format(name: str) -> Format:
    return plugins.load("formats", name)


def _check_choice(dataset: Dataset, is_own: bool) -> None:
    """Raise UserError for a choice that would take the place of an export of everything, or that leaves nothing."""
    if dataset.choice.is_some and is_own:
        raise UserError("--output: expected another folder than the data set's, beside --models or --frames; found none")
    if dataset.choice.is_some and not len(dataset):
        raise UserError(f"{dataset.root}: expected finished frames that --models and --frames fit; found none")
