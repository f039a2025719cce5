"""The choice of pixels to redraw with several points each, and their data so far; `kernels_samples` redraws them.

Chosen pixels are numbered row by row. `grid` (H, W) int32 holds the number of a chosen pixel. For any other pixel it holds
~k, where k is the number of the next chosen pixel. So a triangle finds all pixels of a row that it may cover at once.
`pixels` ends with a sentinel.
"""

from __future__ import annotations

from typing import Any

import numba as nb
import numpy as np
from llvmlite import ir

from viewsphere.kernels.jit import inner, njit
from viewsphere.kernels.lanes import LANES, Lanes, Rows, lanewise, size, store

f4 = nb.float32
U = nb.uintp
BYTES = ir.VectorType(ir.IntType(8), LANES)
ALIKE = 0.94  # cosine of the greatest angle, 20 degrees, between the planes of two pixels that count as one surface
LEVEL = 1.01  # greatest ratio of such a surface's depths in neighbouring pixels
VISIBLE = f4(0.05)  # relative difference of radiance: about five steps of 8 bits
SHARP = f4(0.2)  # likewise within glass: such steps are borders of refracted things, finer than textures behind the glass
DARK = f4(0.02)  # radiance below which differences are compared with this radiance
SPAN = 64  # pixels that are compared at once
TILE = 8  # pixels of a tile's side
CLOSED = np.int32(2**31 - 1)


@njit
def compare(triangle, depth, owner, normals, room, owners, beside, above):
    """Set flags in beside, above (H * W + 8,) uint8 for each pixel that shows another surface than its left neighbour (column 0
    is arbitrary), or than its neighbour above (from the second row on).

    owner (T,) int32: equal for neighbouring triangles that look alike; normals (T, 3). room (8, W + 16) float32 and owners (4,
    W + 16) int32 hold the data of this row and the previous one: normals (arbitrary if nothing is visible) and depth, owner (-1
    if nothing is visible) and triangle.
    """
    height, width = triangle.shape
    a, b, c, d, eight = U(0), U(1), U(2), U(3), U(8)
    stride = U(room.shape[1])
    reals, wholes = room.reshape(-1), owners.reshape(-1)
    first, stop = _borders(triangle, 0)
    for y in range(U(height)):
        begin, end = first, stop
        first, stop = _borders(triangle, y + b) if y + b < U(height) else (U(width), a)
        m, k = (y & b) * U(4), (y & b) * c
        for x in range(max(min(begin, first), b) - b, max(end, stop)):
            t, at = triangle[y, x], x + eight
            u = U(max(t, np.int32(0)))
            room[m, at], room[m + b, at], room[m + c, at] = normals[u, a], normals[u, b], normals[u, c]
            room[m + d, at], owners[k, at], owners[k + b, at] = depth[y, x], owner[u] | (t >> np.int32(31)), t
        here, whole, row = m * stride + eight + begin, k * stride + eight + begin, y * U(width)
        count = np.intp(end) - np.intp(begin)
        _differ(count, reals, here, here - b, wholes, whole, whole - b, stride, beside, row + begin)
        _keep_within(begin, end, row, U(width), beside)
        if y > 0:
            there, other = (U(4) - m) * stride + eight + begin, (c - k) * stride + eight + begin
            _differ(count, reals, here, there, wholes, whole, other, stride, above, row + begin)
            _keep_within(begin, end, row, U(width), above)


@inner
def _borders(triangle, y):
    """Columns [begin, end) beyond which the pixels of a row show the same triangle as the pixels beside and above them; (W, 0)
    if all do.
    """
    width, above = U(triangle.shape[1]), max(np.intp(y) - 1, 0)
    begin, end = U(0), width
    while begin < end and _is_even(triangle, U(y), U(above), begin, min(begin + U(SPAN), width)):
        begin += U(SPAN)
    if begin >= end:
        return width, U(0)
    while end > begin + U(SPAN) and _is_even(triangle, U(y), U(above), end - U(SPAN), end):
        end -= U(SPAN)
    return begin, end


@inner
def _is_even(triangle, y, above, begin, end):
    """Return whether these pixels of a row show the triangle of the pixel beside each, and of that in the row `above`."""
    different = np.int32(0)
    if begin == 0:
        different, begin = triangle[y, begin] ^ triangle[above, begin], U(1)
    for x in range(begin, end):
        own = triangle[y, x]
        different |= (own ^ triangle[y, x - U(1)]) | (own ^ triangle[above, x])
    return different == 0


@inner
def _keep_within(begin, end, row, width, flags):
    """Clear a row's flags outside of columns [begin, end)."""
    for x in range(min(begin, width)):
        flags[row + x] = 0
    for x in range(max(end, U(0)), width):
        flags[row + x] = 0


@lanewise
def _differ(reals: Rows, p: Any, q: Any, wholes: Rows, k: Any, m: Any, stride: Any, flags: Rows, at: Any) -> None:
    """Flag the pixels whose data `compare` has stored at p and k, if they show another surface than the pixels at q and m.

    The surface is the same if owners are equal, and planes and depths differ by less than ALIKE and LEVEL allow.
    """
    to = reals[p,] * reals[q,] + reals[p, stride] * reals[q, stride]
    bend = size(to + reals[p, stride, stride] * reals[q, stride, stride])
    z, far = reals[p, stride, stride, stride], reals[q, stride, stride, stride]
    # One of the two is farther by 1 %.
    apart = (z > far * LEVEL) | (far > z * LEVEL)
    same = wholes[k,].equals(wholes[m,]) & (bend >= ALIKE)
    flag = (same ^ 1 | apart) & (wholes[k, stride].equals(wholes[m, stride]) ^ 1)
    store(flags.data, flags.builder.add(flags.i, at), Lanes(flag.builder, flag.builder.zext(flag.value, BYTES)))


@njit
def compare_behind(slots, behind, behind_depth, triangle, depth, owner, normals, radiance, marks):
    """Mark in marks (H * W,) pairs of neighbours, at least one in `slots`, that look alike in front but differ in a layer
    behind and in colour. If the colours are equal, that layer is hardly visible.

    behind, behind_depth (H * W,): triangle and depth of each pixel in this layer; triangle, depth (H, W): those in front;
    radiance (H * W, 4).
    """
    height, width, one = U(triangle.shape[0]), U(triangle.shape[1]), U(1)
    shown, level = triangle.reshape(-1), depth.reshape(-1)
    for i in range(U(slots.shape[0])):
        p = U(slots[i])
        y, x = p // width, p % width
        sides = (p - one, x > 0), (p + one, x + one < width), (p - width, y > 0), (p + width, y + one < height)
        for q, is_there in sides:
            if not is_there or _passes(behind[p], behind[q], behind_depth[p], behind_depth[q], owner, normals):
                continue
            if _is_step(radiance, p, q, VISIBLE) and _passes(shown[p], shown[q], level[p], level[q], owner, normals):
                marks[p], marks[q] = 1, 1


@njit
def compare_bent(bent, radiance, marks):
    """Mark in marks (H * W,) pairs of neighbours of different colours that both show solid glass: bent (H, W) is not 0."""
    height, width, one = U(bent.shape[0]), U(bent.shape[1]), U(1)
    for y in range(height):
        for x in range(width):
            if bent[y, x] == 0:
                continue
            p = y * width + x
            if x + one < width and bent[y, x + one] != 0 and _is_step(radiance, p, p + one, SHARP):
                marks[p], marks[p + one] = 1, 1
            if y + one < height and bent[y + one, x] != 0 and _is_step(radiance, p, p + width, SHARP):
                marks[p], marks[p + width] = 1, 1


@inner
def _is_step(radiance, p, q, least):
    """Return whether two pixels' colours or alphas differ by more than this share of the greater one."""
    differs = False
    for c in range(U(4)):
        one, other = radiance[p, c], radiance[q, c]
        differs |= abs(one - other) > least * max(one, other, DARK)
    return differs


@inner
def _passes(t, s, depth, other, owner, normals):
    """Return whether two pixels count as the same surface, as in `_differ`."""
    if t == s or t < 0 or s < 0:
        return t == s
    a, b, c, t, s = U(0), U(1), U(2), U(t), U(s)
    bend = normals[t, a] * normals[s, a] + normals[t, b] * normals[s, b] + normals[t, c] * normals[s, c]
    return (owner[t] == owner[s]) & (abs(bend) >= f4(ALIKE)) & (max(depth, other) <= min(depth, other) * f4(LEVEL))


@njit(_nrt=True)
def numbered(marks):
    """The grid of the marked pixels, and their flat indices in order, followed by the sentinel."""
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
def shown_around(triangle, pixels, shown):
    """Set shown (T,) for the triangles (`triangle`, (H, W)) at the chosen pixels and at the pixels around each."""
    height, width = triangle.shape
    for k in range(U(pixels.shape[0] - 1)):
        y, x = pixels[k] // width, pixels[k] % width
        for j in range(U(max(y - 1, 0)), U(min(y + 2, height))):
            for i in range(U(max(x - 1, 0)), U(min(x + 2, width))):
                if triangle[j, i] >= 0:
                    shown[U(triangle[j, i])] = 1


@njit
def level(inverse):
    """A positive 1/z as a 32-bit integer with the same order."""
    return np.float32(inverse).view(np.int32)


@njit(_nrt=True)
def shown_farthest(triangle, depth, pixels, height, width):
    """The `level` of the farthest surface that the points of each pixel show, (H, W) int32: 0 if a point shows nothing, CLOSED
    if a pixel has no points.

    triangle, depth (N, M): for the points of `pixels` (N,), or of all pixels in order if `pixels` is empty.
    """
    farthest = np.full((height, width), CLOSED)
    flat = farthest.reshape(-1)
    for k in range(U(triangle.shape[0])):
        least = CLOSED
        for i in range(U(triangle.shape[1])):
            least = min(least, level(depth[k, i]) if triangle[k, i] >= 0 else np.int32(0))
        flat[U(pixels[k]) if pixels.shape[0] else k] = least
    return farthest


@njit(_nrt=True)
def tiled(farthest):
    """The minimum level in each tile, and the minimum in each tile and its neighbours to the right, below and diagonal. Those
    four contain any box that begins in the tile and is no wider than a tile.
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
