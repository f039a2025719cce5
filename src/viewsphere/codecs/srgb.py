"""sRGB to linear light and back (IEC 61966-2-1), the same to the last bit on every processor."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

STEPS = 8
"""Number of Newton steps for fully precise roots of numbers between 0.001 and 1000."""

FINE = 65_535
"""Steps of linear light in the table of sRGB bytes: in the steepest (darkest) part, one byte spans 20 steps."""


def linear(srgb: ArrayLike) -> NDArray[np.float64]:
    """Linear light of sRGB values in [0, 1]."""
    srgb = np.asarray(srgb, np.float64)
    base = (np.maximum(srgb, 0.04045) + 0.055) / 1.055
    fifth = root(base, 5)
    return np.where(srgb <= 0.04045, srgb / 12.92, base * base * (fifth * fifth))


def encoded(light: ArrayLike) -> NDArray[np.float64]:
    """sRGB values of linear light in [0, 1]."""
    light = np.asarray(light, np.float64)
    base = np.maximum(light, 0.0031308)
    power = np.sqrt(np.sqrt(base)) * np.sqrt(root(base, 3))
    return np.where(light <= 0.0031308, light * 12.92, 1.055 * power - 0.055)


def srgb_bytes(light: NDArray[np.floating]) -> NDArray[np.uint8]:
    """sRGB bytes of linear light in [0, 1], by a table."""
    table = np.rint(encoded(np.arange(FINE + 1) / FINE) * 255).astype(np.uint8)
    return table[np.rint(light * FINE).astype(np.uint16)]


def root(values: NDArray[np.float64], degree: Literal[3, 5]) -> NDArray[np.float64]:
    """Third or fifth root of values near 1 (third roots from 1e-6 on), by Newton's method, because numpy's powers round
    differently on each processor.
    """
    root = np.sqrt(np.sqrt(values))
    for _ in range(STEPS):
        square = root * root
        root = root + (values / (square if degree == 3 else square * square) - root) / degree
    return root
