"""Proof that models' records follow from their sources, which are read again and compared completely."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from functools import cached_property
from pathlib import Path

from viewsphere.check.frames.differences import differences, in_words
from viewsphere.check.frames.recomputed import CONTRADICTED, Recomputed
from viewsphere.check.report import in_short
from viewsphere.errors import UserError
from viewsphere.files import read_bytes
from viewsphere.model.model_spec import ModelSpec
from viewsphere.plugins.source import is_versioned
from viewsphere.run.shots.models import Export, Models
from viewsphere.scratch import temporary
from viewsphere.store import Dataset, ModelInfo
from viewsphere.store.credits import credits_problem

Finding = tuple[str, str]
"""A model's key, and its contradiction."""


class Sources:
    """Remakes models of a data set; `why_not` has the reason for each model that cannot be remade, by its key."""

    def __init__(self, dataset: Dataset, recomputed: Recomputed) -> None:
        self.why_not: dict[str, str] = {}
        self._dataset, self._recomputed = dataset, recomputed
        self._models = Models(dataset.store, recomputed.stages, dataset.plan)

    @property
    def reasons(self) -> str:
        """Return the reasons why models could not be made again; empty if all could."""
        return in_short(self.why_not.values())

    @cached_property
    def _may_be_renewed(self) -> bool:
        """Return whether the file of credits confirms the records: a later run may renew credits without a new plan."""
        return credits_problem(self._dataset) is None

    def contradictions(self, keys: Iterable[str]) -> Iterator[Finding]:
        """Differences of the records of these models from the remade ones."""
        for key in keys:
            info = self._dataset.store.model_info(key)
            if info is not None:
                yield from ((key, message) for message in self._of_model(info))

    def excuse(self, key: str, reason: str) -> Iterator[str]:
        """The contradiction if a model was left out for this reason, but its source gives no error or a different one."""
        _, spec = self._spec(key)
        if spec is None:
            return
        try:
            self._models.record_and_export(spec, self._recomputed.replanned.steps_of(key), None)
        except UserError as error:
            if str(error) != reason:
                yield f"model {key}: expected it left out because of {str(error)!r:.200}, found {reason!r:.200}"
        else:
            yield f"model {key}: expected a model that can be made, found it left out: render again"

    def _of_model(self, info: ModelInfo) -> Iterator[str]:
        number, spec = self._spec(info.key)
        if spec is None:
            return
        planned = self._recomputed.replanned
        planned_credit = planned.portion(number).plan.credits.get(info.key)
        credit = info.credit if self._may_be_renewed or planned_credit is None else planned_credit
        try:
            made, export = self._models.record_and_export(spec, planned.steps_of(info.key), credit)
        except UserError as error:
            self.why_not[info.key] = str(error)
            return
        if made.digest != info.digest and not is_versioned(spec.source) and not self._is_same(info, export):
            self.why_not[info.key] = f"{Path(spec.source).name} changed since"
            return
        wanted, found = (json.loads(json.dumps(one.to_plain())) for one in (made, info))
        yield from in_words(differences(wanted, found), f"model {info.key}: model.json", "its source")

    def _spec(self, key: str) -> tuple[int, ModelSpec | None]:
        """The number of the last part that has a model, and the model; None if no recipe that can be planned has it."""
        for number in reversed(range(len(self._dataset.plan.parts))):
            if self._recomputed.composer(number) is not None:
                spec = self._recomputed.replanned.models(number).get(key)
                if spec is not None:
                    return number, spec
        self.why_not[key] = self._recomputed.reasons or CONTRADICTED
        return 0, None

    def _is_same(self, info: ModelInfo, export: Export) -> bool:
        """Return whether a source still gives the GLB of the data set."""
        with temporary("check") as scratch_folder:
            export(scratch_folder)
            return read_bytes(scratch_folder / Path(info.glb).name) == read_bytes(self._dataset.path(info.glb))
