"""Tables of the sRGB curve (IEC 61966-2-1) between bytes and display-linear values in [0, 1]."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.srgb import encoded, linear


@cache
def srgb_bytes() -> NDArray[np.uint8]:
    """sRGB bytes of 65,536 linear values from 0 to 1: every byte survives the way there and back."""
    return np.round(encoded(np.arange(65536) / 65535) * 255).astype(np.uint8)


@cache
def linear_words() -> NDArray[np.uint16]:
    """Linear values, scaled to 65,535, of the 256 sRGB bytes."""
    return np.round(linear(np.arange(256) / 255) * 65535).astype(np.uint16)


def display_linear(pixels: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Display-linear values of sRGB bytes, the same shape; the curve's table gives exactly these bytes back."""
    table = linear_words().astype(np.float32) / np.float32(65535)
    return table[pixels]
