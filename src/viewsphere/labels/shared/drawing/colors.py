"""Colours for the drawings of labels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Color = tuple[int, int, int]
"""sRGB, 0 to 255."""

PALETTE = ((230, 75, 60), (50, 130, 220), (45, 165, 95), (240, 170, 40), (150, 90, 200), (20, 170, 180))


def color_of(object_id: int) -> Color:
    """An object's colour, sRGB."""
    return PALETTE[(object_id - 1) % len(PALETTE)]


GOLDEN = 0.618034
"""The golden section: the fractional parts of its multiples are far apart."""


def by_number(picture: NDArray[np.uint8], numbers: NDArray[np.int32]) -> NDArray[np.uint8]:
    """The picture (H, W, 3) in grey, with a separate colour for every number above 0. Neighbouring numbers have
    distant hues.
    """
    grey = picture.mean(axis=2, keepdims=True).repeat(3, axis=2)
    hue = (numbers * GOLDEN)[..., None] % 1 + np.array([0, 2 / 3, 1 / 3])
    light = 0.35 + 0.65 * grey / 255
    colors = 255 * light * (0.5 + 0.5 * np.cos(2 * np.pi * hue))
    return np.where(numbers[..., None] > 0, colors, 0.6 * grey + 70).round().astype(np.uint8)
