"""Blades of grass and tufts of yarn: strokes laid one over another."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from viewsphere.materials.shared.kernels_noise import lay_strokes
from viewsphere.materials.shared.surface import Map


class _Strokes(NamedTuple):
    """Height from 0 (no stroke) to 1; the number of the stroke on top, -1 for none; the position along it as a share of its
    length, negative on its shaded side.
    """

    height: Map
    number: Map
    along: Map

    def each(self, values: NDArray[np.float64]) -> Map:
        """Map of numbers (count,), one per stroke, at the stroke on top; the last number where there is no stroke."""
        return values.astype(np.float32)[self.number.astype(np.intp)]


def strokes(
    size: int,
    count: int,
    length: tuple[float, float],
    width: tuple[float, float],
    bend: float,
    rng: np.random.Generator,
) -> _Strokes:
    """A number of bent strokes, each in its own direction; ranges of lengths and widths are shares of the square.

    `bend` is the sideways shift of a stroke's tip, as a share of its length.
    """
    u = rng.random((6, count))
    heading = _directions(u[2])
    aside = np.stack([-heading[:, 1], heading[:, 0]], axis=1) * (2 * u[3, :, None] - 1) * bend
    long = (length[0] + (length[1] - length[0]) * u[4]) * size
    steps = max(int(length[1] * size * 1.1), 2)
    share = ((np.arange(steps) + 0.5) / steps)[None, :, None]
    path = (heading[:, None] + 2 * share * aside[:, None]) * (long / steps)[:, None, None]
    maps = _Strokes(*(np.zeros((size, size), np.float32) for _ in range(3)))
    maps.number.fill(-1)
    wide = np.maximum((width[0] + (width[1] - width[0]) * u[5]) * size, 1.0)
    lay_strokes(*maps, (u[:2].T * size).astype(np.float32), path.astype(np.float32), wide.astype(np.float32))
    return maps


def _directions(chance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit vectors (N, 2) of all directions, nearly alike: of points on a square, as sines are rounded differently."""
    t = 8 * chance
    side, at = np.floor(t / 2).astype(np.intp), t % 2 - 1
    x = np.choose(side, (at, np.ones_like(at), -at, -np.ones_like(at)))
    y = np.choose(side, (-np.ones_like(at), at, np.ones_like(at), -at))
    r = np.sqrt(x * x + y * y)
    return np.stack([x / r, y / r], axis=1)
