"""What is seen where nothing else is: a colour or an image, display-linear."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from viewsphere.engines.raster.records import Float32
from viewsphere.engines.raster.tone import linear_words
from viewsphere.errors import UserError
from viewsphere.model.scene import Background


def plain_background(background: Background, width: int, height: int) -> Float32 | None:
    """The background as (height * width, 3), exact in sRGB bytes; None for the sky.

    An image covers the frame, centred, its proportions kept. Raises UserError when it cannot be read.
    """
    if background.image is not None:
        pixels = _covering(background.image, width, height).reshape(-1, 3)
    elif background.color is not None:
        pixels = np.round(np.clip(background.color, 0, 1) * np.array(255.0)).astype(np.uint8)
        pixels = np.broadcast_to(pixels, (width * height, 3))
    else:
        return None
    return (linear_words()[pixels].astype(np.float32)) / np.float32(65535)


def _covering(path: str, width: int, height: int) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    from PIL import Image, ImageOps, UnidentifiedImageError

    try:
        with Image.open(Path(path)) as image:
            upright = ImageOps.exif_transpose(image).convert("RGB")
    except (OSError, UnidentifiedImageError, ValueError) as error:
        raise UserError(f"background image {path}: expected a readable image, found {error}") from error
    return np.asarray(ImageOps.fit(upright, (width, height), Image.Resampling.LANCZOS), np.uint8)
