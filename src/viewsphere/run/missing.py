"""The shots of a data set's part that the store lacks."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from itertools import chain

from viewsphere.planning.extension import DatasetPart
from viewsphere.run.executors import Job
from viewsphere.store import Row, Store


@dataclass(frozen=True)
class Missing:
    """The shots of a portion that the store lacks, row by row, without shots of left-out models.

    The store is searched once, with one look at each shot; no rows are made for complete models. `skipped` maps the keys of
    left-out models and shots to the reasons.
    """

    portion: DatasetPart
    store: Store
    skipped: dict[str, str] = field(default_factory=dict[str, str])

    @cached_property
    def _finished(self) -> frozenset[str]:
        """Keys of the shots that were finished at the first access."""
        return frozenset(self.store.finished())

    @property
    def total(self) -> int:
        """Number of frames in the portion, without left-out frames."""
        indices = self.portion.indices
        if not self.skipped:
            return sum(index.samples for index in indices)
        if self.portion.plan.recipe.scene.is_moved_each_frame:
            return sum(row.count for row in self._wanted())
        cast = self.portion.plan.cast
        left = [name for name in self.portion.plan.varied_subjects if name not in self.skipped]
        whole = [name for name in left if not any(member.key in self.skipped for member in cast(name))]
        return sum(index.samples_of(name) for index in indices for name in whole)

    @cached_property
    def _there(self) -> tuple[Counter[str], int]:
        """The number of shots of each model in `_finished`, and the number of their frames."""
        shots, total = Counter[str](), 0
        for _, subject, frames in chain.from_iterable(index.held(self._finished) for index in self.portion.indices):
            shots[subject] += 1
            total += frames
        return shots, total

    @cached_property
    def _left(self) -> Counter[str]:
        """The number of shots of each incomplete model that `_finished` lacks, in the models' order."""
        return sum((index.counts for index in self.portion.indices), Counter[str]()) - self._there[0]

    @property
    def resumed(self) -> int:
        """Number of the portion's finished frames."""
        return self._there[1]

    def lines(self) -> Iterable[tuple[str, int]]:
        """The models with missing shots, and the number of these shots."""
        return self._left.items()

    def jobs(self, line: str) -> Iterator[Job]:
        """The shots of a model to render."""
        rows = chain.from_iterable(index.rows_of(line) for index in self.portion.indices)
        return (Job(row.key, line, row) for row in self._lacking(rows))

    def rows(self) -> Iterator[Row]:
        """Yield all shots to render."""
        whole = set(self.portion.subjects).difference(self._left)
        return self._lacking(chain.from_iterable(index.without(whole) for index in self.portion.indices))

    def _lacking(self, rows: Iterable[Row]) -> Iterator[Row]:
        left = (row for row in rows if row.key not in self._finished)
        return (row for row in left if not self.store.has_shot(row.key) and not self._lacks_model(row))

    def _wanted(self) -> Iterator[Row]:
        return (row for row in self.portion.rows if not self._lacks_model(row))

    def _lacks_model(self, row: Row) -> bool:
        """Return whether a shot contains a left-out model; a shot whose other models were left out is added to `skipped`."""
        if not self.skipped:
            return False
        if row.subject in self.skipped:
            return True
        lacking = [member.key for member in self.portion.cast(row) if member.key in self.skipped]
        if lacking:
            self.skipped[row.key] = f"in it stands {lacking[0]}, which was left out"
        return bool(lacking)
