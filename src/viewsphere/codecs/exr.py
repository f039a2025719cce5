"""Arrays to OpenEXR files and back, in memory: scan lines, ZIP compression, 16- or 32-bit channels, every bit kept.

Format: https://openexr.com/en/latest/OpenEXRFileLayout.html. The reader reads only files that the writer made.
"""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
from isal import isal_zlib
from numpy.typing import NDArray

from viewsphere.codecs.deflate import compressed
from viewsphere.codecs.size import check_size
from viewsphere.errors import UserError

_MAGIC = struct.pack("<II", 20000630, 2)
_ZIP, _LINES = 3, 16
_KINDS = {np.dtype(np.int32): 0, np.dtype(np.float16): 1, np.dtype(np.float32): 2}
_NAMES = {1: ("Z",), 2: ("R", "G"), 3: ("R", "G", "B")}
_WINDOW = b"dataWindow\0box2i\0" + struct.pack("<I", 16)
MOST_DEFLATED = 1032  # greatest ratio of a deflated stream's content to its own size
BRIGHTEST_HALF = 65504.0
"""The largest finite half float (IEEE 754 binary16)."""
_FOREIGN = "EXR: expected viewsphere's own, found a damaged file or another program's"


def encode_exr(array: NDArray[Any]) -> bytes:
    """An EXR file of (H, W), as channel Z, or (H, W, 2 or 3), as channels R, G and B; float16, float32 or int32, not empty.

    EXR has no signed integers: int32 numbers become UINT numbers with the same bits.
    """
    components = 1 if array.ndim == 2 else array.shape[-1]
    if array.ndim not in (2, 3) or array.size == 0 or components not in _NAMES or array.dtype not in _KINDS:
        raise ValueError(f"encode_exr: expected (H, W) or (H, W, 2..3) of 16 or 32 bits, got {array.shape} {array.dtype}")
    height, width = array.shape[:2]
    head = _header(width, height, components, _KINDS[array.dtype])
    planes = array.reshape(height, width, components)[:, :, ::-1]  # channels lie in the order of their names: B, G, R
    rows = np.ascontiguousarray(planes.transpose(0, 2, 1), array.dtype.newbyteorder("<")).view(np.uint8).reshape(height, -1)
    blocks: list[bytes] = []
    for y in range(0, height, _LINES):
        raw = rows[y : y + _LINES].reshape(-1)
        packed = compressed(_mixed(raw))
        body = packed if len(packed) < raw.size else raw.tobytes()
        blocks.append(struct.pack("<iI", y, len(body)) + body)
    places = np.cumsum([len(head) + 8 * len(blocks), *map(len, blocks[:-1])]).astype("<u8")
    return b"".join((head, places.tobytes(), *blocks))


def half_floats(light: NDArray[np.float32]) -> NDArray[np.float16]:
    """Light as half floats, rounded to 11 bits; light above their largest number, 65,504, becomes this number."""
    return np.minimum(light, np.float32(BRIGHTEST_HALF)).astype(np.float16)


def _header(width: int, height: int, components: int, kind: int) -> bytes:
    channels = b"".join(struct.pack("<2siIii", name.encode(), kind, 0, 1, 1) for name in sorted(_NAMES[components])) + b"\0"
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    attributes = (
        (b"channels", b"chlist", channels),
        (b"compression", b"compression", bytes([_ZIP])),
        (b"dataWindow", b"box2i", window),
        (b"displayWindow", b"box2i", window),
        (b"lineOrder", b"lineOrder", b"\0"),
        (b"pixelAspectRatio", b"float", struct.pack("<f", 1)),
        (b"screenWindowCenter", b"v2f", struct.pack("<2f", 0, 0)),
        (b"screenWindowWidth", b"float", struct.pack("<f", 1)),
    )
    lines = (name + b"\0" + kind_ + b"\0" + struct.pack("<I", len(value)) + value for name, kind_, value in attributes)
    return _MAGIC + b"".join(lines) + b"\0"


def _mixed(raw: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """EXR's prediction: bytes at even indices, then bytes at odd indices, each as its difference from the previous byte, plus
    128.
    """
    parted = np.concatenate([raw[::2], raw[1::2]])
    parted[1:] = np.diff(parted) + np.uint8(128)
    return parted


def _unmixed(parted: NDArray[np.uint8]) -> NDArray[np.uint8]:
    steps = parted + np.uint8(128)
    steps[0] = parted[0]
    flat = np.add.accumulate(steps, dtype=np.uint8)
    raw, half = np.empty_like(flat), (len(flat) + 1) // 2
    raw[::2], raw[1::2] = flat[:half], flat[half:]
    return raw


def decode_exr(data: bytes) -> NDArray[Any]:
    """The array that `encode_exr` was given: equal shape, dtype and bits.

    Raises UserError when the file is damaged or was written by another program.
    """
    width, height, components, dtype, position = _layout(data)
    check_size(width, height)
    blocks = -(-height // _LINES)
    table, position = position, position + 8 * blocks
    places: list[int] = []
    rows = np.empty((height, dtype.itemsize * width * components), np.uint8)
    try:
        for y in range(0, height, _LINES):
            line, size = struct.unpack_from("<iI", data, position)
            body = data[position + 8 : position + 8 + size]
            wanted = rows[y : y + _LINES].size
            raw = body if size == wanted else isal_zlib.decompress(body)
            if line != y or len(body) != size or len(raw) != wanted:
                raise UserError(f"EXR: line {y} is damaged: it does not have {wanted} bytes. Save the picture again")
            flat = np.frombuffer(raw, np.uint8)
            rows[y : y + _LINES] = (flat if size == wanted else _unmixed(flat)).reshape(-1, rows.shape[1])
            places.append(position)
            position += 8 + size
        if data[table : table + 8 * blocks] != np.array(places, "<u8").tobytes() or position != len(data):
            raise UserError("EXR: the table of line offsets is damaged. Save the picture again")
    except (struct.error, isal_zlib.error) as error:  # pyright: ignore[reportGeneralTypeIssues]
        raise UserError(f"EXR: expected {height} lines, found damage ({error}): the file is cut off or damaged") from error
    planes = rows.view(dtype.newbyteorder("<")).reshape(height, components, width)
    array = planes[:, ::-1].transpose(0, 2, 1).astype(dtype, order="C")
    return array[:, :, 0] if components == 1 else array


def _layout(data: bytes) -> tuple[int, int, int, np.dtype[Any], int]:
    """Width, height, components and dtype of a file that `encode_exr` made, and the offset of its table of lines."""
    at = data.find(_WINDOW) + len(_WINDOW)
    if at >= len(_WINDOW) and len(data) >= at + 16:
        right, bottom = struct.unpack_from("<2i", data, at + 8)
        for components in _NAMES:
            for dtype, kind in _KINDS.items():
                own = _header(right + 1, bottom + 1, components, kind)
                size = dtype.itemsize * components * (right + 1) * (bottom + 1)
                if right >= 0 and bottom >= 0 and data.startswith(own) and size <= MOST_DEFLATED * len(data):
                    return right + 1, bottom + 1, components, dtype, len(own)
    raise UserError(_FOREIGN)
