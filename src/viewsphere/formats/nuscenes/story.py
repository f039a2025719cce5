"""The instants of a sequence by sensor and by object, so that a record can refer to its neighbours in time."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass

from viewsphere.model.sensors.camera import Intrinsics


@dataclass(frozen=True)
class Story:
    """The instants of a sequence in the data set: all of them, by sensor (its place in the rig) and by object id. Also the
    sensors' first lenses, and the splits of the sequence's pictures.
    """

    instants: tuple[int, ...]
    sensors: dict[int, list[int]]
    objects: dict[int, list[int]]
    lenses: dict[int, Intrinsics]
    splits: tuple[str, ...]


def neighbours(instants: Sequence[int], instant: int) -> tuple[int | None, int | None]:
    """The previous and the next instant in a list, None at its ends."""
    place = bisect_left(instants, instant)
    return instants[place - 1] if place else None, instants[place + 1] if place + 1 < len(instants) else None
