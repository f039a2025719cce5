"""Colour pictures in other codecs' files: JPEG and WebP by Pillow, QOI and JPEG XL by imagecodecs (the extra `codecs`)."""

from __future__ import annotations

import io
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.codecs.heads import JXL_BARE, JXL_BOXES, jxl_size, qoi_size
from viewsphere.codecs.size import check_size, opened
from viewsphere.errors import MissingExtraError

Picture = NDArray[np.uint8]

JPEG_QUALITY = 95  # Pillow's highest recommended quality: higher ones take more bytes without a visible difference
_QOI_END = bytes(7) + b"\1"  # https://qoiformat.org/qoi-specification.pdf
EFFORT = 1
"""JPEG XL's fastest lossless effort; higher ones take ten times as long to save a tenth of the size."""


def encode_picture(array: Picture, kind: str, quality: int | None) -> bytes:
    """A `jpeg`, `webp`, `qoi` or `jxl` file of a picture (H, W, 3), or (H, W, 4) except for JPEG; uint8 sRGB.

    `quality` (1 to 100) makes WebP and JPEG XL lossy; JPEG's is 95 by default, and its colour is not subsampled. Raises
    MissingExtraError if the codec is not installed.
    """
    array = np.ascontiguousarray(array)
    match kind:
        case "jpeg":
            return _by_pillow(array, "JPEG", quality=quality or JPEG_QUALITY, subsampling=0)
        case "webp" if quality is None:
            return _by_pillow(array, "WEBP", lossless=True, quality=0, method=0, exact=True)
        case "webp":
            return _by_pillow(array, "WEBP", quality=quality, method=0, exact=True)
        case "qoi":
            return bytes(codecs("QOI").qoi_encode(array))
        case "jxl" if quality is None:
            return bytes(codecs("JPEG XL").jpegxl_encode(array, lossless=True, effort=EFFORT, numthreads=1))
        case "jxl":
            return bytes(codecs("JPEG XL").jpegxl_encode(array, level=quality, effort=3, numthreads=1))
        case _:
            raise ValueError(f"encode_picture: expected jpeg, webp, qoi or jxl, got {kind!r}")


def _by_pillow(array: Picture, kind: str, **options: Any) -> bytes:
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(array).save(file, kind, **options)
    return file.getvalue()


def decode_picture(data: bytes, components: int) -> Picture:
    """The picture in a file of any kind, (H, W, components) with 3 or 4 of them.

    Raises OSError, ValueError or SyntaxError for a damaged file, UserError for one beyond MAX_STORED_PIXELS,
    MissingExtraError if its codec is not installed.
    """
    from PIL import Image

    if data[:4] == b"qoif":
        if not data.endswith(_QOI_END):
            raise ValueError("QOI: expected its last 8 bytes, found the file's end: it is cut off")
        check_size(*qoi_size(data))
        return _decoded("QOI", "qoi_decode", data, components)
    if data.startswith((JXL_BARE, JXL_BOXES)):
        check_size(*jxl_size(data))
        return _decoded("JPEG XL", "jpegxl_decode", data, components)
    with opened(io.BytesIO(data)) as image:
        if image.mode.startswith("I"):  # 16 bits of grey, which Pillow would clip to 255
            grey = Image.fromarray((np.asarray(image) >> 8).astype(np.uint8))
            return np.asarray(grey.convert("RGBA" if components == 4 else "RGB"))
        return np.asarray(image.convert("RGBA" if components == 4 else "RGB"))


def _decoded(kind: str, function: str, data: bytes, components: int) -> Picture:
    try:
        array: NDArray[Any] = getattr(codecs(kind), function)(data)
    except RuntimeError as error:  # base class of all errors that imagecodecs raises for damage
        raise ValueError(f"{kind}: {error}") from error
    if array.ndim != 3 or array.shape[-1] != components or array.dtype != np.uint8:
        raise ValueError(f"{kind}: expected {components} channels of 8 bits, found {array.shape} {array.dtype}")
    return array


def codecs(kind: str) -> ModuleType:
    """The package imagecodecs; raises MissingExtraError if it is not installed."""
    try:
        import imagecodecs
    except ImportError:
        raise MissingExtraError(
            f"{kind}: expected the package imagecodecs, found none: pip install 'viewsphere[codecs]', or choose png"
        ) from None
    return imagecodecs
