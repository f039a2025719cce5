"""Pixels that show another surface than a neighbour, for pictures with and without large even areas."""

from __future__ import annotations

import numpy as np
import pytest

from viewsphere.engines.raster.antialiasing.kernels_chosen import ALIKE, LEVEL, compare

TRIANGLES = 40


def picture(height, width, rng, even):
    """Random triangles and depths (H, W); all but a rectangle shows one triangle, or none, if `even`."""
    triangle = rng.integers(-1, TRIANGLES, (height, width)).astype(np.int32)
    depth = rng.choice([1.0, 1.004, 1.02], (height, width)).astype(np.float32)
    if even:
        inside = np.zeros((height, width), np.bool_)
        y, x = sorted(rng.integers(0, height + 1, 2)), sorted(rng.integers(0, width + 1, 2))
        inside[slice(*y), slice(*x)] = True
        triangle[~inside] = rng.integers(-1, TRIANGLES)
    return triangle, depth


def differs(one, other, owner, normals):
    """The definition: owner, plane or depth differ, and not both show the same triangle or none."""
    (t, z), (s, w) = one, other
    bend = np.abs((normals[t] * normals[s]).sum(axis=-1))
    apart = (z > w * np.float32(LEVEL)) | (w > z * np.float32(LEVEL))
    other_owner = np.where(t < 0, -1, owner[t]) != np.where(s < 0, -1, owner[s])
    return (t != s) & (other_owner | (bend < ALIKE) | apart)


@pytest.mark.parametrize("even", [False, True])
@pytest.mark.parametrize("size", [(1, 1), (1, 200), (7, 3), (12, 64), (9, 65), (30, 333)])
def test_flags_of_random_pictures(size, even):
    rng = np.random.default_rng((*size, even))
    owner = rng.integers(0, 4, TRIANGLES).astype(np.int32)
    normals = np.eye(3, dtype=np.float32)[rng.integers(0, 3, TRIANGLES)]
    for _ in range(20):
        (triangle, depth), (height, width) = picture(*size, rng, even), size
        beside, above = np.full((2, height * width + 8), 7, np.uint8)
        room, owners = np.zeros((8, width + 16), np.float32), np.zeros((4, width + 16), np.int32)
        compare(triangle, depth, owner, normals, room, owners, beside, above)
        left, right = (triangle[:, :-1], depth[:, :-1]), (triangle[:, 1:], depth[:, 1:])
        top, bottom = (triangle[:-1], depth[:-1]), (triangle[1:], depth[1:])
        flags = beside[: height * width].reshape(size)[:, 1:], above[: height * width].reshape(size)[1:]
        for found, pair in zip(flags, ((right, left), (bottom, top)), strict=True):
            seen = (pair[0][0] >= 0) & (pair[1][0] >= 0) | (pair[0][0] != pair[1][0])
            assert np.array_equal(found[seen] != 0, differs(*pair, owner, normals)[seen])
