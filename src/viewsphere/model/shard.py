"""Shards of what there is to do: which each has follows from their numbers alone."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import islice
from typing import TypeVar

T = TypeVar("T")


@dataclass(frozen=True)
class Shard:
    """Every `of`-th of some things, from the `number`-th on, counted from 0: shards together have each of them once."""

    number: int = 0
    of: int = 1

    def __str__(self) -> str:
        return f"{self.number}/{self.of}"

    @property
    def is_all(self) -> bool:
        """Return whether it has all of them."""
        return self.of == 1

    def __call__(self, things: Iterable[T]) -> Iterator[T]:
        """This shard of them, in their order."""
        return islice(things, self.number, None, self.of)

    def has(self, number: int) -> bool:
        """Return whether the thing of this number, counted from 0, is in it."""
        return number % self.of == self.number

    def nth(self, place: int) -> int:
        """The number of the thing that is at this place in it."""
        return self.number + place * self.of

    def next(self, number: int) -> int:
        """The number of the first thing in it that is not before this one."""
        return number + (self.number - number) % self.of

    def size(self, count: int) -> int:
        """Return the number of items, of `count`, that the shard has."""
        return len(range(self.number, count, self.of))

    def parted(self, inner: Shard) -> Shard:
        """A shard of this shard."""
        return Shard(self.number + inner.number * self.of, self.of * inner.of)


ALL = Shard()
"""The one shard that has everything."""
