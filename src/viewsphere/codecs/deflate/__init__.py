"""Pixels, deflated fast (RFC 1951), for the image files that hold deflated data: equal pixels always make equal bytes."""

from __future__ import annotations

from typing import Any

import numpy as np
from isal import isal_zlib
from numpy.typing import NDArray

ZLIB, RAW = 15, -15
"""Windows of 32 kB, with or without zlib's header and checksum."""

LEVEL = 1
"""ISA-L's compression level: ten times as fast as zlib's usual level, with hardly larger output."""

HEAD = 8
"""Number of leading bytes that become a separate block, between 4 and 16; see `compressed`."""


def compressed(array: NDArray[Any], window: int = ZLIB) -> bytes:
    """The deflated bytes of an array in C order; the result depends on those bytes alone.

    The result of `isal_zlib.compress` does not. If ISA-L's loop for x86 begins without a history (`.write_first_byte` of
    igzip_icf_body_h1_gr_bt.asm, levels 1 and 2), it hashes the leftover content of a register, the address of its own state,
    instead of the bytes from the third on. For one in 8,192 addresses (for short inputs, one in hundreds), this equals the hash
    of bytes in the input and changes a later match. To give the loop a history, the first HEAD bytes become a separate block.
    They are too few for that loop, so the loop for the last bytes encodes them. This costs 20 to 40 bytes and 0.03 ms.

    All of ISA-L's code for x86 from SSE 4.2 on makes the same bytes. Its code for ARM, and for older processors, finds other
    matches: equal pixels make equal bytes there too, but other bytes than on a newer x86.
    """
    data = np.ascontiguousarray(array).reshape(-1).view(np.uint8)
    deflator = isal_zlib.compressobj(LEVEL, isal_zlib.DEFLATED, window)
    head = deflator.compress(data[:HEAD]) + deflator.flush(isal_zlib.Z_SYNC_FLUSH)
    return b"".join((head, deflator.compress(data[HEAD:]), deflator.flush()))


def deflate(array: NDArray[Any]) -> tuple[bytes | memoryview, int]:
    """The raw deflate stream of an array's bytes in C order, and their Adler-32 checksum.

    For float32 pixels (H, W) or (H, W, 3), only runs of equal pixels are coded, since other matches cost more than they save;
    see `kernels_deflate`.
    """
    step = 1 if array.ndim == 2 else array.shape[-1]
    array = np.ascontiguousarray(array)
    if array.dtype.newbyteorder("=") != np.float32 or step not in (1, 3):
        return compressed(array, RAW), isal_zlib.adler32(array)
    from viewsphere.codecs.deflate.kernels_deflate import STORED, deflate_runs, match_codes

    data = array.reshape(-1).view(np.uint8)
    out = np.empty(data.size + 5 * (data.size // STORED) + 64, np.uint8)
    end, checksum = deflate_runs(data.view(np.uint32), step, *match_codes(4 * step), data, out, 0)
    return out[:end].data, checksum


def deflate_lines(lines: NDArray[np.uint8], step: int) -> bytes:
    """The raw deflate stream of a rendered picture's filtered scan lines, of pixels of 3 or 4 bytes.

    For rendered pictures, twice as fast as `compressed` with output of the same size; see `kernels_huffman`. Lines that this
    method would enlarge, such as noise, go to `compressed`.
    """
    from viewsphere.codecs.deflate import kernels_huffman as kernels

    words = np.empty((lines.shape[1] - 1) // step + kernels.RUN, np.uint32)
    out, room = np.empty(2 * lines.size + 512, np.uint8), np.zeros((4, kernels.SYMBOLS), np.int64)
    end = kernels.deflate_lines(lines, step, words, room, out)
    return compressed(lines, RAW) if end > lines.size else out[:end].tobytes()
