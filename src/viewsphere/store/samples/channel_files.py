"""Channels as files: the recipe chooses the kind of file, and the first bytes of a file identify its kind."""

from __future__ import annotations

from collections.abc import Callable, Container
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.codecs.palette import MOST_COLORS, palette
from viewsphere.errors import MissingExtraError, RemoteError, StoreError, UserError
from viewsphere.files import read_bytes
from viewsphere.model.channel import DEEP_PICTURES, PICTURES, Channel
from viewsphere.model.fields.files import Files

MOST_STEPS = 65535


def encode(channel: Channel, array: NDArray[Any], files: Files | None = None) -> bytes:
    """The bytes of a channel's file, in the format chosen by `files`.

    Raises ValueError for an array of another shape or dtype than the channel's, StoreError for ids above 65535,
    MissingExtraError if a codec is not installed. Ids above 255 do not fit a palette: such a frame's map is a 16-bit PNG.
    """
    from viewsphere.codecs import exr, hdr, npz, pictures, png_tiff

    files = files or Files()
    height, width = (*array.shape, 1)[:2]
    if not channel.fits(array, height, width):
        raise ValueError(f"channel {channel.name}: expected {channel.expected(height, width)}, got {array.shape} {array.dtype}")
    match files.encoding(channel):
        case "tiff":
            return png_tiff.encode_tiff(array)
        case "exr":
            return exr.encode_exr(array)
        case "half":
            return exr.encode_exr(exr.half_floats(array))
        case "hdr":
            return hdr.encode_hdr(array)
        case "npz":
            return npz.encode_npz(array, channel.name)
        case "png":
            return png_tiff.encode_png(array, rendered=True)
        case "png16" if channel.in_steps:
            return png_tiff.encode_png(_steps(array, files.step), unit=files.step)
        case "png16" | "png8" as kind:
            return _masks(channel, array, kind == "png8")
        case kind:
            return pictures.encode_picture(array, kind, files.quality)


def _steps(depth: NDArray[np.float32], unit: float) -> NDArray[np.uint16]:
    """Depth in whole steps, 1 to 65535; larger depths become 65535, and pixels without a surface 0."""
    steps = np.clip(np.rint(depth.astype(np.float64) / unit), 1, MOST_STEPS)
    return np.where(np.isfinite(depth) & (depth > 0), steps, 0).astype(np.uint16)


def depth_step(data: bytes) -> float:
    """Metres between neighbouring depth values of a file; 0 for exact files. Raises UserError for a broken file."""
    from viewsphere.codecs import png_tiff

    return (png_tiff.png_unit(data) or 0.0) if data[:4] == b"\x89PNG" else 0.0


def check_codecs(channels: Container[str], files: Files) -> None:
    """Raise MissingExtraError if a channel needs a codec that is not installed."""
    from viewsphere.codecs.pictures import codecs

    for name, kind in (("rgb", files.rgb), ("rgba", files.rgba)):
        if name in channels and kind in {"qoi", "jxl"}:
            codecs(f"files.{name}: {kind}")


def _masks(channel: Channel, array: NDArray[np.int32], indexed: bool) -> bytes:
    from viewsphere.codecs import png_tiff

    most = int(array.view(np.uint32).max(initial=0))  # negative ids count as large ones
    if most > MOST_STEPS:
        raise StoreError(f"channel {channel.name}: expected ids in 0..65535, found {array.min()}..{array.max()}")
    if indexed and most < MOST_COLORS:
        colors = palette()
        colors[: len(channel.colors)] = channel.colors or colors[:0]
        return png_tiff.encode_png(array.astype(np.uint8), palette=colors)
    return png_tiff.encode_png(array.astype(np.uint16))


def decode(channel: Channel, file: Path, read: Callable[[], bytes] | None = None) -> NDArray[Any]:
    """The array in a channel's file of any kind, with the channel's dtype.

    Imported pictures may have any format that Pillow reads. `read` returns the file's bytes if they must be verified, or are
    stored elsewhere. Raises StoreError if the file is missing or broken, MissingExtraError if its codec is not installed.
    """
    try:
        array = _decoded(channel, read() if read else read_bytes(file, "MAX_PICTURE_BYTES"))
        is_rows = channel.components == 0 and array.dtype != channel.dtype
        is_deep = channel.name in DEEP_PICTURES and array.dtype == np.uint8
        if is_rows or is_deep or np.issubdtype(channel.dtype, np.floating) != np.issubdtype(array.dtype, np.floating):
            raise UserError(f"expected {np.dtype(channel.dtype)}, found {array.dtype}")
    except MissingExtraError as error:
        raise MissingExtraError(f"{file}: {error}") from None
    except (StoreError, RemoteError):
        raise
    except (OSError, ValueError, SyntaxError, UserError) as error:
        problem = (error.strerror if isinstance(error, OSError) else None) or error
        raise StoreError(
            f"{file}: expected a readable {file.suffix.removeprefix('.')} file, found: {problem}: "
            f"delete {file.parent.parent} and render again"
        ) from None
    return array.astype(channel.dtype, copy=False)


def _decoded(channel: Channel, data: bytes) -> NDArray[Any]:
    """The array in a file's bytes; the first bytes identify the kind of file."""
    from viewsphere.codecs import exr, hdr, npz, pictures, png_tiff

    if channel.name in PICTURES:
        if _is_own_png(data, channel.components):
            with suppress(UserError):
                return png_tiff.decode_png(data)
        if data[:4] == b"\x89PNG":
            png_tiff.check_png(data)  # which Pillow leaves out
        return pictures.decode_picture(data, channel.components)
    match data[:4]:
        case b"\x76\x2f\x31\x01":
            return exr.decode_exr(data)
        case b"#?RA":
            return hdr.decode_hdr(data)
        case b"PK\x03\x04":
            return npz.decode_npz(data, channel.name)
        case b"\x89PNG" if channel.in_steps:
            return _metres(data)
        case b"\x89PNG":
            return png_tiff.decode_png(data)
        case _:
            return png_tiff.decode_tiff(data)


def _metres(data: bytes) -> NDArray[np.float32]:
    from viewsphere.codecs import png_tiff

    unit = png_tiff.png_unit(data)
    if unit is None:
        raise UserError("PNG: expected the metres in a step (chunk pCAL), found none")
    steps = png_tiff.decode_png(data)
    return np.where(steps == 0, np.inf, steps * unit).astype(np.float32)


def _is_own_png(data: bytes, components: int) -> bool:
    """Return whether the bytes are a PNG of 8-bit RGB or RGBA, as this package writes pictures (PNG specification, 11.2.1)."""
    return data[:8] == b"\x89PNG\r\n\x1a\n" and data[24:26] == (b"\x08\x06" if components == 4 else b"\x08\x02")
