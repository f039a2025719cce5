"""The report of `viewsphere inspect` on a set of models: `shapenet:FOLDER`."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from viewsphere.files import written_path
from viewsphere.model.model_spec import ModelSpec
from viewsphere.plugins.source import SourceModel, source_of
from viewsphere.run.reports.inspection import model_spec
from viewsphere.validation.quantity import quantity

SHOWN = 24
"""Models on the sheet of a set, evenly over all: four rows of six, in a few seconds."""

LISTED = 20
"""Categories and broken models that the report names; `--json` has all."""


@dataclass(frozen=True)
class SetReport:
    """The models of a set, without reading them.

    Attributes:
        source: The text that names the set.
        title: The name of the set.
        models: Number of models, broken ones included.
        categories: Number of models by category, most first.
        splits: Number of models by split; empty if the set has no splits.
        faults: The reasons why models cannot be used, by their keys.
        shown: A few models that can be used, evenly over all.
    """

    source: str
    title: str
    models: int
    categories: dict[str, int]
    splits: dict[str, int]
    faults: dict[str, str]
    shown: tuple[ModelSpec, ...]


def set_report(source: str) -> SetReport | None:
    """The report on a set, such as `gso:scans`; None for files, and for names of single models.

    Raises UserError for a folder with another layout.
    """
    named = source_of(source)
    if named is None or named.spec.folder is None:
        return None
    models = named.spec.expand(named.name)
    asked = os.path.abspath(written_path(named.name))  # noqa: PTH100, sources keep links, too
    if len(models) == 1 and Path(models[0].name) == Path(asked):
        return None
    usable = [model for model in models if not model.fault]
    return SetReport(
        source=source,
        title=named.spec.folder.title,
        models=len(models),
        categories=dict(Counter(model.category for model in usable).most_common()),
        splits=dict(Counter(model.split for model in usable if model.split).most_common()),
        faults={model.key or model.name: model.fault for model in models if model.fault},
        shown=tuple(_spec(named.prefix, model) for model in usable[:: -(-len(usable) // SHOWN) or 1]),
    )


def set_lines(report: SetReport) -> Iterator[str]:
    """The lines of the report."""
    yield f"{report.source} ({report.title})"
    yield f"  models     {report.models:,}, of which {len(report.faults):,} cannot be used"
    yield from _counts("categories", report.categories)
    yield from _counts("splits", report.splits) if report.splits else ()
    for key, fault in [*report.faults.items()][:LISTED]:
        yield f"  broken     {key}: {fault}"
    if len(report.faults) > LISTED:
        yield f"    and {len(report.faults) - LISTED:,} more"


def _counts(what: str, counts: dict[str, int]) -> Iterator[str]:
    yield f"  {what:<10} {len(counts):,}"
    for name, count in [*counts.items()][:LISTED]:
        yield f"    {name}: {quantity(count, 'model')}"
    if len(counts) > LISTED:
        yield f"    and {len(counts) - LISTED:,} more"


def _spec(prefix: str, model: SourceModel) -> ModelSpec:
    spec = model_spec(f"{prefix}:{model.name}", facts=model)
    return spec.model_copy(update={"key": model.key or spec.key, "category": model.category or spec.category})
