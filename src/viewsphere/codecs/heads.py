"""The picture sizes in the headers of QOI and JPEG XL files, read before anything is unpacked.

QOI: https://qoiformat.org/qoi-specification.pdf; JPEG XL: ISO/IEC 18181-1 (SizeHeader) and 18181-2 (boxes).
"""

from __future__ import annotations

import struct
from fractions import Fraction

JXL_BARE = b"\xff\x0a"
JXL_BOXES = b"\0\0\0\x0cJXL \r\n\x87\n"
_RATIOS = (1, Fraction(6, 5), Fraction(4, 3), Fraction(3, 2), Fraction(16, 9), Fraction(5, 4), 2)


def qoi_size(data: bytes) -> tuple[int, int]:
    """Width and height from a QOI file's header; raises ValueError if the header is cut off."""
    if len(data) < 14:
        raise ValueError("QOI: expected 14 bytes of its head, found the file's end: it is cut off")
    width, height = struct.unpack_from(">II", data, 4)
    return width, height


def jxl_size(data: bytes) -> tuple[int, int]:
    """Width and height from a JPEG XL file's header, bare or in boxes; raises ValueError if the file has none."""
    start = 0 if data.startswith(JXL_BARE) else _codestream(data)
    if data[start : start + 2] != JXL_BARE or len(data) < start + 12:
        raise ValueError("JPEG XL: expected the size of its picture, found none: it is damaged or cut off")
    bits = _Bits(int.from_bytes(data[start + 2 : start + 12], "little"))
    is_small = bits.take(1)
    height = 8 * (bits.take(5) + 1) if is_small else bits.side()
    ratio = bits.take(3)
    if ratio:
        return int(height * _RATIOS[ratio - 1]), height
    return 8 * (bits.take(5) + 1) if is_small else bits.side(), height


class _Bits:
    """Numbers of a stream of bits, the lowest first."""

    def __init__(self, left: int) -> None:
        self._left = left

    def take(self, count: int) -> int:
        found, self._left = self._left & ((1 << count) - 1), self._left >> count
        return found

    def side(self) -> int:
        return self.take((9, 13, 18, 30)[self.take(2)]) + 1


def _codestream(data: bytes) -> int:
    """Return the offset of the picture in a file of boxes; the file's end if there is none."""
    place = 0
    while place + 8 <= len(data):
        size, kind = struct.unpack_from(">I4s", data, place)
        head = 8
        if size == 1 and place + 16 <= len(data):
            (size,), head = struct.unpack_from(">Q", data, place + 8), 16
        if kind in (b"jxlc", b"jxlp"):
            return place + head + 4 * (kind == b"jxlp")
        if size < head:
            break
        place += size
    return len(data)
