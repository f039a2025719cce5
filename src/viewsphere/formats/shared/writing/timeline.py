"""The sequences of a data set, from its plan: their numbers, first samples and shots, without a list of all samples."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache

from viewsphere.errors import UserError
from viewsphere.formats import Scope
from viewsphere.model.sample import Sample
from viewsphere.model.shot import Shot
from viewsphere.recipe.cameras.sequence import TimeEntry
from viewsphere.store import Dataset, PlanRecord
from viewsphere.store.index import Block

KNOWN = "shots with their rigs, which imported and merged data sets do not have"

SHOTS = 4
"""Number of shots to cache."""


@dataclass(frozen=True)
class Course:
    """One sequence: its number in the plan, from 0; its samples, [first, stop); the requested number of instants, and the
    number of samples in each.
    """

    number: int
    first: int
    stop: int
    instants: int
    each: int


def unknown_shots(scope: Scope) -> Iterator[str]:
    """Reasons to refuse, for a format that requires the mounts of sensors."""
    if scope.rig is None:
        yield f"expected {KNOWN}; found none"


class Timeline:
    """All sequences of a data set, including those that are not chosen."""

    def __init__(self, dataset: Dataset) -> None:
        self._dataset = dataset
        self._runs = _runs(dataset.plan)
        self._firsts = [run.first for run in self._runs]
        self._labelled = lru_cache(maxsize=SHOTS)(dataset.labelled)

    def course(self, sample: Sample) -> Course:
        """The sequence of a sample. Raises UserError for a still picture."""
        place = bisect_right(self._firsts, sample.index) - 1
        run = self._runs[place] if place >= 0 else None
        if run is None or not sample.sequence or sample.index >= run.first + run.block.samples:
            raise UserError(f"frame {sample.index}: expected one of a sequence; found a still picture")
        each = run.block.size * run.block.each
        subject = (sample.index - run.first) // each
        number, first = run.number + subject, run.first + subject * each
        stop = first + each
        while place and self._runs[place].first == first and self._runs[place].number == self._runs[place - 1].number:
            place -= 1
            first = self._runs[place].first
        while place + 1 < len(self._runs) and self._runs[place + 1].number == number:
            place += 1
            stop = self._runs[place].first + self._runs[place].block.samples
        return Course(number, first, stop, run.instants, run.block.each)

    def shot(self, sample: Sample) -> Shot | None:
        """The shot of a sample; None for a picture that is imported or from a merged data set."""
        return None if sample.origin is None else self._labelled(sample.origin.key)

    def position(self, sample: Sample) -> tuple[Shot, int, int]:
        """The shot of a sample, with the sample's instant and sensor in it. Raises UserError if the shot is unknown."""
        shot = self.shot(sample)
        if shot is None or sample.origin is None:
            raise UserError(f"frame {sample.index}: expected {KNOWN}; found none")
        return shot, sample.origin.instant, sample.origin.sensor

    def shots(self, course: Course) -> Iterator[Shot]:
        """The finished shots of a sequence, in order."""
        index = course.first
        while index < course.stop:
            row = self._dataset.plan.row_at(index)
            shot = self._labelled(row.key)
            if shot is not None:
                yield shot
            index = row.first + row.count

    def is_first(self, sample: Sample) -> bool:
        """Return whether no earlier instant of the sequence has a sample of the same sensor in the data set."""
        course = self.course(sample)
        return not any(map(self.has, range(sample.index - course.each, course.first - 1, -course.each)))

    def has(self, index: int) -> bool:
        """Return whether a sample is available: finished and chosen."""
        place = bisect_right(self._there, index, key=lambda span: span[0]) - 1
        return place >= 0 and index < self._there[place][1]

    @cached_property
    def _there(self) -> list[tuple[int, int]]:
        """The available samples as ranges [first, stop); a single range if all samples are available."""
        found: list[tuple[int, int]] = []
        for key, places in self._dataset.shots():
            row = self._dataset.plan.find(key)
            for index in () if row is None else (row.first + place for place in places):
                if found and found[-1][1] == index:
                    found[-1] = (found[-1][0], index + 1)
                else:
                    found.append((index, index + 1))
        return found


@dataclass(frozen=True)
class _Run:
    """A block of the plan that continues a sequence or whose subjects are one sequence each; its first sample, and the number
    of its first sequence.
    """

    block: Block
    first: int
    number: int
    instants: int


def _runs(plan: PlanRecord) -> list[_Run]:
    """The runs of a plan. In merged data sets that were incomplete, a block holds one shot's part of a sequence."""
    found: list[_Run] = []
    number, last = 0, None
    for place, part in enumerate(plan.parts):
        first, count = part.first, _instants(part.recipe) if part.is_sampled else 0
        for block in part.blocks if count else ():
            view = (place, block.subjects[0], block.positions[0][0] // count)
            number -= view == last
            found.append(_Run(block, first, number, count))
            number, first = number + len(block.subjects), first + block.samples
            last = view if len(block.subjects) == 1 else None
    return found


def _instants(recipe: dict[str, object]) -> int:
    time = recipe.get("time")
    return TimeEntry.model_validate(time).count if time else 0
