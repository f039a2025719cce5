"""The numbers of rain and snow: how many drops or flakes a cubic metre holds by size, their speed, and their extinction.

Rain: N(D) = 8000 exp(-4.1 R^-.21 D) per cubic metre and millimetre (Marshall and Palmer 1948), 200 sqrt(radius) m/s (Garg and
Nayar, *Vision and Rain*, 2007). Snow: N(D) = 3800 R^-.87 exp(-2.55 R^-.48 D), with D the diameter of the melted drop (Gunn and
Marshall 1958). A flake has a tenth of water's density, so it is 10^(1/3) times as wide as its drop. It falls at about a metre a
second, larger flakes faster.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from viewsphere.model.weather import Falling, Rain

FLAKE = 10 ** (1 / 3)
"""Ratio of a flake's width to that of its melted drop."""


class _Sizes(NamedTuple):
    """N(D) = most exp(-slope D) per cubic metre and millimetre of diameter D; the visible width is `wide` times D."""

    most: float
    slope: float
    wide: float


def sizes(falling: Falling) -> _Sizes:
    """The size distribution of rain or snow."""
    if isinstance(falling, Rain):
        return _Sizes(8000.0, 4.1 * falling.rate**-0.21, 1.0)
    return _Sizes(3800.0 * falling.rate**-0.87, 2.55 * falling.rate**-0.48, FLAKE)


def extinction(falling: Falling) -> float:
    """Optical depth per metre: twice the area of all drops, as for anything much wider than the wavelength of light."""
    of = sizes(falling)
    return 2 * math.pi / 4 * of.most * 2 / of.slope**3 * of.wide**2 * 1e-6


def number(falling: Falling, low: float, high: float) -> float:
    """Return the number of drops or flakes in a cubic metre with diameters (as a drop) from `low` to `high` millimetres."""
    of = sizes(falling)
    return of.most / of.slope * (math.exp(-of.slope * low) - math.exp(-of.slope * high))


def diameter(falling: Falling, low: float, high: float, share: float) -> float:
    """The diameter, as a drop, below which this share of the drops from `low` to `high` millimetres lies."""
    slope = sizes(falling).slope
    least, most = math.exp(-slope * low), math.exp(-slope * high)
    return -math.log(least - share * (least - most)) / slope


def speed(falling: Falling, diameter_mm: float) -> float:
    """Speed, in metres per second, at which a drop of this diameter falls, or the flake made from it."""
    if isinstance(falling, Rain):
        return 200 * math.sqrt(diameter_mm / 2000)
    return 0.85 + 0.15 * min(diameter_mm, 4.0)
