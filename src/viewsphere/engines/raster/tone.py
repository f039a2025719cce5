"""Colour: the sRGB curve both ways, exposure and the highlight roll-off.

Display-linear values lie in [0, 1] and go through the sRGB curve (IEC 61966-2-1) alone. Light becomes
display-linear by `EXPOSURE` and, above `KNEE`, the roll-off k + (1 - k) y / (1 + y), y = (x - k) / (1 - k): smooth,
never clipped.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.srgb import encoded, linear

EXPOSURE = 0.7
"""Display value of unit radiance: level ground in the default sun and sky shows its own colour."""

KNEE = 0.6
"""Display values below are shown as they are."""


@cache
def srgb_bytes() -> NDArray[np.uint8]:
    """sRGB bytes of 65,536 linear values from 0 to 1: every byte survives the way there and back."""
    return np.round(encoded(np.arange(65536) / 65535) * 255).astype(np.uint8)


@cache
def linear_words() -> NDArray[np.uint16]:
    """Linear values, scaled to 65,535, of the 256 sRGB bytes."""
    return np.round(linear(np.arange(256) / 255) * 65535).astype(np.uint16)
