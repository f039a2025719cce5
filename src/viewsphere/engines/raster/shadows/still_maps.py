"""Shadow maps of a sequence: still things are drawn once, and moving things are drawn over them at each instant."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.raster.records import Float32, Surfaces

MOST = 8
"""Number of maps of still things that are cached: 4 MB each with 1,024 texels a side."""

STEPS = 16
"""Number of possible positions per map width. So maps that follow moving things keep their place for a while, and the edges of
shadows do, too.
"""

Part = Callable[[], Surfaces]
Key = tuple[bytes, float, float, int]
"""The key of a view: its matrix, its near limit, its tilt and its size."""


@dataclass(frozen=True, eq=False)
class StillMaps:
    """The surfaces of a sequence's still and moving things, and the maps of the still ones.

    still: functions that give the surfaces of each still thing, and of the ground. moving: functions that give the surfaces of
    each moving thing. backdrop: the same maps of scenery alone.
    """

    still: tuple[Part, ...]
    moving: tuple[Part, ...]
    backdrop: StillMaps | None = None
    _maps: dict[Key, Float32] = field(default_factory=dict[Key, Float32])

    @classmethod
    def for_things(cls, part: Callable[[int], Surfaces], count: int, moving: Sequence[int], targets: int) -> StillMaps:
        """The maps for `count` things and the ground, whose surfaces `part` gives, with the indices of the `moving` things;
        things after the first `targets` are scenery.
        """
        moves = set(moving)

        def parts(first: int, are_moving: bool) -> tuple[Part, ...]:
            return tuple(partial(part, i) for i in range(first, count + 1) if (i in moves) == are_moving)

        return cls(parts(0, False), parts(0, True), cls(parts(targets, False), parts(targets, True)))

    def begun(self, key: Key) -> Float32 | None:
        """The map of still things in this view, if it is cached."""
        return self._maps.get(key)

    def keep(self, key: Key, depth: Float32) -> None:
        """Cache the map of still things in this view."""
        if len(self._maps) == MOST:
            del self._maps[next(iter(self._maps))]
        self._maps[key] = depth.copy()


def snapped(span: float, middle: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
    """A width and a middle (2,), from a small set, for a map that contains this one."""
    wide = rounded(span * STEPS / (STEPS - 1))
    step = wide / STEPS
    return wide, np.rint(middle / step) * step


def rounded(length: float) -> float:
    """The next power of the fourth root of 2."""
    return 2.0 ** (math.ceil(4 * math.log2(length)) / 4)
