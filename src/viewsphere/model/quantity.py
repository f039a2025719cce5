"""Numbers of things in words."""

from __future__ import annotations


def quantity(number: int, noun: str, plural: str = "") -> str:
    """The number and its noun: `1 frame`, `1,200 frames`; `plural` where that is not the noun with an s."""
    return f"{number:,} {noun if number == 1 else plural or f'{noun}s'}"
