"""Bricks, tiles, stones and boards: courses, each cut into pieces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from viewsphere.materials.shared.surface import Map


@dataclass(frozen=True, eq=False)
class Courses:
    """The place of each texel in its piece.

    `piece`: its piece's number; `across`, `down`: metres from its left and upper edge; `edge`: metres to the middle of the
    nearest joint; `length`, `width`: metres of its piece.
    """

    piece: NDArray[np.intp]
    across: Map
    down: Map
    edge: Map
    length: Map
    width: Map
    count: int

    def each(self, values: NDArray[np.float64]) -> Map:
        """Map of numbers (count,), one per piece, at the piece's texels."""
        return values.astype(np.float32)[self.piece]


def courses(size: int, metres: float, rows: NDArray[np.float64], cuts: NDArray[np.float64]) -> Courses:
    """Of courses between `rows` (R + 1,), ascending from 0 to 1, course r cut at `cuts[r]`, ascending shares (C,) of the
    square, of which the last piece runs on into the first.
    """
    at = (np.arange(size) + 0.5) / size
    count = cuts.shape[1]
    row = np.searchsorted(rows, at, side="right") - 1
    column = np.stack([np.searchsorted(cut, at, side="right") - 1 for cut in cuts])  # -1 belongs to the last piece
    number = column % count
    ends = np.concatenate([cuts[:, 1:], cuts[:, :1] + 1], axis=1)
    lengths = np.take_along_axis(ends - cuts, number, axis=1)
    left = (at - np.take_along_axis(cuts, number, axis=1)) % 1.0
    aside = np.minimum(left, lengths - left)
    above, widths = at - rows[row], np.diff(rows)[row]
    upright = np.minimum(above, widths - above)

    def spread(values: NDArray[np.float64]) -> Map:
        return np.broadcast_to(values * metres, (size, size)).astype(np.float32)

    return Courses(
        piece=(number + np.arange(len(cuts))[:, None] * count)[row],
        across=spread(left[row]),
        down=spread(above[:, None]),
        edge=spread(np.minimum(aside[row], upright[:, None])),
        length=spread(lengths[row]),
        width=spread(widths[:, None]),
        count=len(cuts) * count,
    )


def even(count: int) -> NDArray[np.float64]:
    """Ends (count + 1,) of equal shares."""
    return np.arange(count + 1) / count


def bonded(rows: int, columns: int, shift: float = 0.5) -> NDArray[np.float64]:
    """Cuts (rows, columns) of equal pieces, each second course shifted by this share of a piece."""
    cut = (np.arange(columns)[None] + (np.arange(rows)[:, None] % 2) * shift) / columns
    return np.sort(cut % 1.0, axis=1)


def uneven(rng: np.random.Generator, rows: int, columns: int, spread: float) -> NDArray[np.float64]:
    """Random cuts (rows, columns); `spread` is the maximum shift of a cut in either direction, as a share of a piece, up to
    0.5.
    """
    off = spread * (rng.random((rows, columns)) - 0.5)
    return np.sort(((np.arange(columns) + off) / columns + rng.random((rows, 1))) % 1.0, axis=1)
