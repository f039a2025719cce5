"""The repair of damaged shots, models and exports of a data set; intact ones are not touched."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from viewsphere.check import Finding, Report, check, exports, lacking_models
from viewsphere.check.digests import damaged
from viewsphere.check.frames.recomputed import Recomputed
from viewsphere.check.frames.sources import Sources
from viewsphere.check.models import differing
from viewsphere.errors import UserError, ViewsphereError
from viewsphere.limits import limits
from viewsphere.run.datasets.repairing import Mender
from viewsphere.run.exports.exporting import export
from viewsphere.run.progress import Listener, null_listener
from viewsphere.store import Dataset
from viewsphere.store.credits import CREDITS, write_credits


@dataclass(frozen=True)
class _Repaired:
    """The repairs, in words, and the report of `check` on the repaired data set; failed repairs are findings."""

    done: tuple[str, ...]
    report: Report


def repair(root: Path | str, *, workers: int = 0, listener: Listener | None = None, **options: Any) -> _Repaired:
    """Check a data set, and remake models, shots and exports that have changed. Shots are remade if they are damaged or
    missing, or if they contradict recomputed values. `options` are those of `check`.

    A shot is rendered from its part's recipe, whose models must be unchanged. It replaces the damaged shot when it is complete
    and matches the manifest. Files that cannot be remade do not change. `workers` 0 does everything in the calling process.
    Raises StoreError if there is no readable plan.
    """
    dataset = Dataset(root)
    mending = _Mending(dataset, Mender(dataset.store, dataset.plan, workers, listener or null_listener))
    with dataset.store.occupied():
        while mending.models(mending.damaged_models()):
            pass
        mending.shots(mending.damaged_shots())
        report = check(Dataset(root), workers=workers, **options)
        mending.shots(_found_shots(dataset, report.findings))
        mending.credits(report.findings)
        mending.exports(report.findings)
    report = check(Dataset(root), workers=workers, **options) if mending.done else report
    return _Repaired(tuple(mending.done), replace(report, findings=(*report.findings, *mending.refused)))


class _Mending:
    """The repairs so far, in words, and the failed ones."""

    def __init__(self, dataset: Dataset, mender: Mender) -> None:
        self.done: list[str] = []
        self.refused: list[Finding] = []
        self._dataset, self._mender = dataset, mender
        self._tried: set[str] = set()

    def damaged_models(self) -> Iterator[str]:
        """Keys of models that have changed, are missing, or contradict one another or their source."""
        plan, store = self._dataset.plan, self._dataset.store
        folders = damaged(self._dataset)[1]
        keys = {key for key in plan.models if store.model_folder(key) in folders}.union(lacking_models(self._dataset))
        if not keys:
            keys.update(key for key, _ in differing(self._dataset, []))
            keys.update(key for key, _ in Sources(self._dataset, Recomputed(self._dataset)).contradictions(plan.models))
        return (key for key in plan.models if key in keys)

    def damaged_shots(self) -> Iterator[str]:
        """Keys of shots that have changed since they were written, or are missing."""
        store, folders, plan = self._dataset.store, damaged(self._dataset)[1], self._dataset.plan
        missing, most = sum(gap.shots for gap in store.gaps(plan)), limits.MAX_REPAIRED_SHOTS
        if missing > most:
            why = f"expected at most {most:,} missing shots (limit MAX_REPAIRED_SHOTS), found {missing:,}: render them first"
            self.refused.append(Finding("repair", None, why))
            return (key for key in store.finished() if store.shot_folder(key) in folders)
        wanted = (row.key for row in store.wanted(plan))
        return (key for key in wanted if store.shot_folder(key) in folders or not store.has_shot(key))

    def models(self, keys: Iterable[str]) -> bool:
        """Remake the models; returns whether any of them was not tried before."""
        return self._note("model", "made again", keys, self._mender.models)

    def shots(self, keys: Iterable[str]) -> None:
        """Render the shots again."""
        self._note("shot", "rendered again", keys, self._mender.shots)

    def _note(self, what: str, how: str, keys: Iterable[str], mend: Any) -> bool:
        wanted = [key for key in dict.fromkeys(keys) if key not in self._tried]
        errors: Mapping[str, ViewsphereError] = mend(wanted) if wanted else {}
        self._tried.update(wanted)
        self.done += [f"{what} {key}: {how}" for key in wanted if key not in errors]
        self.refused += [Finding("repair", None, f"{what} {key} cannot be {how}: {why}") for key, why in errors.items()]
        return bool(wanted)

    def credits(self, findings: Iterable[Finding]) -> None:
        """Rewrite the file of credits if it does not match the models' records."""
        if any(finding.check == "credits" for finding in findings):
            write_credits(Dataset(self._dataset.root))
            self.done.append(f"{CREDITS}: written again")

    def exports(self, findings: Iterable[Finding]) -> None:
        """Rewrite exports with findings, also if their files are links to damaged files. If frames cannot be remade, exports
        stay, because they may contain the last copy.
        """
        names = set(exports(self._dataset)) & {finding.check for finding in findings}
        lost = bool(self.refused) or any(finding.check == "counts" for finding in findings)
        for name in sorted(names):
            if lost:
                why = "frames or models are missing or damaged, of which it may hold the last copy"
                self.refused.append(Finding("repair", None, f"export {name} is not written again: {why}"))
                continue
            try:
                export(self._dataset.root, [name], workers=self._mender.workers)
                self.done.append(f"export {name}: written again")
            except UserError as error:
                self.refused.append(Finding("repair", None, f"export {name} cannot be written again: {error}"))


def _found_shots(dataset: Dataset, findings: Iterable[Finding]) -> Iterator[str]:
    """Keys of the shots in findings; a channel that was added to a frame later is in a separate shot."""
    names = exports(dataset)
    for finding in findings:
        if finding.frame is not None and finding.check not in names:
            added = [
                index.row_at(finding.frame).key
                for index, channels in dataset.plan.supplements
                if finding.check in channels and index.first <= finding.frame < index.first + index.samples
            ]
            yield from added or [dataset.plan.row_at(finding.frame).key]
