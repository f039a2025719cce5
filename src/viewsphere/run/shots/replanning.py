"""The recipes of a data set's parts, planned again from the data set's records."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

from viewsphere.errors import StoreError, UserError
from viewsphere.model.model_spec import ModelSpec
from viewsphere.model.thing import TimeStep
from viewsphere.planning.extension import DatasetPart, resumed
from viewsphere.planning.plan import Plan, plan
from viewsphere.recipe.recipe import Recipe
from viewsphere.store import PlanRecord, Simulated, Store

MOST_FOLDERS = 8
"""Number of folders above a model's file that are searched for its recipe."""

MOST_SHOTS = 100
"""Number of a part's shots that are searched for the places of its models' files."""


class AnotherPlan(StoreError):
    """A part's recipe gives a plan that differs from the part's plan; `planned` is the recipe's plan."""

    def __init__(self, message: str, planned: Plan) -> None:
        super().__init__(message)
        self.planned = planned


@dataclass(frozen=True, eq=False)
class Replanned:
    """The parts of a data set, each with the plan that its recipe gives."""

    store: Store
    record: PlanRecord
    _plans: dict[int, Plan | UserError] = field(default_factory=dict[int, "Plan | UserError"])
    _portions: dict[int, DatasetPart] = field(default_factory=dict[int, DatasetPart])

    def plan(self, number: int) -> Plan:
        """The plan of a part's recipe.

        Raises StoreError for a part merged from another data set, and if files of the recipe are missing. Raises AnotherPlan if
        the files exist but the plan differs.
        """
        if number not in self._plans:
            try:
                self._plans[number] = self._planned(number)
            except UserError as error:
                self._plans[number] = error
        found = self._plans[number]
        if isinstance(found, UserError):
            raise found
        return found

    def portion(self, number: int) -> DatasetPart:
        """A part with its recipe's plan. It reads the part's stored simulations and stores no new ones; errors
        as for `plan`.
        """
        if number not in self._portions:
            found = resumed(self.plan(number), self.record, number)
            memory = Simulated(self.store.root, writes=False)
            self._portions[number] = replace(found, plan=found.plan.changed(memory=memory))
        return self._portions[number]

    def models(self, number: int) -> dict[str, ModelSpec]:
        """The models of a part by their keys, with the data set's numbers of their categories; errors as for `portion`."""
        return {spec.key: spec for spec, _ in self.portion(number).models}

    def steps_of(self, key: str) -> tuple[TimeStep, ...]:
        """The time steps of a model that are needed by all parts whose recipes can be planned."""
        found: dict[int, TimeStep] = {}
        for number in range(len(self.record.parts)):
            with suppress(UserError):
                models = {spec.key: steps for spec, steps in self.portion(number).models}
                found |= {step.frame: step for step in models.get(key, ())}
        return tuple(found.values())

    def _planned(self, number: int) -> Plan:
        part = self.record.parts[number]
        if not part.is_rendered:
            raise StoreError(
                f"{self.store.root}: part {number + 1}: expected one that was rendered here, found another data set's: repair "
                "that one, then merge or import it anew"
            )
        problem: UserError | None = None
        for folder in dict.fromkeys(self._folders(number)):
            try:
                planned = plan(Recipe.model_validate(part.recipe, context={"folder": folder}), part.shot_frames)
            except UserError as error:
                problem = problem or error
                continue
            if planned.digest == part.digest:
                return planned
            message = f"recipe {part.name!r}: expected a plan of digest {part.digest[:12]}, found {planned.digest[:12]}"
            problem = AnotherPlan(f"{self.store.root}: {message}", planned)
        raise problem or StoreError(f"{self.store.root}: expected a folder to plan in, found none")

    def _folders(self, number: int) -> Iterator[Path]:
        """Possible folders of the recipe's file: the current folder, and folders above a model's file."""
        yield Path.cwd()
        for row, _ in zip(self.record.rows_of(number), range(MOST_SHOTS), strict=False):
            try:
                shot = self.store.labelled(row.key)
            except StoreError:
                continue
            if shot is not None:
                for thing in shot.things:
                    yield from Path(thing.model.source).parents[:MOST_FOLDERS]
                return
