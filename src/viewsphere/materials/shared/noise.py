"""Tileable noise and cells, and functions of them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from viewsphere.materials.shared.kernels_noise import add_noise, find_cells
from viewsphere.materials.shared.surface import Map

Cells = int | tuple[int, int]
"""Number of cells along each side, or across and down."""


def noise(size: int, cells: Cells, seed: int, octaves: int = 1, gain: float = 0.5) -> Map:
    """Sum of gradient noise, each octave twice as fine and `gain` times as strong as the one before; about -1 to 1.

    Octaves that are too fine for the texels are left out, so that a larger map shows the same pattern in more detail.
    """
    out, amplitude, total = np.zeros((size, size), np.float32), 1.0, 0.0
    across, down = (cells, cells) if isinstance(cells, int) else cells
    for octave in range(octaves):
        total += amplitude
        if 2 * max(across, down) <= size:
            add_noise(out, across, down, amplitude, seed + 7919 * octave)
        across, down, amplitude = 2 * across, 2 * down, amplitude * gain
    out /= np.float32(total)
    return out


class _CellMaps(NamedTuple):
    """Distance to the nearest and second nearest point, in cells, and a number, 0 up to 1, of each cell."""

    nearest: Map
    second: Map
    chance: Map

    @property
    def border(self) -> Map:
        """0 on the border between two cells, growing inwards."""
        return self.second - self.nearest


def cells(size: int, count: Cells, seed: int, jitter: float = 1.0) -> _CellMaps:
    """Irregular cells about one point in each square of a lattice; jitter 0: the lattice's squares themselves."""
    maps = _CellMaps(*(np.empty((size, size), np.float32) for _ in range(3)))
    find_cells(*maps, *((count, count) if isinstance(count, int) else count), jitter, seed)
    return maps


def smooth(low: float, high: float, values: Map) -> Map:
    """0 up to `low`, 1 from `high` on, without a kink between; high may be the lower one."""
    t = np.clip((values - np.float32(low)) / np.float32(high - low), 0, 1)
    return t * t * (3 - 2 * t)


def wave(turns: Map) -> Map:
    """The sine of a number of turns, to a thousandth, made of parabolas, which every processor rounds identically."""
    t = turns - np.floor(turns + np.float32(0.5))
    first = 8 * t - 16 * t * np.abs(t)
    return first * (np.float32(0.775) + np.float32(0.225) * np.abs(first))
