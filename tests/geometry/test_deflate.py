"""Deflated bytes are a function of the input, whatever lies in memory and wherever the work is done."""

from __future__ import annotations

import threading
import zlib

import numpy as np
import pytest
from isal import isal_zlib

from quick import quick
from viewsphere.codecs.deflate import RAW, ZLIB, compressed, deflate_lines
from viewsphere.codecs.deflate.kernels_huffman import LONGEST_CODE

PLACES = ((1 << 20, 0), (3 << 20, 7), (5 << 20, 255), (9 << 20, 90))
"""Bytes of a thread's stack, and the number that freed memory is full of."""

BLOCKS = (256, 1 << 14, 60_000, 90_000, 250_000, 300_000)  # bytes; ISA-L's states and tables are of such sizes


def returning_heads(count: int, length: int) -> list[np.ndarray]:
    """Bytes of which the third to the sixth, and hardly any other four, come again.

    Deflated by `isal_zlib.compress`, of 8,000 of these some 10 become other bytes in another thread.
    """
    rng = np.random.default_rng(4)
    inputs = rng.integers(0, 64, (count, length), dtype=np.uint8)
    inputs[:, 36:40] = inputs[:, 2:6]
    return list(inputs)


def elsewhere(make, stack: int, pattern: int) -> list:
    """What `make` returns in a thread with a stack of so many bytes, where freed memory is full of a pattern."""
    found, held = [], [bytearray(90_000) for _ in range(pattern)]

    def work():
        dirt = [bytearray([pattern]) * size for size in BLOCKS for _ in range(4)]
        del dirt
        found.extend(make())

    before = threading.stack_size(stack)
    try:
        thread = threading.Thread(target=work)
        thread.start()
        thread.join()
    finally:
        threading.stack_size(before)
        held.clear()
    return found


@pytest.mark.parametrize("window", quick([ZLIB, RAW], RAW))
def test_equal_bytes_are_deflated_equally_in_every_thread_and_memory(window):
    inputs = returning_heads(8000, 300)
    first, *others = (elsewhere(lambda: [compressed(data, window) for data in inputs], *place) for place in PLACES)
    assert [sum(a != b for a, b in zip(first, other, strict=True)) for other in others] == [0, 0, 0]


@pytest.mark.parametrize("length", [*range(20), 255, 65_536, 200_000])
@pytest.mark.parametrize("values", [1, 2, 256])
def test_deflated_bytes_inflate_to_the_input(length, values):
    data = np.random.default_rng(length).integers(0, values, length, dtype=np.uint8)
    assert zlib.decompress(compressed(data)) == zlib.decompress(compressed(data, RAW), RAW) == data.tobytes()


def test_an_array_of_wider_numbers_is_deflated_as_its_bytes_lie():
    data = np.arange(24, dtype=">u2").reshape(4, 6)[:, ::2]
    assert zlib.decompress(compressed(data)) == data.tobytes()


def test_deflating_for_sure_costs_no_size():
    """The block of the first bytes is some 10 bytes."""
    for values in (1, 4, 64, 256):
        data = np.random.default_rng(values).integers(0, values, 3000, dtype=np.uint8)
        assert len(compressed(data)) <= len(isal_zlib.compress(data, 1)) + 16


def huffman_only(lines: np.ndarray) -> int:
    """Bytes that zlib makes of scan lines by Huffman codes alone."""
    coder = zlib.compressobj(9, zlib.DEFLATED, RAW, 9, zlib.Z_HUFFMAN_ONLY)
    return len(coder.compress(lines.tobytes()) + coder.flush())


@pytest.mark.parametrize("step", [3, 4])
@pytest.mark.parametrize(("height", "width"), [(1, 1), (3, 700), (480, 1), (150, 200), (2, 22_000)])
@pytest.mark.parametrize("spread", [0.0, 0.3, 2.0, 30.0])
def test_scan_lines_inflate_to_the_input_and_are_no_longer_than_zlibs_codes(height, width, step, spread):
    rng = np.random.default_rng([height, width, int(10 * spread)])
    lines = np.empty((height, 1 + step * width), np.uint8)
    lines[:] = rng.normal(0, spread, lines.shape).round().astype(np.int64) & 255
    lines[:, 0] = 1
    data = deflate_lines(lines, step)
    assert zlib.decompress(data, RAW) == lines.tobytes()
    assert len(data) <= 1.02 * huffman_only(lines) + 200  # their lengths are sent in full


def test_codes_of_rare_bytes_are_shortened():
    """Numbers each half as frequent as the one before would have codes of up to 19 bits."""
    rng = np.random.default_rng(0)
    lines = np.minimum(rng.geometric(0.5, (128, 1 + 3 * 2048)), 200).astype(np.uint8)
    assert lines.max() > LONGEST_CODE
    data = deflate_lines(lines, 3)
    assert zlib.decompress(data, RAW) == lines.tobytes()
    assert len(data) <= 1.02 * huffman_only(lines)


def test_noise_is_not_made_longer():
    lines = np.random.default_rng(1).integers(0, 256, (90, 1 + 3 * 80), dtype=np.uint8)
    data = deflate_lines(lines, 3)
    assert zlib.decompress(data, RAW) == lines.tobytes()
    assert len(data) < lines.size + 64


def test_runs_of_every_length_come_back():
    """Runs of equal pixels, of 1 to 200 pixels, at the start, in the middle and at the end of lines."""
    lines = np.zeros((200, 1 + 3 * 420), np.uint8)
    for k in range(1, 200):
        pixels = lines[k, 1:].reshape(420, 3)
        pixels[:] = 9
        pixels[:k], pixels[k + 5 : 2 * k + 5], pixels[420 - k // 4 :] = 0, 0, 0
    data = deflate_lines(lines, 3)
    assert zlib.decompress(data, RAW) == lines.tobytes()
    assert len(data) < lines.size / 12
