"""White balance: the light that is to look white, given by colour temperature and tint."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]

NEUTRAL_K = 6500.0
"""The temperature that changes nothing: D65, the white of sRGB."""

TINT = 0.02
"""Distance, in CIE 1960 (u, v), of a tint of 1 from the line of temperatures."""

XYZ_FROM_SRGB = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
"""Linear sRGB to CIE XYZ, IEC 61966-2-1."""

LUMINANCE: Float = XYZ_FROM_SRGB[1]
"""Shares of linear sRGB's red, green and blue in the luminance."""

BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])
"""Cone responses of Lam's chromatic adaptation (1985), as in ICC.1:2022, annex E."""


@lru_cache(maxsize=256)
def white_balance(temperature_k: float, tint: float) -> Float:
    """A matrix from linear sRGB to linear sRGB, (3, 3) float64: light of this temperature and tint becomes neutral and keeps
    its luminance.

    Exactly the identity for 6500 K without tint. A tint above 0 neutralises greener light, which turns the picture towards
    magenta.
    """
    if temperature_k == NEUTRAL_K and tint == 0:
        return np.eye(3)
    cones = BRADFORD @ XYZ_FROM_SRGB
    neutral = cones @ np.ones(3)
    seen = BRADFORD @ white_xyz(temperature_k, tint)
    return np.linalg.solve(cones, (neutral / seen)[:, None] * cones).astype(np.float64)


def white_xyz(temperature_k: float, tint: float) -> Float:
    """CIE XYZ with Y = 1 of the light of this temperature and tint, (3,).

    Temperatures follow the black-body locus of Krystek, *An algorithm to calculate correlated colour temperature* (1985). From
    3000 to 5000 K it blends into the slightly greener daylight locus, so that 6500 K is D65. Tint moves across the locus,
    towards green above 0.
    """
    x, y, z = XYZ_FROM_SRGB @ np.ones(3)
    d65 = np.array([4 * x, 6 * y]) / (x + 15 * y + 3 * z)
    share = min(max((temperature_k - 3000) / 2000, 0.0), 1.0)
    daylight = share * share * (3 - 2 * share) * (d65 - _black_body(NEUTRAL_K))
    step = _black_body(temperature_k + 1) - _black_body(temperature_k - 1)
    across = np.array([step[1], -step[0]]) / np.hypot(*step)
    u, v = _black_body(temperature_k) + daylight + tint * TINT * across
    x, y = np.array([3 * u, 2 * v]) / (2 * u - 8 * v + 4)
    return np.array([x / y, 1.0, (1 - x - y) / y])


def _black_body(t: float) -> Float:
    """CIE 1960 (u, v) of a black body at t kelvin."""
    u = (0.860117757 + 1.54118254e-4 * t + 1.28641212e-7 * t * t) / (1 + 8.42420235e-4 * t + 7.08145163e-7 * t * t)
    v = (0.317398726 + 4.22806245e-5 * t + 4.20481691e-8 * t * t) / (1 - 2.89741816e-5 * t + 1.61456053e-7 * t * t)
    return np.array([u, v])
