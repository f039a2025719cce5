"""Rows of a Radiance picture: plain, or run-length encoded the old way or the new."""

from __future__ import annotations

import numpy as np

from viewsphere.kernels.jit import inner, njit


@njit
def decode_rows(data, row, out):
    """Decode the undamaged rows of a picture's bytes into out (rows, columns, 3) float32, zeroed by the caller; return their
    number.

    row (columns, 4) uint8 is scratch for one row. The caller allocates out, so that rows missing from a truncated file take no
    memory.
    """
    rows, columns = out.shape[:2]
    at = 0
    for i in range(rows):
        is_new = at + 4 <= data.shape[0] and data[at] == 2 and data[at + 1] == 2 and data[at + 2] < 128
        if is_new and 8 <= columns < 32768:
            at = _new_row(data, at, row) if (np.int64(data[at + 2]) << 8) + data[at + 3] == columns else -1
        else:
            at = _old_row(data, at, row)
        if at < 0:
            return i
        for j in range(columns):
            if row[j, 3] > 0:
                scale = 2.0 ** (np.float64(row[j, 3]) - 136.0)
                for c in range(3):
                    out[i, j, c] = (np.float64(row[j, c]) + 0.5) * scale
    return rows


@inner
def _new_row(data, at, row):
    """Decode a row in the new encoding; return the offset of the next row, or -1 if this row is damaged."""
    at += 4
    for c in range(4):
        j = 0
        while j < row.shape[0]:
            if at + 2 > data.shape[0]:
                return -1
            count = np.int64(data[at])
            at += 1
            is_run = count > 128
            count = count - 128 if is_run else count
            if count == 0 or j + count > row.shape[0] or at + (1 if is_run else count) > data.shape[0]:
                return -1
            for k in range(count):
                row[j + k, c] = data[at if is_run else at + k]
            at += 1 if is_run else count
            j += count
    return at


@inner
def _old_row(data, at, row):
    """The equivalent of `_new_row` for the old encoding: (1, 1, 1, n) repeats the texel before n times, the next one n times
    256, ...
    """
    j, shift = 0, 0
    while j < row.shape[0]:
        if at + 4 > data.shape[0]:
            return -1
        if data[at] == 1 and data[at + 1] == 1 and data[at + 2] == 1:
            count = np.int64(data[at + 3]) << shift
            if j == 0 or j + count > row.shape[0] or shift > 16:
                return -1
            for _ in range(count):
                for c in range(4):
                    row[j, c] = row[j - 1, c]
                j += 1
            shift += 8
        else:
            for c in range(4):
                row[j, c] = data[at + c]
            j += 1
            shift = 0
        at += 4
    return at
