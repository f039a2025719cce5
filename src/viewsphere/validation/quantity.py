"""Numbers of things, and lists of names, in words."""

from __future__ import annotations

from collections.abc import Sequence

MOST_NAMED = 5
"""Number of names that a line shows; readers skip longer lists."""


def quantity(number: int, noun: str, plural: str = "") -> str:
    """The number and its noun: `1 frame`, `1,200 frames`; `plural` is for irregular plurals."""
    return f"{number:,} {noun if number == 1 else plural or f'{noun}s'}"


def first_few(names: Sequence[str]) -> str:
    """The first names, and how many more there are: `a, b, c, d, e and 15 more`."""
    more = f" and {len(names) - MOST_NAMED:,} more" if len(names) > MOST_NAMED else ""
    return ", ".join(names[:MOST_NAMED]) + more
