"""The plan and the shots from a data set's own recipes, compared completely with the stored ones."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from importlib.metadata import version
from itertools import accumulate
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from viewsphere.assets.paths.inside import split_source
from viewsphere.check.failure import failure
from viewsphere.check.frames.differences import Difference, differences, in_words
from viewsphere.check.report import in_short
from viewsphere.errors import UserError
from viewsphere.files import read_bytes, read_text
from viewsphere.planning.engine_digest import script_digest
from viewsphere.planning.extension import NOTHING, DatasetPart, extend
from viewsphere.planning.plan import Plan
from viewsphere.plugins.source import is_there
from viewsphere.run.shots.composing import Composer
from viewsphere.run.shots.replanning import AnotherPlan, Replanned
from viewsphere.run.shots.stages import Stages, StoredBoxes
from viewsphere.store import Dataset, PlanRecord, Row, kept_shot
from viewsphere.store.texts import parsed

FILE = re.compile(r"[*?/\\]|\.\w{2,8}$")
"""Matches names of files and patterns, but no other text of a recipe that affects its plan."""

FREE = ("name", "licence", "attribution", "source_url", "category", "supercategory")
"""Fields of a recipe whose texts may be anything."""

BY_FILES = re.compile(r"(^|\.)(models|blocks|poses|frames|new_poses|pose_names)\b|images|script")
"""Matches fields of a plan that follow from the names of files and from tables of poses."""

MOST_SUBJECTS = 200
"""Number of models or scenes of a part whose files are looked for."""

CONTRADICTED = "the plan contradicts its recipe"
"""The reason for not using a recipe further."""


def rows_of(plan: PlanRecord, frame: int) -> Iterator[Row]:
    """The rows of the shots that contain a frame: its own shot, then the shots that add channels to it."""
    yield plan.row_at(frame)
    for index, _ in plan.supplements:
        if index.first <= frame < index.first + index.samples:
            yield index.row_at(frame)


class Recomputed:
    """Plans a data set's recipes again, and composes its shots. `why_not` has the reason for each part that cannot be planned,
    `refused` the contradictions of each part whose own recipe gives another plan.
    """

    def __init__(self, dataset: Dataset) -> None:
        self.why_not: dict[int, str] = {}
        self.refused: dict[int, tuple[str, ...]] = {}
        self.stages = Stages()
        self.replanned = Replanned(dataset.store, dataset.plan)
        self._dataset, self._record = dataset, dataset.plan
        self._composers: dict[int, Composer | None] = {}
        self._composed: set[str] = set()

    def is_composed(self, row: Row) -> bool:
        """Return whether `of_shot` compared the shot of a row."""
        return row.key in self._composed

    @property
    def reasons(self) -> str:
        """Return the reasons why parts could not be planned; empty if all could."""
        return in_short(self.why_not.values())

    def composer(self, number: int) -> Composer | None:
        """The composer of a part's shots; None if its recipe cannot be planned or gives a different plan."""
        if number not in self._composers:
            portion = self._portion(number)
            self._composers[number] = portion and Composer(portion, StoredBoxes(self._dataset.store), self.stages)
        return self._composers[number]

    def of_plan(self) -> Iterator[str]:
        """Differences between plan.json and the combined plan of its recipes, and contradictions within plan.json."""
        yield from _inside(read_text(self._dataset.store.plan_file, "MAX_RECORD_BYTES"), self._record)
        portions = [self._portion(number) for number in range(len(self._record.parts))]
        yield from (message for messages in self.refused.values() for message in messages)
        if all(portions):
            yield from in_words(self._against(len(portions)), "plan.json", "the recipe")

    def of_shot(self, row: Row) -> Iterator[str]:
        """Differences of a stored shot and its background from the recipe's."""
        composer = self.composer(row.part)
        if composer is None:
            return
        try:
            shot = composer.shot(row)
            wanted = {"shot.json": kept_shot(shot).model_dump_json(), "scenery.json": composer.scenery(shot)}
        except UserError as error:
            if _names_files(self._record.parts[row.part].recipe):
                self.why_not[row.part] = f"shot {row.key} cannot be composed: {error}"
            else:
                yield f"shot {row.key}: expected a shot that the recipe gives, found: {error}"
            return
        self._composed.add(row.key)
        folder = self._dataset.store.shot_folder(row.key)
        for name, text in wanted.items():
            found = _read(folder / name)
            yield from in_words(differences(parsed(text) if text else None, found), f"shot {row.key}: {name}", "the recipe")

    def _portion(self, number: int) -> DatasetPart | None:
        part = self._record.parts[number]
        if not part.is_rendered:
            self.why_not[number] = f"part {number + 1} was rendered elsewhere"
        elif part.version != version("viewsphere"):
            self.why_not[number] = f"made by viewsphere {part.version}"
        elif number not in self.refused and number not in self.why_not:
            try:
                return self.replanned.portion(number)
            except AnotherPlan as error:
                self._judge(number, error.planned)
            except (UserError, ValidationError) as error:
                if self._lacks_files(number):
                    self.why_not[number] = f"its recipe cannot be planned: {error}"
                else:
                    self.refused[number] = (f"plan.json: recipe: {failure('one that can be planned', error)}",)
        return None

    def _lacks_files(self, number: int) -> bool:
        """Return whether a recipe names files that may be missing: files other than models', or a missing model file."""
        recipe, store = self._record.parts[number].recipe, self._dataset.store
        if _names_files({name: value for name, value in recipe.items() if name != "models"}):
            return True
        index = self._record.indices[number]
        rows = (next(index.rows_of(subject)) for subject, _ in zip(index.counts, range(MOST_SUBJECTS), strict=False))
        shots = (store.labelled(row.key) for row in rows if store.has_shot(row.key))
        sources = {thing.model.source for shot in shots if shot for thing in shot.things}
        return not all(is_there(source) or split_source(Path(source))[0].exists() for source in sources)

    def _judge(self, number: int, planned: Plan) -> None:
        """Record whether a part contradicts its recipe, or whether files named by the recipe have changed."""
        contradictions = tuple(self._against(number, planned))
        beside = [path for path, _, _ in contradictions if not path.endswith("digest") and not path.startswith("recipe")]
        by_files = any(map(BY_FILES.search, beside)) or (not beside and _reads_tables(planned))
        if by_files and _names_files(self._record.parts[number].recipe):
            self.why_not[number] = "the files that the recipe names are others now"
        else:
            self.refused[number] = tuple(in_words(iter(contradictions), "plan.json", "the recipe"))

    def _against(self, number: int, last: Plan | None = None) -> Iterator[Difference]:
        """Differences of the data set's plan from the combined plan of the first `number` recipes and a `last` one."""
        record = NOTHING
        for planned in [*map(self.replanned.plan, range(number)), *([last] if last else [])]:
            record = extend(planned, record).record
        wanted, found = (parsed(plan_record.to_json()) for plan_record in (record, self._record))
        if len(record.parts) < len(self._record.parts):
            wanted, found = wanted["parts"][-1], found["parts"][number]
        yield from differences(wanted, found)


def _names_files(recipe: Any) -> bool:
    """Return whether a recipe's plan follows from files beside it."""
    if isinstance(recipe, Mapping):
        return any(_names_files(value) for name, value in recipe.items() if name not in FREE)  # pyright: ignore[reportUnknownVariableType]
    if isinstance(recipe, list | tuple):
        return any(map(_names_files, recipe))  # pyright: ignore[reportUnknownArgumentType]
    return isinstance(recipe, str) and FILE.search(recipe) is not None


def _reads_tables(planned: Plan) -> bool:
    """Return whether a plan follows from the content of files, such as tables of poses and calibrations."""
    path = getattr(planned.recipe.viewpoints, "path", None)
    read = (path, planned.blend, planned.own_rig, planned.tracks, script_digest(planned.recipe))
    return any(table is not None for table in read)


def _inside(text: str, record: PlanRecord) -> Iterator[str]:
    """Contradictions of plan.json that need no recipe: between its fields and those that follow from them."""
    found = parsed(text)
    yield from in_words(differences(parsed(record.to_json()), found), "plan.json", "the rest of it")
    rendered = all(part.is_rendered for part in record.parts)
    merged = [part.merged for part in record.parts]
    if sum(merged) == 1 or merged != sorted(merged, reverse=True):
        yield f"plan.json: expected parts of two merged data sets before all others, or none; found merged: {merged}"
    parts, last = record.parts, record.parts[-1:] if rendered else ()
    firsts = list(accumulate((part.frames for part in parts), initial=0))[:-1]
    follows = {"max_objects": max((part.max_objects for part in parts), default=0)}
    follows |= {f"parts[{i}].first": first for i, first in enumerate(firsts)}
    for part in last:
        follows |= {name: getattr(part, name) for name in ("version", "digest", "name", "recipe", "channels")}
    held = vars(record) | {f"parts[{i}].first": part.first for i, part in enumerate(parts)}
    for name, value in follows.items():
        stored, other = parsed(json.dumps(value)), parsed(json.dumps(held[name]))
        yield from in_words(
            differences(stored, other, name), "plan.json", "the last part" if name in vars(record) else "the order"
        )


def _read(file: Path) -> Any:
    """The value of a JSON file, None if there is no such file."""
    return parsed(read_bytes(file, "MAX_RECORD_BYTES")) if file.is_file() else None
