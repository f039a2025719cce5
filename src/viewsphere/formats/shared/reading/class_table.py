"""Numbers of classes in data sets with a fixed list of classes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from viewsphere.model.annotations.classes import STUFF_IDS, SemanticClass


@dataclass(frozen=True, eq=False)
class Numbered:
    """`table` (N,): numbers by the ids of classes; `own`: names of categories that the list lacks, by numbers."""

    table: NDArray[np.uint8]
    own: Mapping[int, str]

    @classmethod
    def from_classes(
        cls,
        classes: Iterable[SemanticClass],
        stuff: Mapping[str, int],
        things: Mapping[str, int],
        other: int,
        *,
        counted: bool = True,
    ) -> Numbered:
        """The numbers of a data set's classes. `stuff`, `things`: numbers by names, normalised by `_plain` for things. Other
        stuff is 0. Other things are `other` or, if `counted`, are numbered from `other`.
        """
        numbers = {0: 0} | {i: stuff.get(name, 0) for name, i in STUFF_IDS.items()}
        own = dict[int, str]()
        for one in classes:
            if one.is_thing:
                known = things.get(_plain(one.name))
                if known is None:
                    known = other + len(own) * counted
                    own[known] = one.name
                numbers[one.id] = known
        table = np.zeros(max(numbers) + 1, np.uint8)
        table[list(numbers)] = list(numbers.values())
        return cls(table, own)


def _plain(name: str) -> str:
    """A name in small letters, words joined: `Traffic_sign` is `trafficsign`."""
    return "".join(character for character in name.casefold() if character.isalnum())
