"""Textures as PNG files."""

from __future__ import annotations

import io

import numpy as np
from numpy.typing import NDArray


def png_bytes(pixels: NDArray[np.uint8]) -> bytes:
    """A PNG file of pixels (H, W, 1 to 4 channels) uint8; equal pixels give equal bytes."""
    from PIL import Image as Pillow

    flat = pixels[..., 0] if pixels.shape[-1] == 1 else pixels
    file = io.BytesIO()
    Pillow.fromarray(np.ascontiguousarray(flat)).save(file, "PNG", compress_level=6)
    return file.getvalue()
