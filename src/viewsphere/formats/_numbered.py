"""Numbers of classes in data sets that have a fixed list of these."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from viewsphere.model.classes import STUFF_IDS, SemanticClass


@dataclass(frozen=True, eq=False)
class Numbered:
    """`table` (N,): numbers by the ids of classes; `own`: the names of categories that the list lacks, by their numbers."""

    table: NDArray[np.uint8]
    own: Mapping[int, str]

    @classmethod
    def of(
        cls, classes: Iterable[SemanticClass], stuff: Mapping[str, int], things: Mapping[str, int], rest: int, first: int | None
    ) -> Numbered:
        """Of a data set's classes. `stuff`, `things`: numbers by names, whatever their case and whether words are joined; other
        stuff is `rest`, and so are other things where `first` is None; else they are counted from there.
        """
        numbers = {0: rest} | {i: stuff.get(name, rest) for name, i in STUFF_IDS.items()}
        own = dict[int, str]()
        for one in classes:
            if one.is_thing:
                known = things.get(plain(one.name))
                if known is None and first is not None:
                    known = first + len(own)
                    own[known] = one.name
                numbers[one.id] = rest if known is None else known
        table = np.zeros(max(numbers) + 1, np.uint8)
        table[list(numbers)] = list(numbers.values())
        return cls(table, own)


def plain(name: str) -> str:
    """A name in small letters, words joined: `Traffic_sign` is `trafficsign`."""
    return "".join(character for character in name.casefold() if character.isalnum())
