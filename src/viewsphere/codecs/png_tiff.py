"""Arrays to image files and back, in memory: lossless PNG and TIFF, fast and byte-for-byte reproducible.

Deflate is ISA-L's (`deflate`), an order of magnitude faster than zlib at PNG's usual level. The readers read only
files that the writers made; other tools read the files too (Pillow, OpenCV, tifffile, imageio).
PNG: https://www.w3.org/TR/png-3/; TIFF 6.0 with deflate:
https://www.loc.gov/preservation/digital/formats/fdd/fdd000022.shtml.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from functools import lru_cache
from typing import Any

import numpy as np
from isal import isal_zlib
from numpy.typing import NDArray

from viewsphere.codecs.deflate import compressed, deflate, deflate_lines
from viewsphere.codecs.size import check_size
from viewsphere.errors import UserError

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_COLOR_TYPES = {1: 0, 3: 2, 4: 6}  # components -> PNG colour type
_INDEXED = 3
_SUB = 1
_FOREIGN_PNG = "PNG: expected viewsphere's own, found another program's: read it with an image library"
_FOREIGN_TIFF = "TIFF: expected viewsphere's own, found a damaged file or another program's"

_WIDTH, _HEIGHT, _BITS, _COMPRESSION, _PHOTOMETRIC, _OFFSET = 256, 257, 258, 259, 262, 273
_SAMPLES, _ROWS, _BYTES, _PLANAR, _EXTRA, _FORMAT = 277, 278, 279, 284, 338, 339
_SIZE_AT = 8 + 2 + 12 * 8 + 8  # of the strip's bytes in a TIFF's head: the value of the ninth entry
_SAMPLE_FORMATS = {np.dtype(np.int32): 2, np.dtype(np.float32): 3}


def encode_png(
    array: NDArray[Any], *, palette: NDArray[np.uint8] | None = None, unit: float | None = None, rendered: bool = False
) -> bytes:
    """A PNG file of a picture: (H, W) bool (1 bit), uint8 or uint16, or (H, W, 3 or 4) uint8 or uint16, not empty.

    With a `palette` (n, 3), (H, W) uint8 are indices of its colours. `unit` is the length in metres of one step of (H, W)
    (pCAL). For a `rendered` picture in colour, of 8 bits a component, only runs are matched, which halves the time; one of 16
    bits is filtered, which takes a quarter off the file.
    """
    components = 1 if array.ndim == 2 else array.shape[-1]
    dtypes = (np.bool_, np.uint8, np.uint16) if array.ndim == 2 else (np.uint8, np.uint16)
    if array.ndim not in (2, 3) or array.size == 0 or components not in _COLOR_TYPES or array.dtype not in dtypes:
        raise ValueError(
            f"encode_png: expected (H, W) bool, uint8 or uint16, or (H, W, 3 or 4) uint8 or uint16, "
            f"got {array.shape} {array.dtype}"
        )
    height, width = array.shape[:2]
    depth = 1 if array.dtype == np.bool_ else 8 * array.dtype.itemsize
    color = _COLOR_TYPES[components] if palette is None else _INDEXED
    header = struct.pack(">IIBBBBB", width, height, depth, color, 0, 0, 0)
    more = b"" if palette is None else _chunk(b"PLTE", palette.tobytes())
    if unit is not None:
        more += _chunk(b"pCAL", struct.pack(">6siiBB2s", b"depth", 0, 65535, 0, 2, b"m") + f"0\0{65535 * unit!r}".encode())
    if rendered and array.dtype == np.uint8 and components > 1:
        body = _zlib(array.reshape(height, -1), components)
    else:
        body = compressed(_filtered(array, components, rendered and components > 1))
    return b"".join((_SIGNATURE, _chunk(b"IHDR", header), more, _chunk(b"IDAT", body), _chunk(b"IEND", b"")))


def _filtered(array: NDArray[Any], components: int, rendered: bool) -> NDArray[np.uint8]:
    """The filtered scan lines, each preceded by the filter's number: Sub for bytes and for rendered pictures, None for bits
    and for other 16-bit numbers.
    """
    height = len(array)
    if array.dtype == np.bool_:
        rows = np.packbits(array, axis=1)
    elif array.dtype == np.uint16:
        rows = np.ascontiguousarray(array, ">u2").view(np.uint8).reshape(height, -1)
    else:
        rows = array.reshape(height, -1)
    lines = np.zeros((height, 1 + rows.shape[1]), np.uint8)
    if array.dtype != np.uint8 and not (rendered and array.dtype == np.uint16):
        lines[:, 1:] = rows
        return lines
    size = components * array.dtype.itemsize
    lines[:, 0] = _SUB
    lines[:, 1 : 1 + size] = rows[:, :size]
    np.subtract(rows[:, size:], rows[:, :-size], out=lines[:, 1 + size :])
    return lines


def _zlib(rows: NDArray[np.uint8], components: int) -> bytes:
    """The zlib stream of a rendered picture, filtered."""
    from viewsphere.codecs.deflate.kernels_huffman import subtract_left

    lines = np.empty((len(rows), 1 + rows.shape[1]), np.uint8)
    subtract_left(np.ascontiguousarray(rows), components, lines)
    return b"".join((b"\x78\x01", deflate_lines(lines, components), struct.pack(">I", isal_zlib.adler32(lines))))


def _chunk(kind: bytes, body: bytes) -> bytes:
    return b"".join((struct.pack(">I", len(body)), kind, body, struct.pack(">I", isal_zlib.crc32(body, isal_zlib.crc32(kind)))))


def decode_png(data: bytes) -> NDArray[Any]:
    """The array that `encode_png` was given: equal shape, dtype and values.

    Raises UserError when the file is damaged or was written by another program.
    """
    header, body, ended = b"", b"", False
    for kind, content in _chunks(data):
        header = content if kind == b"IHDR" else header
        body += content if kind == b"IDAT" else b""
        ended = kind == b"IEND"
    if len(header) != 13 or not ended or not body:
        raise UserError("PNG: expected a header and pixels, found the file's end: it is cut off")
    if not data.endswith(_chunk(b"IEND", b"")):
        raise UserError("PNG: the file is damaged: bytes follow its last chunk. Save the picture again")
    return _png_pixels(header, body)


def check_png(data: bytes) -> None:
    """Raise UserError if a PNG file of any program is damaged: every chunk has a checksum."""
    if not any(kind == b"IEND" for kind, _ in _chunks(data)):
        raise UserError("PNG: expected its last chunk, found the file's end: it is cut off")


def png_unit(data: bytes) -> float | None:
    """Metres in a step of a PNG file's numbers, None if the file has no unit; raises UserError as `decode_png` does."""
    for kind, content in _chunks(data):
        if kind == b"pCAL":
            name, _, rest = content.partition(b"\0")
            try:
                low, high, equation, count = struct.unpack_from(">iiBB", rest)
                unit, zero, span = rest[10:].split(b"\0")
                if (name, equation, count, unit, float(zero)) == (b"depth", 0, 2, b"m", 0.0):
                    return float(span) / (high - low)
            except (struct.error, ValueError, ZeroDivisionError):
                return None
    return None


def _chunks(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Type and content of every chunk; raises UserError if the file is damaged."""
    if not data.startswith(_SIGNATURE):
        raise UserError("PNG: the first 8 bytes are not those of a PNG file. Save the picture again as PNG")
    position = len(_SIGNATURE)
    while position < len(data):
        length, kind = struct.unpack_from(">I4s", data, position) if position + 12 <= len(data) else (len(data), b"")
        content = data[position + 8 : position + 8 + length]
        check = data[position + 8 + length : position + 12 + length]
        if len(check) < 4:
            raise UserError("PNG: expected another chunk, found the file's end: it is cut off")
        if check != struct.pack(">I", isal_zlib.crc32(content, isal_zlib.crc32(kind))):
            raise UserError(f"PNG: expected a whole {kind!r} chunk, its checksum is wrong: the file is damaged")
        yield kind, content
        if kind == b"IEND":
            return
        position += 12 + length


def _png_pixels(header: bytes, body: bytes) -> NDArray[Any]:
    width, height, depth, color, *_ = struct.unpack(">IIBBBBB", header)
    components = {_INDEXED: 1, **{color: count for count, color in _COLOR_TYPES.items()}}.get(color, 0)
    stride = (width * depth * components + 7) // 8
    if not components or depth not in (1, 8, 16):
        raise UserError(_FOREIGN_PNG)
    check_size(width, height)
    lines = np.frombuffer(_inflated(body, height * (1 + stride), "PNG"), np.uint8).reshape(height, -1)
    sub = depth == 8 or (depth == 16 and lines[0, 0] == _SUB)
    if np.any(lines[:, 0] != (_SUB if sub else 0)):
        raise UserError(_FOREIGN_PNG)
    if depth == 1:
        return np.unpackbits(lines[:, 1:], axis=1, count=width).astype(np.bool_)
    pixels = lines[:, 1:].reshape(height, width, components * depth // 8)
    if sub:
        pixels = np.add.accumulate(pixels, axis=1, dtype=np.uint8)
    if depth == 16:
        pixels = np.ascontiguousarray(pixels).view(">u2").astype(np.uint16)
    return pixels[:, :, 0] if components == 1 else pixels


def _inflated(body: bytes, expected: int, kind: str) -> bytes:
    try:
        pixels = isal_zlib.decompressobj().decompress(body, max_length=expected + 1)
    except isal_zlib.error as error:  # pyright: ignore[reportGeneralTypeIssues]
        raise UserError(f"{kind}: expected deflated pixels, found damage ({error})") from error
    if len(pixels) != expected:
        raise UserError(f"{kind}: expected {expected} bytes of pixels, found {len(pixels)}: the file is damaged")
    return pixels


def encode_tiff(array: NDArray[Any]) -> bytes:
    """A TIFF file of numbers: (H, W) or (H, W, 1..3), float32 or int32, not empty; inf and NaN are kept.

    One strip, deflate, little-endian, no predictor: any reader of 32-bit TIFF can read it.
    """
    components = 1 if array.ndim == 2 else array.shape[-1]
    if array.ndim not in (2, 3) or array.size == 0 or components not in (1, 2, 3) or array.dtype not in _SAMPLE_FORMATS:
        raise ValueError(f"encode_tiff: expected (H, W) or (H, W, 1..3) float32 or int32, got {array.shape} {array.dtype}")
    height, width = array.shape[:2]
    little = np.ascontiguousarray(array, array.dtype.newbyteorder("<"))
    stream, checksum = deflate(little)
    strip = (b"\x78\x01", stream, struct.pack(">I", checksum))
    return b"".join((_tiff_head(height, width, components, array.dtype, sum(map(len, strip))), *strip))


def _tiff_head(height: int, width: int, components: int, dtype: np.dtype[Any], size: int) -> bytes:
    """Return the bytes before a strip of `size` bytes."""
    head = _tiff_layout(height, width, components, dtype)
    return head[:_SIZE_AT] + struct.pack("<I", size) + head[_SIZE_AT + 4 :]


@lru_cache(maxsize=16)
def _tiff_layout(height: int, width: int, components: int, dtype: np.dtype[Any]) -> bytes:
    """The header for a strip of no bytes: the same for all files of one shape."""
    tags = {
        _WIDTH: ("I", [width]),
        _HEIGHT: ("I", [height]),
        _BITS: ("H", [32] * components),
        _COMPRESSION: ("H", [8]),
        _PHOTOMETRIC: ("H", [2 if components == 3 else 1]),
        _OFFSET: ("I", [0]),
        _SAMPLES: ("H", [components]),
        _ROWS: ("I", [height]),
        _BYTES: ("I", [0]),
        _PLANAR: ("H", [1]),
        _FORMAT: ("H", [_SAMPLE_FORMATS[dtype]] * components),
    }
    if components == 2:
        tags[_EXTRA] = ("H", [0])
    tags[_OFFSET] = ("I", [8 + len(_directory(tags))])
    return struct.pack("<2sHI", b"II", 42, 8) + _directory(tags)


def _directory(tags: dict[int, tuple[str, list[int]]]) -> bytes:
    """The image file directory, for byte 8 of the file; values that do not fit into an entry follow the directory."""
    beyond = 8 + 2 + 12 * len(tags) + 4
    entries, values = b"", b""
    for tag, (code, numbers) in sorted(tags.items()):
        value = struct.pack(f"<{len(numbers)}{code}", *numbers)
        if len(value) > 4:
            where = struct.pack("<I", beyond + len(values))
            values += value + b"\0" * (len(value) % 2)
        else:
            where = value.ljust(4, b"\0")
        entries += struct.pack("<HHI", tag, 3 if code == "H" else 4, len(numbers)) + where
    return struct.pack("<H", len(tags)) + entries + struct.pack("<I", 0) + values


def decode_tiff(data: bytes) -> NDArray[Any]:
    """The array that `encode_tiff` was given: equal shape, dtype and bits.

    Raises UserError when the file is damaged or was written by another program.
    """
    try:
        (position,) = struct.unpack_from("<I", data, 4)
        (count,) = struct.unpack_from("<H", data, position)
        tags = {
            tag: (numbers, value if kind == 4 else value & 0xFFFF)
            for tag, kind, numbers, value in struct.iter_unpack("<HHII", data[position + 2 : position + 2 + 12 * count])
        }
        height, width, components, offset = (tags[tag][1] for tag in (_HEIGHT, _WIDTH, _SAMPLES, _OFFSET))
        if components not in (1, 2, 3):
            raise UserError(_FOREIGN_TIFF)
        formats, where = tags[_FORMAT]
        sample = struct.unpack_from("<H", data, where)[0] if formats > 2 else where
        dtype = {number: dtype for dtype, number in _SAMPLE_FORMATS.items()}[sample]
        head = _tiff_head(height, width, components, dtype, len(data) - offset)
    except (struct.error, KeyError) as error:
        raise UserError(_FOREIGN_TIFF) from error
    if data[:offset] != head:
        raise UserError(_FOREIGN_TIFF)
    check_size(width, height)
    pixels = _inflated(data[offset:], 4 * height * width * components, "TIFF")
    shape = (height, width) if components == 1 else (height, width, components)
    return np.frombuffer(pixels, dtype.newbyteorder("<")).reshape(shape).astype(dtype)
