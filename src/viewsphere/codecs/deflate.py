"""Pixels, deflated fast (RFC 1951), for the image files that hold deflated data."""

from __future__ import annotations

from typing import Any

import numpy as np
from isal import isal_zlib
from numpy.typing import NDArray

FAST, STEADY = 1, 3
"""ISA-L's levels: FAST is ten times as fast as zlib's usual level, its output hardly larger; STEADY takes twice as long."""

SMALL_BYTES = 1 << 16
"""Bytes of input below which STEADY is used. Of some short inputs, small masks among them, ISA-L's levels 1 and 2 make other
bytes one time in some thousand, depending on where in memory ISA-L's own state lies (measured with isal 1.9.1). STEADY, which
is level 3, never did so, nor did levels 1 and 2 with longer inputs.
"""


def level_for(size: int) -> int:
    """The level of compression for an input of so many bytes."""
    return STEADY if size < SMALL_BYTES else FAST


def deflate(array: NDArray[Any]) -> bytes | memoryview:
    """The raw deflate stream of an array's bytes, as they lie in C order.

    Of float32 pixels (H, W) or (H, W, 3) only runs of equal pixels are coded, since nothing else pays: see `kernels_deflate`.
    """
    step = 1 if array.ndim == 2 else array.shape[-1]
    array = np.ascontiguousarray(array)
    if array.dtype.newbyteorder("=") != np.float32 or step not in (1, 3):
        return isal_zlib.compress(array, level_for(array.nbytes), -15)
    from viewsphere.codecs.kernels_deflate import STORED, deflate_runs, match_codes

    data = array.reshape(-1).view(np.uint8)
    out = np.empty(data.size + 5 * (data.size // STORED) + 64, np.uint8)
    end = deflate_runs(data.view(np.uint32), step, *match_codes(4 * step), data, out, 0)
    return out[:end].data
