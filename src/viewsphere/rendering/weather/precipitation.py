"""The numbers of rain and snow: how many drops or flakes a cubic metre holds by size, their speed, and their extinction.

Rain: N(D) = 8000 exp(-4.1 R^-.21 D) per cubic metre and millimetre (Marshall and Palmer 1948), 200 sqrt(radius) m/s (Garg and
Nayar, *Vision and Rain*, 2007). Snow: N(D) = 3800 R^-.87 exp(-2.55 R^-.48 D), D of the melted drop (Gunn and Marshall 1958),
whose flake of a tenth of water's density is 10^(1/3) times as wide; it falls at about a metre a second, larger ones faster.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from viewsphere.model.weather import Falling, Rain

FLAKE = 10 ** (1 / 3)
"""Width of a flake over that of its drop."""


class Sizes(NamedTuple):
    """N(D) = most exp(-slope D) a cubic metre and millimetre of diameter D, which are `wide` times as wide when seen."""

    most: float
    slope: float
    wide: float


def sizes(falling: Falling) -> Sizes:
    """The sizes of what falls."""
    if isinstance(falling, Rain):
        return Sizes(8000.0, 4.1 * falling.rate**-0.21, 1.0)
    return Sizes(3800.0 * falling.rate**-0.87, 2.55 * falling.rate**-0.48, FLAKE)


def extinction(falling: Falling) -> float:
    """Optical depth of a metre: twice the areas of all drops, as of anything much wider than a wave of light."""
    of = sizes(falling)
    return 2 * math.pi / 4 * of.most * 2 / of.slope**3 * of.wide**2 * 1e-6


def number(falling: Falling, low: float, high: float) -> float:
    """Return the number of drops or flakes in a cubic metre with diameters (as a drop) from `low` to `high` millimetres."""
    of = sizes(falling)
    return of.most / of.slope * (math.exp(-of.slope * low) - math.exp(-of.slope * high))


def diameter(falling: Falling, low: float, high: float, share: float) -> float:
    """The diameter, as a drop, that a share of those from `low` to `high` millimetres do not reach."""
    slope = sizes(falling).slope
    least, most = math.exp(-slope * low), math.exp(-slope * high)
    return -math.log(least - share * (least - most)) / slope


def speed(falling: Falling, diameter_mm: float) -> float:
    """Metres a second at which a drop of this diameter falls, or the flake that it makes."""
    if isinstance(falling, Rain):
        return 200 * math.sqrt(diameter_mm / 2000)
    return 0.85 + 0.15 * min(diameter_mm, 4.0)
