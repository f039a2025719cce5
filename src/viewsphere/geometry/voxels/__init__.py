"""The cells of a grid that a mesh occupies: its surface by exact overlap, and its inside where it is closed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Cells = NDArray[np.int32]
Codes = NDArray[np.uint8]
Rows = NDArray[np.int64]


def touch(points: Float, triangles: NDArray[np.int32], rows: Rows, owner: Cells, filled: Codes, value: int) -> None:
    """Assign each unowned (-1) cell of `owner` (X, Y, Z) to the first of these rows of triangles that overlaps it, and write
    the value to `filled`.

    points (V, 3) are in units of cells. Cells are half-open: a point on the border of two cells belongs to the farther one.
    """
    from viewsphere.geometry.voxels import kernels_voxels as kernels

    kernels.touch(points, triangles, rows, owner, filled, np.uint8(value))


def fill(points: Float, triangles: NDArray[np.int32], rows: Rows, owner: Cells, filled: Codes, value: int) -> None:
    """Assign the unowned cells whose centres are inside closed surfaces made of these rows of triangles, as `touch` does.

    A cell is inside if the winding number is not 0, so parts of an object may overlap.
    """
    from viewsphere.geometry.voxels import kernels_voxels as kernels

    if not len(rows):
        return
    corners = points[triangles[rows]].reshape(-1, 3)
    low = np.clip(np.floor(corners.min(axis=0)), 0, owner.shape).astype(np.int64)
    high = np.clip(np.ceil(corners.max(axis=0)), 0, owner.shape).astype(np.int64)
    if (high <= low).any():
        return
    winding = np.zeros(tuple((high - low).tolist()), np.int32)
    kernels.wind(points - low, triangles, rows, winding)
    kernels.fill(winding, low, np.int32(rows[0]), owner, filled, np.uint8(value))


def heights(points: Float, triangles: NDArray[np.int32], rows: Rows, size: tuple[int, int]) -> tuple[Float, Float]:
    """Return the first and the last crossing of these rows of triangles on each vertical line through the centres of cells, in
    cells.

    The lines are along the middle axis of a grid of this size (ahead, right). Lines without a crossing have inf and -inf.
    """
    from viewsphere.geometry.voxels import kernels_voxels as kernels

    lowest, highest = np.full(size, np.inf), np.full(size, -np.inf)
    kernels.heights(points, triangles, rows, lowest, highest)
    return lowest, highest


def closed(vertices: NDArray[np.float32], triangles: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Return a mask of the triangles (T,) that belong to a closed piece: each edge is used equally often in both directions.

    Vertices at the same place count as one, and shared vertices join triangles into pieces.
    """
    from viewsphere.geometry.voxels import kernels_voxels as kernels

    if not len(triangles):
        return np.zeros(0, np.bool_)
    corners = _welded(vertices)[triangles]
    parent = np.arange(len(vertices))
    kernels.join(parent, corners)
    first, second = corners.reshape(-1), np.roll(corners, -1, axis=1).reshape(-1)
    low, high = np.minimum(first, second), np.maximum(first, second)
    edges, number = np.unique(low * len(vertices) + high, return_inverse=True)
    balance = np.bincount(number, np.sign(second - first), len(edges))
    is_open = np.zeros(len(vertices), np.bool_)
    is_open[parent[edges[balance != 0] // len(vertices)]] = True
    return ~is_open[parent[corners[:, 0]]]


def _welded(vertices: NDArray[np.float32]) -> Rows:
    """The number of each vertex's place, (V,) int64; vertices at the same place share a number."""
    x, y, z = (vertices + np.float32(0)).T  # -0.0 becomes 0.0
    order = np.lexsort((x, y, z))
    places = vertices[order]
    is_new = np.concatenate(([False], (places[1:] != places[:-1]).any(axis=1)))
    out = np.empty(len(vertices), np.int64)
    out[order] = np.cumsum(is_new)
    return out
