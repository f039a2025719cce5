"""Scene-linear light to Radiance pictures (RGBE) and back, in memory: a shared exponent and three mantissas of eight bits.

Format: https://www.radiance-online.org/cgi-bin/viewcvs.cgi/ray/src/common/color.h, and Ward, *Real Pixels* (Graphics Gems II,
1991). Texels are written plain: a texel's largest mantissa is at least 128, so no texel looks like the mark of a run. The
reader reads only files that the writer made.
"""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from viewsphere.codecs.size import check_size
from viewsphere.errors import UserError

_HEAD = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {} +X {}\n"
_SIZES = re.compile(re.escape(_HEAD).replace(r"\{\}", r"([1-9]\d{0,6})").encode())
_BIAS = 128 + 8  # of the exponent, and of mantissas that are whole numbers below 256
_LEAST, _MOST = 2.0**-127, 255 * 2.0**119
"""The smallest light that is kept, and the largest: the exponent's range in a byte, whose value 0 means black. Less light is
stored as black, more as the largest.
"""


def encode_hdr(light: NDArray[np.float32]) -> bytes:
    """A Radiance file of light (H, W, 3) float32, 0 or more, not empty.

    Each channel is off by at most 1/256 of its texel's largest channel. Raises ValueError for another array.
    """
    if light.ndim != 3 or light.shape[2] != 3 or light.dtype != np.float32 or light.size == 0:
        raise ValueError(f"encode_hdr: expected (H, W, 3) float32, got {light.shape} {light.dtype}")
    kept = np.clip(light.astype(np.float64), 0, _MOST)
    largest = kept.max(axis=2)
    mantissa, exponent = np.frexp(largest)
    exponent += np.rint(mantissa * 256) == 256  # rounding would leave eight bits
    texels = np.zeros((*light.shape[:2], 4), np.uint8)
    is_lit = largest >= _LEAST
    texels[..., :3] = np.where(is_lit[..., None], np.rint(np.ldexp(kept, (8 - exponent)[..., None])), 0)
    texels[..., 3] = np.where(is_lit, exponent + 128, 0)
    return _HEAD.format(*light.shape[:2]).encode() + texels.tobytes()


def decode_hdr(data: bytes) -> NDArray[np.float32]:
    """The light in a file that `encode_hdr` made, (H, W, 3) float32.

    Raises UserError when the file is damaged or was written by another program.
    """
    head = _SIZES.match(data)
    if head is None:
        raise UserError("HDR: expected viewsphere's own, found a damaged file or another program's")
    height, width = int(head[1]), int(head[2])
    check_size(width, height)
    size = len(data) - head.end()
    if size != 4 * width * height:
        raise UserError(f"HDR: expected {4 * width * height:,} bytes of texels, found {size:,}: the file is damaged")
    texels = np.frombuffer(data, np.uint8, offset=head.end()).reshape(height, width, 4)
    scale = np.where(texels[..., 3:] > 0, np.exp2(texels[..., 3:].astype(np.float64) - _BIAS), 0)
    return (texels[..., :3] * scale).astype(np.float32)
