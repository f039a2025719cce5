"""A compiled deflate for filtered scan lines of rendered pictures: Huffman codes, with matches only for runs of zeros.

The filter leaves small numbers, and zeros where pixels equal their left neighbours. Any other match would save 2 % of the bytes
of a rendered picture and double the time. The stream is one block of type 2 (RFC 1951); its codes fit a sample of the lines.
"""

from __future__ import annotations

import numpy as np

from viewsphere.codecs.deflate.kernels_deflate import send
from viewsphere.kernels.jit import inner, njit

U = np.uintp
SYMBOLS, END = 286, 256
SUB = 1  # the filter's number in PNG
LONGEST_CODE = 14  # bits: codes of four bytes and the pending bits just fit into 64
LONGEST = 258  # bytes of a match
RUN = 3  # zero pixels that begin a run: shorter runs cause branch mispredictions and save little
WEIGHT = 16  # weight of a counted symbol: unseen symbols count 1, and get longer codes in small pictures, too
LINES, PIXELS = 32, 20_000  # least sample that codes are made from: files are at most 0.4 % larger than with 120 lines
LENGTH_BITS = 4  # bits of every sent code length; costs 80 bytes, avoids a second Huffman code
ORDER = (16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15)  # of code lengths: RFC 1951, 3.2.7


@njit
def subtract_left(rows, step, lines):
    """Fill scan lines (H, 1 + W) uint8 with rows (H, W) uint8 after PNG's Sub filter, which subtracts the byte `step` places
    before. Each line starts with the filter's number.
    """
    first, width = U(step), U(rows.shape[1])
    for y in range(U(rows.shape[0])):
        row, line = rows[y], lines[y]
        line[U(0)] = SUB
        for i in range(first):
            line[i + U(1)] = row[i]
        for i in range(first, width):
            line[i + U(1)] = row[i] - row[i - first]


@njit
def deflate_lines(lines, step, words, room, out):
    """Write the raw deflate stream of filtered scan lines (H, 1 + step * W) uint8 into `out`, from its start; return the index
    after its end.

    step: bytes of a pixel, 3 or 4. words (W + RUN,) uint32, room (4, SYMBOLS) int64: scratch. out holds two bytes for each
    byte of the lines, and 512 more.
    """
    height = U(lines.shape[0])
    codes = room[0]
    _count(lines, step, words, codes)
    _make_codes(codes, room[1], room[2], room[3])
    waiting, bits, at = np.uint64(0b101), 3, 0  # the last block, of type 2
    at, waiting, bits = _send_lengths(codes, out, at, waiting, bits)
    for y in range(height):
        _gather(lines, y, step, words)
        at, waiting, bits = _put(codes[U(lines[y, U(0)])], out, at, waiting, bits)
        x, width = U(0), U(words.shape[0] - RUN)
        while x < width:
            word = words[x]
            if (word | words[x + U(1)] | words[x + U(2)]) == 0:
                stop = _run_end(words, x)
                at, waiting, bits = _put(codes[U(0)], out, at, waiting, bits)
                left = step * np.int64(stop - x) - 1
                while left > 0:
                    length = left if left <= LONGEST else min(left - 3, LONGEST)
                    left -= length
                    symbol, extra, width_of_extra = _length_symbol(length)
                    at, waiting, bits = _put(codes[U(symbol)], out, at, waiting, bits)
                    waiting |= np.uint64(extra) << np.uint64(bits)
                    at, waiting, bits = send(out, at, waiting, bits + width_of_extra + 1)  # and a bit, 0, for the distance 1
                x = stop
                continue
            waiting, bits = _append(codes[U(word & np.uint32(255))], waiting, bits)
            waiting, bits = _append(codes[U((word >> np.uint32(8)) & np.uint32(255))], waiting, bits)
            waiting, bits = _append(codes[U((word >> np.uint32(16)) & np.uint32(255))], waiting, bits)
            if step == 4:
                waiting, bits = _append(codes[U(word >> np.uint32(24))], waiting, bits)
            at, waiting, bits = send(out, at, waiting, bits)
            x += U(1)
    at, waiting, bits = _put(codes[U(END)], out, at, waiting, bits)
    return send(out, at, waiting, (bits + 7) // 8 * 8)[0]


@inner
def _gather(lines, y, step, words):
    """Fill words (W + RUN,) with the pixels of a line, a word each; the last ones never begin a run."""
    width = U(words.shape[0] - RUN)
    if step == 4:
        for x in range(width):
            i = U(4) * x
            low = np.uint32(lines[y, i + U(1)]) | np.uint32(lines[y, i + U(2)]) << np.uint32(8)
            words[x] = low | np.uint32(lines[y, i + U(3)]) << np.uint32(16) | np.uint32(lines[y, i + U(4)]) << np.uint32(24)
    else:
        for x in range(width):
            i = U(3) * x
            low = np.uint32(lines[y, i + U(1)]) | np.uint32(lines[y, i + U(2)]) << np.uint32(8)
            words[x] = low | np.uint32(lines[y, i + U(3)]) << np.uint32(16)
    for k in range(U(RUN)):
        words[width + k] = np.uint32(1)


@inner
def _run_end(words, x):
    """The first word from x on that is not 0."""
    while words[x] == 0:
        x += U(1)
    return x


@inner
def _count(lines, step, words, counts):
    """Fill counts (SYMBOLS,) with the count of each symbol in a sample of the lines; every count is at least 1."""
    height, width = lines.shape[0], U(words.shape[0] - RUN)
    for k in range(U(SYMBOLS)):
        counts[k] = 1
    for y in range(U(0), U(height), U(max(1, min(height // LINES, height * np.int64(width) // PIXELS)))):
        _gather(lines, y, step, words)
        counts[U(lines[y, U(0)])] += WEIGHT
        x = U(0)
        while x < width:
            word = words[x]
            if (word | words[x + U(1)] | words[x + U(2)]) == 0:
                stop = _run_end(words, x)
                counts[U(0)] += WEIGHT
                left = step * np.int64(stop - x) - 1
                while left > 0:
                    length = left if left <= LONGEST else min(left - 3, LONGEST)
                    left -= length
                    counts[U(_length_symbol(length)[0])] += WEIGHT
                x = stop
                continue
            for _ in range(step):
                counts[U(word & np.uint32(255))] += WEIGHT
                word >>= np.uint32(8)
            x += U(1)


@inner
def _length_symbol(length):
    """The symbol of a match of this length (3 to 258), its extra bits, and their number (RFC 1951, 3.2.5)."""
    if length == LONGEST:
        return 285, 0, 0
    past, extra = length - 3, 0
    while past >> extra >= 8:
        extra += 1
    return 257 + 4 * extra + (past >> extra), past & ((1 << extra) - 1), extra


@inner
def _make_codes(codes, order, depths, amounts):
    """Turn counts in codes (SYMBOLS,), all positive, into codes: 256 times the bits in the order sent, plus their number.

    order, depths and amounts (SYMBOLS,): scratch. The lengths are those of a Huffman code, none longer than LONGEST_CODE.
    """
    for s in range(U(SYMBOLS)):  # by count; few are out of order for long
        i = s
        while i > U(0) and codes[U(order[i - U(1)])] > codes[s]:
            order[i] = order[i - U(1)]
            i -= U(1)
        order[i] = s
    for i in range(U(SYMBOLS)):
        depths[i] = codes[U(order[i])]
    _tree_depths(depths)
    _shorten(depths, amounts)
    i = SYMBOLS
    for length in range(1, LONGEST_CODE + 1):
        for _ in range(amounts[U(length)]):
            i -= 1
            codes[U(order[U(i)])] = length
    code = 0
    for length in range(1, LONGEST_CODE + 1):  # ascending by length and symbol: RFC 1951, 3.2.2
        for s in range(U(SYMBOLS)):
            if codes[s] == length:
                depths[s] = (_turned(code, length) << 8) | length
                code += 1
        code <<= 1
    for s in range(U(SYMBOLS)):
        codes[s] = depths[s]


@inner
def _tree_depths(a):
    """Replace sorted counts (n,) by the depths of their leaves in a Huffman tree.

    Moffat and Katajainen, In-place calculation of minimum-redundancy codes, 1995.
    """
    n, root, leaf = a.shape[0], 0, 2
    a[U(0)] += a[U(1)]
    for k in range(1, n - 1):
        total = np.int64(0)
        for _ in range(2):
            if leaf >= n or (root < k and a[U(root)] < a[U(leaf)]):
                total += a[U(root)]
                a[U(root)] = k
                root += 1
            else:
                total += a[U(leaf)]
                leaf += 1
        a[U(k)] = total
    a[U(n - 2)] = 0
    for k in range(n - 3, -1, -1):
        a[U(k)] = a[U(a[U(k)])] + 1
    free, depth, root, k = 1, 0, n - 2, n - 1
    while free > 0:
        used = 0
        while root >= 0 and a[U(root)] == depth:
            used += 1
            root -= 1
        while free > used:
            a[U(k)] = depth
            k -= 1
            free -= 1
        free, depth = 2 * used, depth + 1


@inner
def _shorten(depths, amounts):
    """Fill amounts with the number of codes of each length in a tree; no code is longer than LONGEST_CODE."""
    for k in range(U(SYMBOLS)):
        amounts[k] = 0
    for k in range(U(SYMBOLS)):
        amounts[U(min(depths[k], LONGEST_CODE))] += 1
    total = 0
    for length in range(1, LONGEST_CODE + 1):
        total += amounts[U(length)] << (LONGEST_CODE - length)
    while total > 1 << LONGEST_CODE:  # a leaf replaces a shorter one, and both move one level down
        amounts[U(LONGEST_CODE)] -= 1
        length = LONGEST_CODE - 1
        while amounts[U(length)] == 0:
            length -= 1
        amounts[U(length)] -= 1
        amounts[U(length + 1)] += 2
        total -= 1


@inner
def _turned(code, length):
    """The bits of a code in reverse order."""
    turned = 0
    for k in range(length):
        turned |= ((code >> k) & 1) << (length - 1 - k)
    return turned


@inner
def _send_lengths(codes, out, at, waiting, bits):
    """Send the table of code lengths, each in a fixed number of bits, and the table of the one distance, whose code has one
    bit.
    """
    waiting |= np.uint64((SYMBOLS - 257) | 0 << 5 | (len(ORDER) - 4) << 10) << np.uint64(bits)
    at, waiting, bits = send(out, at, waiting, bits + 14)
    for k in range(len(ORDER)):
        waiting |= np.uint64(0 if k < 3 else LENGTH_BITS) << np.uint64(bits)  # the first three would repeat lengths
        at, waiting, bits = send(out, at, waiting, bits + 3)
    for s in range(SYMBOLS + 1):
        length = codes[U(s)] & 255 if s < SYMBOLS else 1
        waiting |= np.uint64(_turned(length, LENGTH_BITS)) << np.uint64(bits)
        at, waiting, bits = send(out, at, waiting, bits + LENGTH_BITS)
    return at, waiting, bits


@inner
def _append(code, waiting, bits):
    """Append the bits of a code to the pending bits."""
    return waiting | np.uint64(code >> 8) << np.uint64(bits), bits + (code & 255)


@inner
def _put(code, out, at, waiting, bits):
    """Send a code."""
    waiting, bits = _append(code, waiting, bits)
    return send(out, at, waiting, bits)
