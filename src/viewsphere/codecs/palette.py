"""Distinct colours of numbers, for maps of ids."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

MOST_COLORS = 256


def palette() -> NDArray[np.uint8]:
    """The 256 distinct colours (256, 3) of PASCAL VOC, id 0 being black.

    The lowest three bits of an id become the highest bits of red, green and blue, and the next three bits become the next
    highest ones.
    """
    ids = np.arange(MOST_COLORS)
    bits = ids[:, None] >> np.arange(8) & 1
    colors = [sum(bits[:, 3 * k + c] << (7 - k) for k in range(3) if 3 * k + c < 8) for c in range(3)]
    return np.stack(colors, axis=1).astype(np.uint8)
