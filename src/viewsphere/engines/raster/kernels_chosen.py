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
def looks_alike(t, s, a, b, owner, normals):
    """Whether triangles t and s (-1: none), seen at inverse depths a and b, may be taken for one surface."""
    if t == s:
        return True
    if t < 0 or s < 0 or owner[U(t)] != owner[U(s)]:
        return False
    x, y, z = U(0), U(1), U(2)
    t, s = U(t), U(s)
    bend = abs(normals[t, x] * normals[s, x] + normals[t, y] * normals[s, y] + normals[t, z] * normals[s, z])
    return (bend >= f4(0.94)) & (max(a, b) <= min(a, b) * f4(1.01))


@njit
def differing(triangle, depth, owner, normals):
    """Pixels that look different from the one beside, above or below, (H, W) uint8.

    owner (T,) int32: equal where neighbouring triangles look alike; normals (T, 3).
    """
    height, width = triangle.shape
    marks = np.zeros((height, width), np.uint8)
    one = U(1)
    for y in range(U(height)):
        for x in range(U(width)):
            t = triangle[y, x]
            if x > 0 and triangle[y, x - one] != t:
                s = triangle[y, x - one]
                if not looks_alike(t, s, depth[y, x], depth[y, x - one], owner, normals):
                    marks[y, x] = marks[y, x - one] = 1
            if y > 0 and triangle[y - one, x] != t:
                s = triangle[y - one, x]
                if not looks_alike(t, s, depth[y, x], depth[y - one, x], owner, normals):
                    marks[y, x] = marks[y - one, x] = 1
    return marks


@njit
def front_first(triangle, grid, pixels, count):
    """All triangles, those that the chosen pixels and the pixels beside them show before the others."""
    height, width = grid.shape
    wanted = np.zeros(count + 1, np.uint8)
    for k in range(len(pixels) - 1):
        y, x = pixels[k] // width, pixels[k] % width
        wanted[triangle[y, x]] = 1
        wanted[triangle[max(y - 1, 0), x]] = 1
        wanted[triangle[min(y + 1, height - 1), x]] = 1
        wanted[triangle[y, max(x - 1, 0)]] = 1
        wanted[triangle[y, min(x + 1, width - 1)]] = 1
    order = np.empty(count + 1, np.int32)
    n = 0
    for value in (1, 0):
        for t in range(count):
            order[n] = t
            n += wanted[t] == value
    return order[:count]


@njit
def numbered(marks):
    """The grid of the marked pixels, and their flat indices behind one another with the sentinel."""
    height, width = marks.shape
    grid = np.empty((height, width), np.int32)
    count = np.int32(0)
    for y in range(height):
        for x in range(width):
            chosen = marks[y, x] != 0
            grid[y, x] = count if chosen else ~count
            count += np.int32(chosen)
    pixels = np.empty(count + 1, np.int32)
    pixels[count] = CLOSED
    for y in range(height):
        for x in range(width):
            if grid[y, x] >= 0:
                pixels[grid[y, x]] = y * width + x
    return grid, pixels


@njit
def level(inverse):
    """A number of 32 bits that orders positive 1/z."""
    return np.float32(inverse).view(np.int32)


@njit
def bounded(depth, marks):
    """Where to begin: `farthest` of the marked pixels as if each point showed what the centres around it show or something
    nearer, of the others a little nearer than what they show.

    What is drawn farther than that at a marked pixel, or nearer at another, has to be drawn again from nothing.
    """
    height, width = depth.shape
    farthest = np.empty((height, width), np.int32)
    for y in range(height):
        for x in range(width):
            farthest[y, x] = level(depth[y, x] * f4(1.01))
    for y in range(height):
        for x in range(width):
            if marks[y, x]:
                least = depth[y, x]
                for j in range(max(y - 1, 0), min(y + 2, height)):
                    for i in range(max(x - 1, 0), min(x + 2, width)):
                        least = min(least, depth[j, i])
                farthest[y, x] = level(least)
    return farthest


@njit
def closed(marks):
    """`farthest` where nothing is known of the marked pixels and the others do not matter."""
    height, width = marks.shape
    farthest = np.empty((height, width), np.int32)
    for y in range(height):
        for x in range(width):
            farthest[y, x] = np.int32(0) if marks[y, x] else CLOSED
    return farthest


@njit
def undecided(grid, nearest, bound, missed):
    """Marks of the pixels for which `bounded` was wrong: some point shows something farther, or a surface was missed."""
    height, width = grid.shape
    marks = missed.copy()
    for y in range(height):
        for x in range(width):
            k = grid[y, x]
            if k >= 0:
                for i in range(nearest.shape[1]):
                    marks[y, x] |= level(nearest[k, i]) < bound[y, x]
    return marks


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


@njit
def distinct(pixels, triangle, depth, samples, inverses, owner, normals):
    """Which of these pixels look different at some sample than at their centre, (E,) bool.

    triangle, depth (H * W,) at the centres; samples, inverses (E, 4) at the samples.
    """
    out = np.zeros(len(pixels), np.bool_)
    for k in range(len(pixels)):
        p = U(pixels[k])
        for i in range(4):
            if not looks_alike(triangle[p], samples[k, i], depth[p], f4(inverses[k, i]), owner, normals):
                out[k] = True
                break
    return out
