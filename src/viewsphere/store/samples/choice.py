"""A part of a data set: frames by their numbers and by their models."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

from viewsphere.errors import UserError


@dataclass(frozen=True)
class Choice:
    """The chosen frames of a data set: those of chosen models with chosen numbers.

    Attributes:
        models: Patterns of models' keys, such as `car-*`; empty: all models.
        frames: Ranges [first, stop) of frames' numbers; empty: all numbers.
    """

    models: tuple[str, ...] = ()
    frames: tuple[tuple[int, int], ...] = ()

    @property
    def is_some(self) -> bool:
        """Return whether the choice leaves anything out."""
        return bool(self.models or self.frames)

    def has_model(self, key: str) -> bool:
        """Return whether the choice includes frames of this model."""
        return not self.models or any(fnmatchcase(key, pattern) for pattern in self.models)

    def may_have(self, beginning: str) -> bool:
        """Return whether a pattern may match keys with this beginning."""
        literal = (re.split(r"[*?[]", pattern, maxsplit=1)[0] for pattern in self.models)
        return any(text.startswith(beginning) or beginning.startswith(text) for text in literal)

    def places(self, first: int, count: int) -> Sequence[int]:
        """Return the chosen frames among first, first + 1, ..., first + count - 1, counted from 0."""
        if not self.frames:
            return range(count)
        return [i for i in range(count) if any(low <= first + i < stop for low, stop in self.frames)]


def frame_ranges(text: str) -> tuple[tuple[int, int], ...]:
    """The frames in a text such as `0-15,40`, both ends included, as ranges [first, stop).

    Raises UserError for anything else.
    """
    ranges: list[tuple[int, int]] = []
    for part in filter(None, (part.strip() for part in text.split(","))):
        first, dash, last = part.partition("-")
        if not first.isdecimal() or (dash and not (last.isdecimal() and int(last) >= int(first))):
            raise UserError(f"--frames: expected numbers and ranges, such as 0-15,40; found {part!r}")
        ranges.append((int(first), int(last or first) + 1))
    if not ranges:
        raise UserError(f"--frames: expected numbers and ranges, such as 0-15,40; found {text!r}")
    return tuple(ranges)
