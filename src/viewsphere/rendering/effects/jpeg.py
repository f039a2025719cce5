"""JPEG compression, as in a camera or on the web."""

from __future__ import annotations

import io

import numpy as np
from numpy.typing import NDArray

BEST, WORST = 95, 5
"""JPEG's qualities just above strength 0, and at strength 1."""


def jpeg(pixels: NDArray[np.uint8], strength: float) -> NDArray[np.uint8]:
    """Bytes (H, W, 3) or (H, W, 4) encoded and decoded again, with colours at half the resolution; alpha is unchanged."""
    if strength == 0:
        return pixels
    from PIL import Image

    buffer = io.BytesIO()
    quality = round(BEST + (WORST - BEST) * strength)
    Image.fromarray(np.ascontiguousarray(pixels[..., :3])).save(buffer, "JPEG", quality=quality, subsampling="4:2:0")
    out = pixels.copy()
    with Image.open(buffer) as image:
        out[..., :3] = np.asarray(image)
    return out
