"""Rays through triangles, for data that is baked once: see `kernels_trace`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.raster.records import Float32, Int32
from viewsphere.engines.raster.reflections import kernels_trace as kernels


class Tree(NamedTuple):
    """Boxes around triangles: eight to a node, eight triangles to a leaf, to fit vector registers.

    bounds (N, 6 * 8) float32: the lowest x of all of a node's children, then y, z and the highest, infinite for missing
    children; links (N, 8) int32: each child's node, or -1 - k for leaf k; corners (L, 9 * 8) float32: the first corner's x, y,
    z and both edges of a leaf's triangles; order (L * 8,) int32: the number of the triangle in each place, some of them twice.
    """

    bounds: Float32
    links: Int32
    corners: Float32
    order: Int32


def tree_of(corners: Float32) -> Tree:
    """The tree of triangles (T, 3, 3), at least one; no ray hits a triangle with a corner that is not finite."""
    corners = np.where(np.isfinite(corners).all(axis=(1, 2), keepdims=True), corners, np.float32(0)).astype(np.float32)
    boxes = np.concatenate([corners.min(axis=1), corners.max(axis=1)], axis=1)
    order = np.arange(len(corners), dtype=np.int32)
    bounds, links = np.empty((2 * len(corners), 6), np.float32), np.empty((2 * len(corners), 2), np.int32)
    count = kernels.build(boxes, order, bounds, links)
    leaves = int(np.count_nonzero(links[:count, 1]))
    a, b, c = corners.transpose(1, 0, 2)
    wide = kernels.WIDE
    tree = Tree(
        np.empty((leaves, 6 * wide), np.float32),
        np.empty((leaves, wide), np.int32),
        np.empty((leaves, 9 * wide), np.float32),
        np.empty(leaves * wide, np.int32),
    )
    nodes = kernels.widen(bounds, links, order, np.concatenate([a, b - a, c - a], axis=1), tree)
    return tree._replace(bounds=tree.bounds[:nodes].copy(), links=tree.links[:nodes].copy())


def cast(tree: Tree, origins: Float32, directions: Float32, turn: Int32, limit: float) -> tuple[Int32, Float32]:
    """Return the first hit of each ray, as triangle (K, N) int32, -1 for nothing before `limit`, and distance (K, N).

    Rays start at all origins (N, 3), in the K directions (W, K, 3) of each origin's `turn` (N,).
    """
    shape = directions.shape[1], len(origins)
    met, far = np.empty(shape, np.int32), np.empty(shape, np.float32)
    kernels.cast(tree, origins, directions, turn, np.float32(limit), met, far)
    found = met >= 0
    met[found] = tree.order[met[found]]
    return met, far


def unblocked(tree: Tree, origins: Float32, ways: Float32) -> NDArray[np.float32]:
    """1 if nothing is between an origin (N, 3) and origin + way (N, 3), otherwise 0."""
    clear = np.empty(len(origins), np.float32)
    kernels.unblocked(tree, origins, ways, clear)
    return clear
