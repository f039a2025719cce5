"""The repair of damaged shots and models by the recipes that made them; nothing else is touched."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

from viewsphere.errors import StoreError, UserError, ViewsphereError
from viewsphere.planning.extension import DatasetPart
from viewsphere.run.executors import Job, Listed, worker_pool
from viewsphere.run.opening import check_whether_same
from viewsphere.run.progress import Listener, Progress
from viewsphere.run.shots.precompile import compile_kernels
from viewsphere.run.shots.replanning import AnotherPlan, Replanned
from viewsphere.run.shots.stages import StoredBoxes
from viewsphere.run.shots.tasks import Damaged, ModelTask
from viewsphere.store import PlanRecord, Row, Store

Errors = dict[str, ViewsphereError]
"""Errors of results that could not be repaired, by key; their files stay unchanged."""


@dataclass(frozen=True, eq=False)
class Mender:
    """Remakes damaged models and shots with a number of worker processes (0: in this process)."""

    store: Store
    record: PlanRecord
    workers: int
    tell: Listener

    def models(self, keys: Iterable[str]) -> Errors:
        """Remake the models of these keys; returns the errors of those that failed."""
        errors, wanted = _sorted(keys, self._part_of_model)
        for number, found in wanted.items():
            specs = self._replanned.models(number)
            credit_of = self._portion(number).plan.credits.get
            tasks = {
                key: ModelTask("damaged model", specs[key], self._replanned.steps_of(key), credit_of(key)) for key in found
            }
            self._run(number, [Job(key, key, task) for key, task in tasks.items()], errors)
        return errors

    def shots(self, keys: Iterable[str]) -> Errors:
        """Render the shots of these keys again, if their models are unchanged; returns the errors of those that failed."""
        errors, wanted = _sorted(keys, self._part_of_shot)
        for number, found in wanted.items():
            rows = [row for row in map(self.record.find, found) if row is not None]
            changed = self._changed_models(number, rows)
            casts = {row.key: [spec.key for spec in self._portion(number).cast(row) if spec.key in changed] for row in rows}
            errors |= {key: changed[cast[0]] for key, cast in casts.items() if cast}
            whole = [row for row in rows if not casts[row.key]]
            if whole:
                compile_kernels(self._portion(number).shot(whole[0], StoredBoxes(self.store)))
            self._run(number, [Job(row.key, row.subject, Damaged(row)) for row in whole], errors)
        return errors

    def _changed_models(self, number: int, rows: Sequence[Row]) -> Errors:
        """Return the errors of the shots' models that no longer match the data set."""
        errors: Errors = {}
        specs = {spec.key: spec for row in rows for spec in self._portion(number).cast(row)}
        steps_of = self._portion(number).plan.steps_of
        self._run(number, [Job(key, key, ModelTask("same model", spec, steps_of(spec))) for key, spec in specs.items()], errors)
        return errors

    def _run(self, number: int, jobs: Sequence[Job], errors: Errors) -> None:
        with worker_pool(self.store.root, self._portion(number), min(self.workers, len(jobs))) as pool:
            for done, outcome in enumerate(pool.run(Listed(tuple(jobs))), 1):
                if outcome.error is not None:
                    errors[outcome.key] = outcome.error
                self.tell(Progress("repair", done, len(jobs)))

    def _part_of_shot(self, key: str) -> int:
        """Number of the part that renders the shot; raises StoreError if none does."""
        row = self.record.find(key)
        if row is None:
            raise StoreError(f"{key}: expected a shot of the plan, found another")
        self._portion(row.part)
        return row.part

    def _part_of_model(self, key: str) -> int:
        """Number of the last part that has the model; raises UserError if no part can remake it."""
        problem: UserError = StoreError(f"model {key}: expected a recipe that has it, found none")
        for number in reversed(range(len(self.record.parts))):
            try:
                if key in {spec.key for spec, _ in self._portion(number).models}:
                    return number
            except UserError as error:
                problem = error
        raise problem

    def _portion(self, number: int) -> DatasetPart:
        """A part with its recipe's plan; raises UserError if the plan has changed."""
        check_whether_same(self.store, self.record.parts[number])
        try:
            return self._replanned.portion(number)
        except UserError as error:
            part = self.record.parts[number]
            if not part.is_rendered:
                raise
            problem = "another recipe" if isinstance(error, AnotherPlan) else error
            raise StoreError(
                f"{self.store.root}: recipe {part.name!r}: expected its files where they were, found {problem}: put them back, "
                "or delete the damaged folders and render the recipe again"
            ) from None

    @cached_property
    def _replanned(self) -> Replanned:
        return Replanned(self.store, self.record)


def _sorted(keys: Iterable[str], part_of: Callable[[str], int]) -> tuple[Errors, dict[int, list[str]]]:
    """The keys of each part, and the errors of the keys that no part can remake."""
    errors: Errors = {}
    found: defaultdict[int, list[str]] = defaultdict(list)
    for key in keys:
        try:
            found[part_of(key)].append(key)
        except UserError as error:
            errors[key] = error
    return errors, found
