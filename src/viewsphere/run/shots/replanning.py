"""Recipes of a data set's parts, planned again from what the data set says of them."""

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
"""Folders above a model's file in which its recipe is looked for."""

MOST_SHOTS = 100
"""Shots of a part that are asked where its models' files lay."""


class AnotherPlan(StoreError):
    """A part's recipe gives another plan than the part's; `planned` is the plan."""

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

        Raises StoreError for a part that another data set brought, and where files of the recipe are no longer where they were;
        AnotherPlan where they are, and the plan is another.
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
        """A part, with its recipe's plan, which reads what was simulated for the part and keeps nothing more; errors as for
        `plan`.
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
        """The time steps of a model that all parts ask for whose recipes can be planned."""
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
        """Folders in which the recipe's file may have been: here, or above a model's."""
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
