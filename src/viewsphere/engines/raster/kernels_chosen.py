"""Which pixels are worth a closer look, and what is known of them before it; `kernels_samples` draws them.

Chosen pixels are numbered row by row. `grid` (H, W) int32 holds a chosen pixel's number, and for any other pixel ~k, k the
number of the next chosen one, so that a triangle finds what it may cover in a row at once; `pixels` ends with a sentinel.
"""

from __future__ import annotations

import numba as nb
import numpy as np

from viewsphere.geometry.jit import njit

f4 = nb.float32
U = nb.uintp
TILE = 8  # pixels of a tile's side
CLOSED = np.int32(2**31 - 1)


@njit
def differing(triangle, depth, owner, normals):
    """Pixels that look different from the one beside, above or below: uint8, one after another, padded to whole words of 8.

    owner (T,) int32: equal where neighbouring triangles look alike; normals (T, 3).
    """
    height, width = triangle.shape
    marks = np.zeros((height * width + 7) // 8 * 8, np.uint8)
    flags = np.empty(width, np.uint8)
    above, here = np.empty((4, width), np.float32), np.empty((4, width), np.float32)
    one = U(1)
    for y in range(U(height)):
        _gather_row(triangle[y], owner, normals, here)
        row = marks[y * U(width) : (y + one) * U(width)]
        for k in range(U(2)):  # beside, above
            if k > y:
                continue
            other, shift = y - k, one - k
            _compare_rows(triangle[y], triangle[other], depth[y], depth[other], here, above if k else here, shift, flags)
            last = marks[other * U(width) : (other + one) * U(width)]
            for x in range(shift, U(width)):
                row[x] |= flags[x]
            for x in range(shift, U(width)):
                last[x - shift] |= flags[x]
        above, here = here, above
    return marks


@njit
def _gather_row(triangle, owner, normals, out):
    """Normal (any, where none) and owner (bits; -1, where none) of what a row shows."""
    a, b, c = U(0), U(1), U(2)
    owners = out[3].view(np.int32)
    for x in range(U(triangle.shape[0])):
        t = triangle[x]
        u = U(max(t, np.int32(0)))
        out[a, x], out[b, x], out[c, x] = normals[u, a], normals[u, b], normals[u, c]
        owners[x] = owner[u] | (t >> np.int32(31))


@njit
def _compare_rows(t, s, p, q, n, m, shift, flags):
    """Which pixels of one row show another surface than those of another, or than those `shift` to the left.

    It is the same if owners are, the planes differ by less than 20 degrees, and the depths by less than 1 %.
    """
    a, b, c = U(0), U(1), U(2)
    o, w = n[3].view(np.int32), m[3].view(np.int32)
    for x in range(shift, U(t.shape[0])):
        v = x - shift
        bend = abs(n[a, x] * m[a, v] + n[b, x] * m[b, v] + n[c, x] * m[c, v])
        far = max(p[x], q[v]) > min(p[x], q[v]) * f4(1.01)
        flags[x] = (t[x] != s[v]) & ((o[x] != w[v]) | (bend < f4(0.94)) | far)


@njit
def numbered(marks):
    """The grid of the marked pixels, and their flat indices behind one another with the sentinel."""
    height, width = marks.shape
    total = 0
    for y in range(height):
        for x in range(width):
            total += marks[y, x] != 0
    grid, pixels = np.empty((height, width), np.int32), np.empty(total + 1, np.int32)
    k = np.int32(0)
    for y in range(U(height)):
        for x in range(U(width)):
            chosen = marks[y, x] != 0
            grid[y, x] = k if chosen else ~k
            pixels[U(k)] = y * U(width) + x
            k += np.int32(chosen)
    pixels[total] = CLOSED
    return grid, pixels


@njit
def level(inverse):
    """A number of 32 bits that orders positive 1/z."""
    return np.float32(inverse).view(np.int32)


@njit
def shown_farthest(triangle, depth, pixels, height, width):
    """Level of the farthest surface that the points of each pixel show, (H, W) int32; CLOSED where they show none.

    triangle, depth (N, M): of the points of `pixels` (N,), or of all pixels in order if that is empty.
    """
    farthest = np.full((height, width), CLOSED)
    flat = farthest.reshape(-1)
    for k in range(U(triangle.shape[0])):
        least = CLOSED
        for i in range(U(triangle.shape[1])):
            least = min(least, level(depth[k, i]) if triangle[k, i] >= 0 else CLOSED)
        flat[U(pixels[k]) if pixels.shape[0] else k] = least
    return farthest


@njit
def tiled(farthest):
    """Least level in each tile, and in each with its neighbours to the right and below: whatever box begins in a tile and is no
    wider is there.
    """
    height, width = farthest.shape
    rows, columns = height // TILE + 1, width // TILE + 1
    tiles = np.full((rows + 1, columns + 1), CLOSED)
    line = np.empty(columns * TILE, np.int32)
    for row in range(rows):
        line[:] = CLOSED
        for y in range(row * TILE, min(row * TILE + TILE, height)):
            for x in range(width):
                line[x] = min(line[x], farthest[y, x])
        for column in range(columns):
            least = CLOSED
            for i in range(TILE):
                least = min(least, line[column * TILE + i])
            tiles[row, column] = least
    around = np.full((rows, columns), CLOSED)
    for row in range(rows):
        for column in range(columns):
            around[row, column] = tiles[row : row + 2, column : column + 2].min()
    return tiles, around
