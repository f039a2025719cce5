"""Proof of a data set's exports: their digests, and each format's own check."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from pathlib import Path

from viewsphere import plugins
from viewsphere.check.failure import failure
from viewsphere.check.report import Finding, Report
from viewsphere.errors import PluginError
from viewsphere.plugins.format import FormatSpec, Remark
from viewsphere.recipe.formats import FormatEntry
from viewsphere.run.exports.preparing import Views
from viewsphere.store import Dataset
from viewsphere.store.shots.checksums import damaged_files, written_least, written_options
from viewsphere.urls import here

Verify = Callable[..., Iterator[Remark]]


def exports(dataset: Dataset) -> tuple[str, ...]:
    """Names of the formats in the data set's folder."""
    return tuple(name for name in plugins.names("formats") if (dataset.root / name).is_dir())


def export_report(dataset: Dataset, sampled: Collection[int], name: str) -> Report:
    """The findings in an export, from its digests and its format's check."""
    folder = dataset.root / name
    proof: list[Remark] = [(None, message) for message in damaged_files(folder)]
    try:
        verify = plugins.load(FormatSpec, name).verify
    except PluginError as error:
        verify, reason = None, str(error)
    else:
        reason = "the format has no proof, only digests were compared"
    proof += _contents(Views(dataset), folder, verify, sampled) if verify else ()
    findings = tuple(Finding(name, frame, message) for frame, message in proof)
    not_run = {} if verify else {name: reason}
    return Report({name: len(dataset)}, findings, not_run=not_run)


def _contents(views: Views, folder: Path, verify: Verify, sampled: Collection[int]) -> Iterator[Remark]:
    """The findings of the format's check; a proof that breaks off counts as a finding."""
    try:
        entry = FormatEntry(name=folder.name, options=written_options(folder))
        with here(folder) as local:
            yield from verify(views.for_format(entry, written_least(folder)), local, sampled, *entry.arguments())
    except Exception as error:
        yield None, failure("an export that can be checked", error)
