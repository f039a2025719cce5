"""Shards of the work: the items of each shard follow from its numbers alone."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import islice
from typing import TypeVar

T = TypeVar("T")


@dataclass(frozen=True)
class Shard:
    """Every `of`-th item of a sequence, from the `number`-th on, counted from 0: together, the shards have each item once."""

    number: int = 0
    of: int = 1

    def __str__(self) -> str:
        return f"{self.number}/{self.of}"

    @property
    def is_all(self) -> bool:
        """Return whether the shard has all items."""
        return self.of == 1

    def __call__(self, things: Iterable[T]) -> Iterator[T]:
        """The items of this shard, in order."""
        return islice(things, self.number, None, self.of)

    def has(self, number: int) -> bool:
        """Return whether the shard has the item of this number, counted from 0."""
        return number % self.of == self.number

    def nth(self, place: int) -> int:
        """The number of the item at this place in the shard."""
        return self.number + place * self.of

    def next(self, number: int) -> int:
        """The smallest number in the shard that is at least `number`."""
        return number + (self.number - number) % self.of

    def size(self, count: int) -> int:
        """Return the number of items, of `count`, that the shard has."""
        return len(range(self.number, count, self.of))

    def parted(self, inner: Shard) -> Shard:
        """A shard of this shard."""
        return Shard(self.number + inner.number * self.of, self.of * inner.of)


ALL = Shard()
"""The shard that has all items."""
