"""Channels as files: PNG for colours and ids, TIFF for exact numbers."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.errors import StoreError, UserError
from viewsphere.model.channel import Channel


def encode(channel: Channel, array: NDArray[Any]) -> bytes:
    """The bytes of a channel's file; raises ValueError for an array that is not as the channel's row says."""
    from viewsphere.geometry import image_files

    height, width = array.shape[:2]
    if array.dtype != channel.dtype or array.shape != channel.shape(height, width):
        raise ValueError(
            f"channel {channel.name}: expected {channel.shape(height, width)} {channel.dtype}, got {array.shape} {array.dtype}"
        )
    if channel.encoding == "tiff":
        return image_files.encode_tiff(array)
    if channel.encoding == "png16":
        if array.size and not 0 <= array.min() <= array.max() <= 65535:
            raise StoreError(f"channel {channel.name}: expected ids in 0..65535, found {array.min()}..{array.max()}")
        return image_files.encode_png(array.astype(np.uint16))
    return image_files.encode_png(array)


def decode(channel: Channel, file: Path) -> NDArray[Any]:
    """The array a channel's file holds, with the channel's dtype; raises StoreError if it is missing or broken.

    Pictures that were imported may be JPEG or anything else that Pillow reads.
    """
    from viewsphere.geometry import image_files

    try:
        data = file.read_bytes()
        if channel.name == "rgb":
            return _rgb(data)
        array = image_files.decode_tiff(data) if channel.encoding == "tiff" else image_files.decode_png(data)
    except (OSError, ValueError, SyntaxError, UserError) as error:
        problem = (error.strerror if isinstance(error, OSError) else None) or error
        raise StoreError(
            f"{file}: expected a readable {channel.encoding} file, found: {problem}: "
            f"delete {file.parent.parent} and render again"
        ) from None
    return array.astype(channel.dtype, copy=False)


def _is_rgb_png(data: bytes) -> bool:
    """Whether this is a PNG of 8-bit red, green and blue, as this package writes them (PNG specification, 11.2.1)."""
    return data[:8] == b"\x89PNG\r\n\x1a\n" and data[24:26] == b"\x08\x02"


def _rgb(data: bytes) -> NDArray[np.uint8]:
    """The picture in a file of this package, else in one of any other program."""
    from io import BytesIO

    from PIL import Image

    from viewsphere.geometry import image_files

    if _is_rgb_png(data):
        with suppress(UserError):
            return image_files.decode_png(data)
    with Image.open(BytesIO(data)) as image:
        if image.mode.startswith("I"):  # 16 bits of grey, which Pillow would cut off above 255
            grey = (np.asarray(image) >> 8).astype(np.uint8)
            return np.repeat(grey[..., None], 3, axis=2)
        return np.asarray(image.convert("RGB"))
