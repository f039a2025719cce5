"""Proof of a data set's exports: digests, and what each format compares."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

from viewsphere import plugins
from viewsphere.check.failure import failure
from viewsphere.check.report import Finding, Report
from viewsphere.formats import Remark, Verified
from viewsphere.recipe.formats import FormatEntry
from viewsphere.run.preparing import Views
from viewsphere.store import Dataset
from viewsphere.store.checksums import damaged_files, written_least, written_options
from viewsphere.urls import here


def exports(dataset: Dataset) -> dict[str, Any]:
    """The formats, by their names, that lie in the data set's folder."""
    return {name: plugins.load("formats", name) for name in plugins.names("formats") if (dataset.root / name).is_dir()}


def export_report(dataset: Dataset, sampled: Collection[int], name: str) -> Report:
    """The findings in an export, by digests and by its format."""
    module, folder = plugins.load("formats", name), dataset.root / name
    has_proof = hasattr(module, "verify")
    proof: list[Remark] = [(None, message) for message in damaged_files(folder)]
    proof += _contents(Views(dataset), folder, module, sampled) if has_proof else ()
    findings = tuple(Finding(name, frame, message) for frame, message in proof)
    not_run = {} if has_proof else {name: "the format has no proof, only digests were compared"}
    return Report({name: len(dataset)}, findings, not_run=not_run)


def _contents(views: Views, folder: Path, module: Verified, sampled: Collection[int]) -> Iterator[Remark]:
    """The findings of an export's format; a proof that breaks off is one."""
    try:
        entry = FormatEntry(name=folder.name, options=written_options(folder))
        with here(folder) as local:
            yield from module.verify(views.of(entry, written_least(folder)), local, sampled, *entry.arguments())
    except Exception as error:
        yield None, failure("an export that can be checked", error)
