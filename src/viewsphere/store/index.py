"""The index of all shots, with the samples of each. Only this module makes and parses keys.

Memory does not grow with the number of samples: rows are computed on request.
"""

from __future__ import annotations

from bisect import bisect_right
from collections import Counter, defaultdict
from collections.abc import Container, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from typing import overload

from viewsphere.model.shard import ALL, Shard

MOST_DIGITS = 100
"""More digits than a position has: a foreign key may end with more digits than Python parses."""

Ranges = tuple[tuple[int, int], ...]
"""Numbers, as ranges [first, stop) in order."""


def under(subject: str, variation: str) -> str:
    """The unique name of a subject under a variation (variation names have no hyphen); without a variation, the subject's own
    name.
    """
    return f"{subject}-{variation}" if variation else subject


def without(subject: str) -> tuple[str, str]:
    """The subject and the variation in a name."""
    name, _, variation = subject.rpartition("-")
    return name, variation


@dataclass(frozen=True, slots=True)
class Row:
    """One shot: its key (stable, unique, valid as a folder's name), its subject, its first sample and number of samples, the
    number of the part that renders it, and the positions of its subject: numbers of poses, or of scenes.
    """

    key: str
    subject: str
    first: int
    count: int
    part: int
    positions: Ranges


@dataclass(frozen=True)
class Block:
    """Subjects with equal positions: each subject, in order, at every position of the ranges, with `each` samples there."""

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
    """The shots of some blocks, in order, each with at most `most` positions: shots of one subject differ by one position at
    most.

    `first` is the number of the first sample, `part` the number of the part that renders the shots; `suffix` ends all keys. An
    index may have only a `shard` of these shots, which are equal to those of the whole index.
    """

    blocks: tuple[Block, ...]
    first: int
    most: int
    part: int
    suffix: str = ""
    shard: Shard = ALL

    def __len__(self) -> int:
        return self.shard.size(self._rows[-1])

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
        row = self.shard.nth(i)
        number = bisect_right(self._rows, row) - 1
        subject, chunk = divmod(row - self._rows[number], self._chunks(number))
        return self._row(number, subject, chunk)

    def __iter__(self) -> Iterator[Row]:
        return self.without(())

    def without(self, subjects: Container[str]) -> Iterator[Row]:
        """The rows of all other subjects, in order. Time does not depend on the number of omitted rows."""
        for number, block in enumerate(self.blocks):
            for place, subject in enumerate(block.subjects):
                if subject not in subjects:
                    yield from (self._row(number, place, chunk) for chunk in self._own(number, place))

    @property
    def samples(self) -> int:
        """Number of all samples."""
        return sum(self._samples_in(number, 0, len(block.subjects)) for number, block in enumerate(self.blocks))

    def rows_of(self, subject: str) -> Iterator[Row]:
        """The rows of a subject, in order."""
        for number, place in self._places.get(subject, ()):
            yield from (self._row(number, place, chunk) for chunk in self._own(number, place))

    def row_of(self, subject: str, place: int) -> Row:
        """One of the rows of a subject, by its place among them; raises IndexError past the end."""
        for number, stretch in self._places.get(subject, ()):
            chunks = self._own(number, stretch)
            if place < len(chunks):
                return self._row(number, stretch, chunks[place])
            place -= len(chunks)
        raise IndexError(f"expected a shot of {subject}, found no {place} more")

    def count_of(self, subject: str) -> int:
        """Number of the rows of a subject."""
        return sum(len(self._own(number, place)) for number, place in self._places.get(subject, ()))

    @property
    def counts(self) -> Counter[str]:
        """Number of the rows of each subject, in order."""
        counts: Counter[str] = Counter()
        for number, block in enumerate(self.blocks):
            for place, subject in enumerate(block.subjects):
                counts[subject] += len(self._own(number, place))
        return counts

    def samples_of(self, subject: str) -> int:
        """Number of the samples of a subject."""
        return sum(self._samples_in(number, place, place + 1) for number, place in self._places.get(subject, ()))

    def positions_of(self, subject: str) -> tuple[Ranges, ...]:
        """The positions at which a subject is taken, block by block."""
        return tuple(self.blocks[number].positions for number, _ in self._places.get(subject, ()))

    @property
    def subjects(self) -> tuple[str, ...]:
        """The subjects, each once, in order."""
        return tuple(self._places)

    def row_at(self, sample: int) -> Row:
        """The row that holds a sample; raises IndexError if no row holds it."""
        if not self.first <= sample < self._samples[-1]:
            raise IndexError(f"expected a sample of {self.first}..{self._samples[-1] - 1}, got {sample}")
        number, subject, chunk = self._place_of(sample)
        if chunk not in self._own(number, subject):
            raise IndexError(f"expected a sample of shard {self.shard}, got {sample}")
        return self._row(number, subject, chunk)

    def find(self, key: str) -> Row | None:
        """The row of this key, None if there is none."""
        return next(self.rows_with_keys((key,)), None)

    def rows_with_keys(self, keys: Iterable[str]) -> Iterator[Row]:
        """The rows of these keys; unknown keys are left out."""
        return (self._row(*spot) for _, spot in self._spots(keys))

    def held(self, keys: Iterable[str]) -> Iterator[tuple[str, str, int]]:
        """Key, subject and number of samples of the rows of `rows_with_keys`, in a fraction of the time."""
        for key, (number, subject, chunk) in self._spots(keys):
            block = self.blocks[number]
            yield key, block.subjects[subject], (self._edge(number, chunk + 1) - self._edge(number, chunk)) * block.each

    def _spots(self, keys: Iterable[str]) -> Iterator[tuple[str, tuple[int, int, int]]]:
        """The known keys, each with its block, its subject's place in the block, and its chunk of the subject.

        The chunk for each key ending is computed only once.
        """
        ends: dict[tuple[int, str], int | None] = {}
        for key in keys:
            subject, _, end = key.rpartition("-")
            for number, place in self._places.get(subject, ()):
                if (number, end) not in ends:
                    ends[number, end] = self._chunk_of(number, end)
                chunk = ends[number, end]
                if chunk is not None and (self.shard.is_all or chunk in self._own(number, place)):
                    yield key, (number, place, chunk)

    def _chunk_of(self, number: int, end: str) -> int | None:
        """The chunk of a block's subjects whose key has this end, None if there is none."""
        digits = end.removesuffix(self.suffix)
        if not digits.isdecimal() or len(digits) >= MOST_DIGITS or end != self._end(int(digits)):
            return None
        offset = _offset(self.blocks[number].positions, int(digits))
        if offset is None:
            return None
        chunk = -(-offset * self._chunks(number) // self.blocks[number].size)
        return chunk if self._edge(number, chunk) == offset else None

    def _end(self, position: int) -> str:
        """Return the end of a shot's key, after its subject and a hyphen, from its first position."""
        return f"{position:06d}{self.suffix}"

    def _row(self, number: int, subject: int, chunk: int) -> Row:
        block, (size, chunks) = self.blocks[number], self._sizes[number]
        begin, end = chunk * size // chunks, (chunk + 1) * size // chunks
        positions = _cut(block.positions, begin, end)
        name = block.subjects[subject]
        first = self._samples[number] + (subject * size + begin) * block.each
        key = f"{name}-{self._end(positions[0][0])}"
        return Row(key, name, first, (end - begin) * block.each, self.part, positions)

    def _place_of(self, sample: int) -> tuple[int, int, int]:
        """The block that holds a sample, its subject's place in the block, and its chunk of the subject."""
        number = bisect_right(self._samples, sample) - 1
        block = self.blocks[number]
        subject, position = divmod((sample - self._samples[number]) // block.each, block.size)
        chunk = min((position + 1) * self._chunks(number) // block.size, self._chunks(number) - 1)
        while self._edge(number, chunk) > position:
            chunk -= 1
        return number, subject, chunk

    def _own(self, number: int, subject: int) -> range:
        """Return the chunks of a block's subject that are in the shard."""
        chunks = self._chunks(number)
        first = self.shard.next(self._rows[number] + subject * chunks) - self._rows[number] - subject * chunks
        return range(first, chunks, self.shard.of)

    def _samples_in(self, number: int, begin: int, end: int) -> int:
        """Number of the samples of the subjects begin..end-1 of a block, without counting out their rows."""
        block, chunks = self.blocks[number], self._chunks(number)
        if self.shard.is_all or not chunks:
            return (end - begin) * block.size * block.each
        first = self.shard.next(self._rows[number] + begin * chunks) - self._rows[number]
        rows = range(first, end * chunks, self.shard.of)
        # Before the row q of a block are floor(q * size / chunks) of its positions, whichever subject it is of.
        before, until = (
            _floor_sum(len(rows), chunks, self.shard.of * block.size, row * block.size) for row in (first, first + 1)
        )
        return (until - before) * block.each

    def _chunks(self, number: int) -> int:
        return self._sizes[number][1]

    def _edge(self, number: int, chunk: int) -> int:
        size, chunks = self._sizes[number]
        return chunk * size // chunks

    @cached_property
    def _sizes(self) -> list[tuple[int, int]]:
        """Positions and chunks of each subject, block by block."""
        return [(block.size, -(-block.size // self.most)) for block in self.blocks]

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
        """For each subject, its blocks and its place in each."""
        places: defaultdict[str, list[tuple[int, int]]] = defaultdict(list)
        for number, block in enumerate(self.blocks):
            for place, subject in enumerate(block.subjects):
                places[subject].append((number, place))
        return dict(places)


def _floor_sum(count: int, divisor: int, step: int, start: int) -> int:
    """The sum of (start + i * step) // divisor for i in 0..count-1, all of them positive or 0, in as many steps as Euclid's
    algorithm takes for `divisor` and `step`.
    """
    total = 0
    while count:
        total += count * (count - 1) // 2 * (step // divisor) + count * (start // divisor)
        step, start = step % divisor, start % divisor
        count, start = divmod(step * count + start, divisor)
        step, divisor = divisor, step
    return total


def length(ranges: Ranges) -> int:
    """Return the count of all numbers in the ranges."""
    return sum(stop - first for first, stop in ranges)


def numbers(ranges: Ranges) -> Iterator[int]:
    """The numbers, in order."""
    for first, stop in ranges:
        yield from range(first, stop)


def nth(ranges: Ranges, place: int) -> int:
    """The number at a place, counted from 0; raises IndexError past the end."""
    ranges_of_one = _cut(ranges, place, place + 1)
    return ranges_of_one[0][0]


def _cut(ranges: Ranges, begin: int, end: int) -> Ranges:
    """The begin-th number to the one before the end-th."""
    cut: list[tuple[int, int]] = []
    before = 0
    for first, stop in ranges:
        low, high = max(begin - before, 0) + first, min(end - before, stop - first) + first
        if low < high:
            cut.append((low, high))
        before += stop - first
    return tuple(cut)


def _offset(ranges: Ranges, number: int) -> int | None:
    """Return the number of earlier numbers in the ranges, None if this number is absent."""
    before = 0
    for first, stop in ranges:
        if first <= number < stop:
            return before + number - first
        before += stop - first
    return None
