"""In which order the frames of a plan are rendered, and which of them stay together: what loaders share out and shuffle."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import chain

from viewsphere.composing.seeds import generator
from viewsphere.planning.plan import Plan
from viewsphere.store import Row
from viewsphere.store.index import Index


@dataclass(frozen=True, eq=False)
class Turns:
    """The turns of a plan: a turn is one pose of one subject, by all sensors, or `most` poses at most; or a whole sequence,
    whose instants stay in order.
    """

    plan: Plan
    most: int = 1

    @cached_property
    def _index(self) -> Index:
        time = self.plan.recipe.time
        return Index(self.plan.blocks, 0, self.most if time is None else time.count, 0)

    def __len__(self) -> int:
        return len(self._index)

    def in_order(self) -> Iterator[Row]:
        """Yield all turns, subject by subject."""
        return chain.from_iterable(map(self._index.of, self.plan.taken))

    def shuffled(self, epoch: int) -> Iterator[Row]:
        """Yield all turns in an order that the recipe's seed and the epoch draw."""
        rng = generator(self.plan.recipe.lasting_seed, "turns", str(epoch))
        return (self._index[int(number)] for number in rng.permutation(len(self)))

    def rows(self, turn: Row) -> Iterator[Row]:
        """The shots of a turn: a sequence is rendered in the shots that the plan cuts it into."""
        if self.plan.recipe.time is None:
            yield turn
            return
        first, end = turn.first, turn.first + turn.count
        while first < end:
            row = self.plan.rows.at(first)
            yield row
            first = row.first + row.count
