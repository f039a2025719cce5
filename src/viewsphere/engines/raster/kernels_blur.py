"""The motion of visible points during the exposure, and pictures smeared along it."""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from viewsphere.kernels.jit import inner, njit

f4 = nb.float32
U = nb.uintp
TILE = 16  # pixels: limit of a way's length
SHORTEST = 0.25  # square pixels: squared length above which a way counts
STEP, LEAST, MOST = 2.0, 4, 16  # pixels between samples along a way, and the number of samples
GLINT = 3.0  # maximum brightness of a single pixel, relative to the second brightest pixel around
ALIKE = 0.25  # squared share by which a way may differ from that of a pixel with the same motion


@njit
def carry(rays, inverse_depth, triangle, owner, moves, points):
    """Fill points (H, W, 3) float64: the camera axes, up to a positive factor, of each pixel's point at another moment.

    rays (H, W, 3) and inverse_depth (H, W): as in `raster.visibility`; owner (T,) int32: for each triangle, its row in moves
    (M, 3, 4), which map camera axes now to camera axes then; the last row is for the sky.
    """
    for i in range(U(triangle.shape[0])):
        for j in range(U(triangle.shape[1])):
            t = triangle[i, j]
            m = moves[U(owner[U(t)])] if t >= 0 else moves[U(moves.shape[0] - 1)]
            x, y, z, q = rays[i, j, U(0)], rays[i, j, U(1)], rays[i, j, U(2)], np.float64(inverse_depth[i, j])
            for k in range(U(3)):
                points[i, j, k] = m[k, U(0)] * x + m[k, U(1)] * y + m[k, U(2)] * z + m[k, U(3)] * q


@inner
def _is_alike(way, row, column, u, v):
    """Return whether a pixel's motion is about (u, v)."""
    p, q = way[row, column, 0] - u, way[row, column, 1] - v
    return p * p + q * q <= f4(ALIKE) * (u * u + v * v)


@njit(_nrt=True)
def find_longest(way, tiles):
    """Fill tiles (m, n, 2) with the longest way (H, W, 2) among the pixels of each square of TILE x TILE and of its
    neighbours.
    """
    own = np.zeros_like(tiles)
    for y in range(way.shape[0]):
        for x in range(way.shape[1]):
            u, v = way[y, x, 0], way[y, x, 1]
            p, q = own[y // TILE, x // TILE, 0], own[y // TILE, x // TILE, 1]
            if u * u + v * v > p * p + q * q:
                own[y // TILE, x // TILE, 0], own[y // TILE, x // TILE, 1] = u, v
    for i in range(tiles.shape[0]):
        for j in range(tiles.shape[1]):
            tiles[i, j, 0], tiles[i, j, 1] = f4(0), f4(0)
            for row in range(max(i - 1, 0), min(i + 2, tiles.shape[0])):
                for column in range(max(j - 1, 0), min(j + 2, tiles.shape[1])):
                    u, v = own[row, column, 0], own[row, column, 1]
                    if u * u + v * v > tiles[i, j, 0] ** 2 + tiles[i, j, 1] ** 2:
                        tiles[i, j, 0], tiles[i, j, 1] = u, v


@inner
def _brightest(picture, y, x):
    """The second brightest value among the neighbours of a pixel, by their brightest channels; on a line, it is as bright as
    the line.
    """
    first, second = f4(0), f4(0)
    for k in range(9):
        row, column = y + k // 3 - 1, x + k % 3 - 1
        if k == 4 or row < 0 or column < 0 or row >= picture.shape[0] or column >= picture.shape[1]:
            continue
        level = max(picture[row, column, 0], picture[row, column, 1], picture[row, column, 2])
        second = max(second, min(first, level))
        first = max(first, level)
    return second


@njit
def calm(picture, out):
    """Copy a picture (H, W, 4), with isolated bright pixels dimmed: the mean of a few pictures would show each of them as a
    dot.
    """
    for y in range(picture.shape[0]):
        for x in range(picture.shape[1]):
            level = max(picture[y, x, 0], picture[y, x, 1], picture[y, x, 2])
            scale = f4(1)
            if level > 0:
                scale = min(f4(GLINT) * _brightest(picture, y, x) / level, f4(1))
            for c in range(3):
                out[y, x, c] = picture[y, x, c] * scale
            out[y, x, 3] = picture[y, x, 3]


@inner
def _along(s, y, x, u, v, height, width):
    """The place reached after a share of a way from a pixel, clamped to the picture."""
    return min(max(f4(y) + s * v, f4(0)), f4(height - 1)), min(max(f4(x) + s * u, f4(0)), f4(width - 1))


@inner
def _add(picture, row, column, share, total, y, x):
    """Add a share of the picture's light, interpolated between pixels, to a pixel of `total`."""
    height, width = picture.shape[0], picture.shape[1]
    i, j = max(min(int(column), width - 2), 0), max(min(int(row), height - 2), 0)
    p, q = column - f4(i), row - f4(j)
    right, below = min(i + 1, width - 1), min(j + 1, height - 1)
    for c in range(4):
        upper = picture[j, i, c] + p * (picture[j, right, c] - picture[j, i, c])
        lower = picture[below, i, c] + p * (picture[below, right, c] - picture[below, i, c])
        total[y, x, c] += share * (upper + q * (lower - upper))


@njit
def smear(picture, calmed, way, tiles, inverse_depth, total):
    """Add a picture (H, W, 4) to `total`, with each pixel averaged along its way (H, W, 2), which it is in the middle of, and
    over surfaces that pass in front.

    The way of passing surfaces is the longest nearby (`find_longest`). The picture is the one that `calm` returns, but pixels
    that nothing passes are unchanged. Surfaces that move behind another one do not receive its light.
    """
    height, width = picture.shape[0], picture.shape[1]
    for y in range(height):
        for x in range(width):
            u, v = way[y, x, 0], way[y, x, 1]
            a, b = tiles[y // TILE, x // TILE, 0], tiles[y // TILE, x // TILE, 1]
            longest = a * a + b * b
            if longest < f4(SHORTEST):
                for c in range(4):
                    total[y, x, c] += picture[y, x, c]
                continue
            moves, is_passed = u * u + v * v >= f4(SHORTEST), not _is_alike(way, y, x, a, b)
            taps = min(max(math.ceil(math.sqrt(longest) / STEP), LEAST), MOST)
            passing = 0
            for k in range(taps):
                s = (f4(k) + f4(0.5)) / f4(taps) - f4(0.5)
                row, column = f4(y), f4(x)
                if is_passed:
                    row, column = _along(s, y, x, a, b, height, width)
                    i, j = int(row + f4(0.5)), int(column + f4(0.5))
                    if _is_alike(way, i, j, a, b) and inverse_depth[i, j] > inverse_depth[y, x]:
                        _add(calmed, row, column, f4(1) / f4(taps), total, y, x)
                        passing += 1
                        continue
                    row, column = f4(y), f4(x)
                if not moves:
                    continue
                row, column = _along(s, y, x, u, v, height, width)
                i, j = int(row + f4(0.5)), int(column + f4(0.5))
                if inverse_depth[i, j] > inverse_depth[y, x] and not _is_alike(way, i, j, u, v):
                    row, column = f4(y), f4(x)
                _add(calmed, row, column, f4(1) / f4(taps), total, y, x)
            if not moves:
                for c in range(4):
                    total[y, x, c] += picture[y, x, c] * (f4(taps - passing) / f4(taps))
