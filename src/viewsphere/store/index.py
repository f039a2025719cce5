"""The index of all shots: which samples each of them holds. Keys are made and read here, and nowhere else.

Nothing here grows with the number of samples: rows are counted out when somebody asks for them.
"""

from __future__ import annotations

from bisect import bisect_right
from collections import Counter, defaultdict
from collections.abc import Container, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from typing import overload

Ranges = tuple[tuple[int, int], ...]
"""Numbers, as ranges [first, stop) in order."""


@dataclass(frozen=True, slots=True)
class Row:
    """One shot: its key (stable, unique, fit for a folder's name), what it shows, its first sample and number of samples, the
    number of the part that renders it, and at which positions its subject is taken: numbers of poses, or of scenes.
    """

    key: str
    subject: str
    first: int
    count: int
    part: int
    positions: Ranges


@dataclass(frozen=True)
class Block:
    """Subjects that were taken alike: every one, in order, at every position of the ranges, with `each` samples there."""

    subjects: tuple[str, ...]
    positions: Ranges
    each: int = 1

    @property
    def size(self) -> int:
        """Positions of each subject."""
        return length(self.positions)

    @property
    def samples(self) -> int:
        """Number of all samples."""
        return len(self.subjects) * self.size * self.each


@dataclass(frozen=True, eq=False)
class Index(Sequence[Row]):
    """The shots of some blocks, in order, of `most` positions at most: those of one subject differ by one position at most.

    `first` is the number of the first sample, `part` that of the part that renders them; `suffix` ends all keys.
    """

    blocks: tuple[Block, ...]
    first: int
    most: int
    part: int
    suffix: str = ""

    def __len__(self) -> int:
        return self._rows[-1]

    @overload
    def __getitem__(self, index: int) -> Row: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Row]: ...
    def __getitem__(self, index: int | slice) -> Row | Sequence[Row]:
        """The i-th row; raises IndexError past the end."""
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        i = index + len(self) if index < 0 else index
        if not 0 <= i < len(self):
            raise IndexError(f"expected a shot of 0..{len(self) - 1}, got {index}")
        number = bisect_right(self._rows, i) - 1
        subject, chunk = divmod(i - self._rows[number], self._chunks(number))
        return self._row(number, subject, chunk)

    def __iter__(self) -> Iterator[Row]:
        return self.without(())

    def without(self, subjects: Container[str]) -> Iterator[Row]:
        """The rows of all other subjects, in order; however many those of these are, they take no time."""
        for number, block in enumerate(self.blocks):
            for place, subject in enumerate(block.subjects):
                if subject not in subjects:
                    yield from (self._row(number, place, chunk) for chunk in range(self._chunks(number)))

    @property
    def samples(self) -> int:
        """Number of all samples."""
        return self._samples[-1] - self.first

    def of(self, subject: str) -> Iterator[Row]:
        """The rows of a subject, in order."""
        for number, place in self._places.get(subject, ()):
            yield from (self._row(number, place, chunk) for chunk in range(self._chunks(number)))

    def row_of(self, subject: str, place: int) -> Row:
        """One of the rows of a subject, by its place among them; raises IndexError past the end."""
        for number, own in self._places.get(subject, ()):
            if place < self._chunks(number):
                return self._row(number, own, place)
            place -= self._chunks(number)
        raise IndexError(f"expected a shot of {subject}, found no {place} more")

    def count_of(self, subject: str) -> int:
        """Number of the rows of a subject."""
        return sum(self._chunks(number) for number, _ in self._places.get(subject, ()))

    @property
    def counts(self) -> Counter[str]:
        """Number of the rows of each subject, in order."""
        found: Counter[str] = Counter()
        for number, block in enumerate(self.blocks):
            each = self._chunks(number)
            for subject in block.subjects:
                found[subject] += each
        return found

    def samples_of(self, subject: str) -> int:
        """Number of the samples of a subject."""
        return sum(self.blocks[number].size * self.blocks[number].each for number, _ in self._places.get(subject, ()))

    def taken(self, subject: str) -> tuple[Ranges, ...]:
        """The positions at which a subject is taken, block by block."""
        return tuple(self.blocks[number].positions for number, _ in self._places.get(subject, ()))

    @property
    def subjects(self) -> tuple[str, ...]:
        """All subjects, each once, in order."""
        return tuple(self._places)

    def at(self, sample: int) -> Row:
        """The row that holds a sample; raises IndexError for one that none holds."""
        if not self.first <= sample < self._samples[-1]:
            raise IndexError(f"expected a sample of {self.first}..{self._samples[-1] - 1}, got {sample}")
        number = bisect_right(self._samples, sample) - 1
        block = self.blocks[number]
        subject, position = divmod((sample - self._samples[number]) // block.each, block.size)
        chunk = min((position + 1) * self._chunks(number) // block.size, self._chunks(number) - 1)
        while self._edge(number, chunk) > position:
            chunk -= 1
        return self._row(number, subject, chunk)

    def find(self, key: str) -> Row | None:
        """The row of this key, None if there is none."""
        if not key.endswith(self.suffix):
            return None
        subject, _, digits = key[: len(key) - len(self.suffix)].rpartition("-")
        for number, place in self._places.get(subject, ()) if digits.isdecimal() else ():
            offset = _offset(self.blocks[number].positions, int(digits))
            if offset is not None:
                row = self.at(self._samples[number] + (place * self.blocks[number].size + offset) * self.blocks[number].each)
                return row if row.key == key else None
        return None

    def _row(self, number: int, subject: int, chunk: int) -> Row:
        block = self.blocks[number]
        begin, end = self._edge(number, chunk), self._edge(number, chunk + 1)
        positions = _cut(block.positions, begin, end)
        name = block.subjects[subject]
        first = self._samples[number] + (subject * block.size + begin) * block.each
        key = f"{name}-{positions[0][0]:06d}{self.suffix}"
        return Row(key, name, first, (end - begin) * block.each, self.part, positions)

    def _chunks(self, number: int) -> int:
        return -(-self.blocks[number].size // self.most)

    def _edge(self, number: int, chunk: int) -> int:
        return chunk * self.blocks[number].size // self._chunks(number)

    @cached_property
    def _rows(self) -> list[int]:
        """Rows before each block, and the number of all."""
        counts = (len(block.subjects) * self._chunks(i) for i, block in enumerate(self.blocks))
        return list(accumulate(counts, initial=0))

    @cached_property
    def _samples(self) -> list[int]:
        """The first sample of each block, and the one after the last."""
        return list(accumulate((block.samples for block in self.blocks), initial=self.first))

    @cached_property
    def _places(self) -> dict[str, list[tuple[int, int]]]:
        """Of each subject: the blocks that it is in, and its place there."""
        places: defaultdict[str, list[tuple[int, int]]] = defaultdict(list)
        for number, block in enumerate(self.blocks):
            for place, subject in enumerate(block.subjects):
                places[subject].append((number, place))
        return dict(places)


def length(ranges: Ranges) -> int:
    """How many numbers there are."""
    return sum(stop - first for first, stop in ranges)


def numbers(ranges: Ranges) -> Iterator[int]:
    """The numbers, in order."""
    for first, stop in ranges:
        yield from range(first, stop)


def nth(ranges: Ranges, place: int) -> int:
    """The number at a place, counted from 0; raises IndexError past the end."""
    found = _cut(ranges, place, place + 1)
    return found[0][0]


def _cut(ranges: Ranges, begin: int, end: int) -> Ranges:
    """The begin-th number to the one before the end-th."""
    found: list[tuple[int, int]] = []
    before = 0
    for first, stop in ranges:
        low, high = max(begin - before, 0) + first, min(end - before, stop - first) + first
        if low < high:
            found.append((low, high))
        before += stop - first
    return tuple(found)


def _offset(ranges: Ranges, number: int) -> int | None:
    """How many numbers come before this one, None if it is not there."""
    before = 0
    for first, stop in ranges:
        if first <= number < stop:
            return before + number - first
        before += stop - first
    return None
