"""Smooth random numbers over time with no frequency above a bound."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]

WAVES = 6
"""Sinusoids of one component. The mean square of `Noise.at` is 1 / (2 WAVES): its root is 0.29."""


@dataclass(frozen=True, eq=False)
class _Noise:
    """Sums of sinusoids of equal size: their frequencies (D, WAVES), hertz, and phases (D, WAVES), radians."""

    frequencies: Float
    phases: Float

    def values_at(self, seconds: float) -> Float:
        """The components (D,) at a time, each of -1 to 1."""
        rows = zip(self.frequencies.tolist(), self.phases.tolist(), strict=True)
        return np.array([_sum(frequencies, phases, seconds) for frequencies, phases in rows])


def noise(rng: np.random.Generator, components: int, highest_hz: float) -> _Noise:
    """Noise of independent components; each of WAVES equal bands up to the highest frequency contains one frequency."""
    draws = rng.random((components, 2, WAVES))
    return _Noise((np.arange(WAVES) + draws[:, 0]) * (highest_hz / WAVES), draws[:, 1] * (2 * math.pi))


def _sum(frequencies: list[float], phases: list[float], seconds: float) -> float:
    waves = zip(frequencies, phases, strict=True)
    return math.fsum(math.sin(2 * math.pi * frequency * seconds + phase) for frequency, phase in waves) / WAVES
