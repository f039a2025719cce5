"""A compiled deflate for pixels of 32-bit numbers: runs of equal pixels are coded, all other bytes are stored as they are.

Rendered numbers are noise on curved surfaces and constant elsewhere. A search for matches other than runs takes four times as
long and saves a tenth of the bytes. The stream is plain deflate (RFC 1951), blocks of type 0 and 1 in turn.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from viewsphere.kernels.jit import inner, njit

U = np.uintp
SHORTEST = 64  # bytes: the shortest run that makes up for two blocks
LONGEST = 258
AHEAD = 96  # words compared at once: whole pixels of 1 and of 3 words; fewer would be unrolled instead of vectorised
STORED = 65535
MODULUS, PIECE = 65521, 4096  # of an Adler-32 checksum; bytes whose weighted sum fits into 32 bits


@cache
def match_codes(distance: int) -> tuple[np.ndarray, np.ndarray]:
    """Codes of a match of each length (0 to 258) at a distance of 4 or 12 bytes, bits in the order sent, and their widths.

    RFC 1951, 3.2.5 and 3.2.6.
    """
    codes, widths = np.zeros(LONGEST + 1, np.uint64), np.zeros(LONGEST + 1, np.int64)
    far, far_width = {4: (0b11000, 5), 12: (0b1101100, 7)}[distance]  # code 3; code 6 with extra bits 3
    for length in range(3, LONGEST + 1):
        extra = max((length - 3).bit_length() - 3, 0)
        symbol = 257 + 4 * extra + ((length - 3) >> extra) if length < LONGEST else 285
        extra = extra if length < LONGEST else 0
        code, width = (symbol - 256, 7) if symbol < 280 else (symbol - 88, 8)
        turned = int(f"{code:0{width}b}"[::-1], 2) | ((length - 3) & ((1 << extra) - 1)) << width
        codes[length], widths[length] = turned | far << (width + extra), width + extra + far_width
    return codes, widths


@njit
def deflate_runs(words, step, codes, widths, data, out, at):
    """Write the raw deflate stream of `data` (bytes, not empty) into `out` from index `at`; return the index after its end, and
    the data's Adler-32 checksum (RFC 1950).

    `words` are the same bytes as 32-bit words, `step` (1 or 3) of which make a pixel; `codes` and `widths` are from
    `match_codes`. The checksum of a run follows from that of one pixel, so that runs are read once.
    """
    count, second, third = len(words), step // 3, 2 * (step // 3)
    waiting, bits = np.uint64(0), 0
    i, literal, low, high = 0, 0, 1, 0
    while i < count:
        i = _next_run(words, step, i)
        a, b, c = words[U(i)], words[U(i + second)], words[U(i + third)]
        j = i + step
        while j + AHEAD <= count and _repeats(words, step, j):
            j += AHEAD
        while j < count and words[U(j)] == a and words[U(j + second)] == b and words[U(j + third)] == c:
            j += step
        left = 4 * (j - i - step)
        is_run, is_last = left >= SHORTEST, j == count
        if is_run or is_last:
            end = 4 * (i + step) if is_run else 4 * count
            while literal < end:  # blocks of type 0, each beginning at a whole byte
                size = min(end - literal, STORED)
                at, waiting, bits = send(out, at, waiting, (bits + 10) // 8 * 8)
                for k in range(2):
                    byte = (size >> (8 * k)) & 255
                    out[at + k], out[at + k + 2] = byte, byte ^ 255
                at += 4
                to, begin = U(at), U(literal)
                for k in range(U(size)):
                    out[to + k] = data[begin + k]
                low, high = _add_bytes(data, literal, size, low, high)
                at, literal = at + size, literal + size
            waiting |= np.uint64(0b011 if is_last else 0b010) << np.uint64(bits)  # a block of type 1, repeating a pixel
            bits += 3
            if is_run:
                low, high = _add_run(data, 4 * i, 4 * step, (j - i) // step - 1, low, high)
            while is_run and left > 0:
                length = left if left <= LONGEST else min(left - 3, LONGEST)
                left -= length
                waiting |= codes[length] << np.uint64(bits)
                at, waiting, bits = send(out, at, waiting, bits + widths[length])
            at, waiting, bits = send(out, at, waiting, bits + 7)
            literal = 4 * j
        i = j
    return send(out, at, waiting, (bits + 7) // 8 * 8)[0], high << 16 | low


@inner
def _add_bytes(data, begin, size, low, high):
    """Both halves of the checksum after `size` further bytes, from `begin` on."""
    for first in range(begin, begin + size, PIECE):
        n = U(min(PIECE, begin + size - first))
        total, weighted = np.uint32(0), np.uint32(0)
        for k in range(n):
            byte = np.uint32(data[U(first) + k])
            total += byte
            weighted += np.uint32(n - k) * byte
        high = (high + np.int64(n) * low + np.int64(weighted)) % MODULUS
        low = (low + np.int64(total)) % MODULUS
    return low, high


@inner
def _add_run(data, begin, size, times, low, high):
    """Both halves of the checksum after so many repetitions of the `size` bytes from `begin` on."""
    total, weighted = 0, 0
    for k in range(size):
        byte = np.int64(data[U(begin + k)])
        total, weighted = total + byte, weighted + (size - k) * byte
    pairs = times * (times - 1) // 2 % MODULUS
    high = (high + times * size % MODULUS * low + times * weighted + pairs * size * total) % MODULUS
    return (low + times * total) % MODULUS, high


@inner
def _next_run(words, step, i):
    """Start of the first run at or after i that is worth coding, or of a shorter run before it; i must be the start of a run.

    Comparing one pair of neighbours in every SHORTEST bytes is enough to notice every run of that length.
    """
    count, first, stride = len(words), i, SHORTEST // 4 // step * step
    while i + stride + step <= count:
        at = i + stride - step
        if words[U(at)] == words[U(at + step)] and words[U(at + step - 1)] == words[U(at + 2 * step - 1)]:
            while at > first and _is_like(words, step, at - step):
                at -= step
            return at
        i = at + step
    return i


@inner
def _is_like(words, step, i):
    """Return whether pixel i equals the next one."""
    second, third = step // 3, 2 * (step // 3)
    a, b, c = U(i), U(i + second), U(i + third)
    s = U(step)
    return words[a] == words[a + s] and words[b] == words[b + s] and words[c] == words[c + s]


@inner
def _repeats(words, step, j):
    """Return whether each of AHEAD words from j on equals the same word of the pixel before."""
    different = np.uint32(0)
    before, own = U(j - step), U(j)
    for k in range(U(AHEAD)):
        different |= words[own + k] ^ words[before + k]
    return different == 0


@inner
def send(out, at, waiting, bits):
    """Write the whole bytes among the waiting bits."""
    for k in range(U(8)):  # always 8 bytes, most are overwritten next: loops of 1 to 3 bytes mispredict branches
        out[U(at) + k] = np.uint8(waiting >> np.uint64(8 * k))
    whole = bits >> 3
    return at + whole, waiting >> np.uint64(8 * whole), bits & 7
