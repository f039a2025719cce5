"""Shadow maps of a sequence: what stands still is drawn once, and what moves over it at each instant."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.raster.records import Float32, Surfaces

MOST = 8
"""Maps of what stands still that are kept: 4 MB each with 1,024 texels a side."""

STEPS = 16
"""Places a map's width at which it may lie: maps that follow what moves stay where they are for a while, and so do the edges
of shadows.
"""

Key = tuple[bytes, float, float, int]
"""Of a view: its matrix, where it begins, its tilt and its size."""


@dataclass(frozen=True, eq=False)
class StillMaps:
    """Surfaces of things that stand still in a sequence, and the ground's; of those that move; and maps of the former. They
    share all arrays, each with its own range of triangles. backdrop: the same of scenery alone.
    """

    still: tuple[Surfaces, ...]
    moving: tuple[Surfaces, ...]
    backdrop: StillMaps | None = None
    _maps: dict[Key, Float32] = field(default_factory=dict[Key, Float32])

    @classmethod
    def of(cls, surfaces: Surfaces, triangle_start: Sequence[int], moving: Sequence[int], targets: int) -> StillMaps:
        """Of the triangles of things, thing i's beginning at `triangle_start[i]`, of which these are `moving`; those behind the
        first `targets` are scenery.
        """
        own = [part_of(surfaces, *span) for span in pairwise((*triangle_start, len(surfaces.triangles)))]
        moves = set(moving)

        def parts(first: int, are_moving: bool) -> tuple[Surfaces, ...]:
            return tuple(part for i, part in enumerate(own) if i >= first and (i in moves) == are_moving)

        return cls(parts(0, False), parts(0, True), cls(parts(targets, False), parts(targets, True)))

    def begun(self, key: Key) -> Float32 | None:
        """The map of what stands still in this view, if it is kept."""
        return self._maps.get(key)

    def keep(self, key: Key, depth: Float32) -> None:
        """Keep the map of what stands still in this view."""
        if len(self._maps) == MOST:
            del self._maps[next(iter(self._maps))]
        self._maps[key] = depth.copy()


def part_of(surfaces: Surfaces, first: int, stop: int | None = None) -> Surfaces:
    """Triangles [first, stop) alone."""
    return surfaces._replace(triangles=surfaces.triangles[first:stop], material=surfaces.material[first:stop])


def snapped(span: float, middle: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
    """A width and a middle (2,), of which there are few, for a map that holds what this one does."""
    wide = rounded(span * STEPS / (STEPS - 1))
    step = wide / STEPS
    return wide, np.rint(middle / step) * step


def rounded(length: float) -> float:
    """The next power of the fourth root of 2."""
    return 2.0 ** (math.ceil(4 * math.log2(length)) / 4)
