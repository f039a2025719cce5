"""The places of puddles: noise of low frequency over the world's floor, so that puddles stay while cameras move."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from viewsphere.model.weather import Wet

Float = NDArray[np.float64]

OCTAVES = ((0.35, 0.6), (0.9, 0.3), (2.6, 0.1))
"""Waves a metre, and how much each counts."""

SHORE = 0.035
"""Share of the noise's range over which a puddle's border fades."""


def puddles(wet: Wet, x: Float, y: Float) -> NDArray[np.float32]:
    """Return the share of water at places of the floor, world metres, (n,): 1 in a puddle, 0 without water."""
    if not wet.puddles or not wet.amount:
        return np.zeros(len(x), np.float32)
    level = sum((weight * _noise(wet.seed + i, x * waves, y * waves) for i, (waves, weight) in enumerate(OCTAVES)), np.zeros(1))
    rise = np.clip((level - _least(wet.puddles)) / SHORE + 0.5, 0, 1)
    return (rise * rise * (3 - 2 * rise)).astype(np.float32)


def _least(share: float) -> float:
    """The level that a share of the floor is above: the noise is nearly normal, of mean 1/2 and deviation 0.132."""
    from statistics import NormalDist

    return NormalDist(0.5, 0.132).inv_cdf(min(max(1 - share, 1e-6), 1 - 1e-6))


def _noise(seed: int, x: Float, y: Float) -> Float:
    """Smooth numbers of 0 to 1: random ones at whole places, and cubic steps between them."""
    column, row = np.floor(x), np.floor(y)
    across, down = ((v - i) ** 2 * (3 - 2 * (v - i)) for v, i in ((x, column), (y, row)))
    i, j = column.astype(np.int64), row.astype(np.int64)
    upper = _random(seed, i, j) * (1 - across) + _random(seed, i + 1, j) * across
    lower = _random(seed, i, j + 1) * (1 - across) + _random(seed, i + 1, j + 1) * across
    return upper * (1 - down) + lower * down


def _random(seed: int, i: NDArray[np.int64], j: NDArray[np.int64]) -> Float:
    """A number of [0, 1) for a place: SplitMix64's last steps over a sum of its coordinates."""
    step = np.uint64(0x9E3779B97F4A7C15)
    state = _mixed(i.astype(np.uint64) * step + np.uint64(seed))
    return (_mixed(state + j.astype(np.uint64) * step) >> np.uint64(11)).astype(np.float64) / 2**53


def _mixed(x: NDArray[np.uint64]) -> NDArray[np.uint64]:
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))
