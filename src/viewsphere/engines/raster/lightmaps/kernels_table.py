"""Open-addressing tables: the place of a key in an array of keys and an array of values; the value of an empty place is
negative.
"""

from __future__ import annotations

import numpy as np

from viewsphere.kernels.jit import inner

GOLDEN = np.uint64(0x9E3779B97F4A7C15)


@inner
def found(key, keys, values):
    """The place of a key in a table whose size is a power of two: its own, or the empty place for it."""
    last = np.uint64(len(keys) - 1)
    at = (key * GOLDEN) >> np.uint64(20) & last
    while values[at] >= 0 and keys[at] != key:
        at = (at + np.uint64(1)) & last
    return at
