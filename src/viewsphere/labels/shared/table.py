"""Labels by name, each imported when it is first read."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import TypeVar

T = TypeVar("T")


class Table(Mapping[str, T]):
    """Labels, or facts about them, by name. Reading a name imports only its label; iterating over the table imports all."""

    def __init__(self, names: Callable[[], Iterable[str]], of: Callable[[str], T | None]) -> None:
        self._names, self._of = names, of

    def __getitem__(self, name: str) -> T:
        found = self._of(name)
        if found is None:
            raise KeyError(name)
        return found

    def __iter__(self) -> Iterator[str]:
        return (name for name in self._names() if self._of(name) is not None)

    def __len__(self) -> int:
        return sum(1 for _ in self)
