"""Charts of flat, still surfaces, and the nodes on them that gather light: walls, floors, table tops, doors, facades.

Probes are some distance from a wall, and read light that falls off with distance along straight lines. A wall's own rays avoid
both.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.raster.indirect.directions import domes
from viewsphere.engines.raster.lightmaps import kernels_lightmap as kernels
from viewsphere.engines.raster.records import Float32, Int32

Float = NDArray[np.float64]

CELL, MOST = 0.1, 64_000
"""Minimum distance between nodes in metres, and maximum number of nodes."""

LEAST, NARROW = 0.05, 0.05
"""Minimum area of a chart in square metres, and its minimum width in metres: twice its area divided by the length of its
border.
"""

ROOM = 1 << 25
"""Maximum number of rays of all nodes, each of which takes twelve bytes. A direction counts as four rays, because charts that
face many ways need many directions.
"""

TURNS = 4
"""Square root of the number of rotations of a node's rays: any four by four nodes have all of them."""

PLANES, APART = 400.0, 0.004
"""Resolution at which normals of one chart are equal, in steps per length; step in metres at which the planes of its triangles
are equal.
"""

SAME = 1e-3
"""Step in metres at which corners count as equal."""

NEAR = 2.0
"""Maximum squared distance, in cells, between a node that is read and its chart."""

INSET, OFF = 0.05, 1e-3
"""Distance of the nodes' ray origins from a chart's border, in cells, and off the surface."""


@dataclass(frozen=True, eq=False)
class _Chart:
    """Triangles (T,) of one plane, in axes (3, 3): along both axes and the normal."""

    triangles: NDArray[np.int64]
    axes: Float


@dataclass(frozen=True, eq=False)
class Charts:
    """The part of the lightmaps that depends on no light.

    charts, chart: see `Lightmap`, for the bounce scene's own triangles. origins (N, 3), turn (N,): those of the nodes' rays in
    directions (W, K, 3), which are `local` (R, K, 3) in axes (W, 3, 3) of the charts. reached (N,): whether the node is near
    the chart's triangles, so that some point reads it.
    """

    charts: Float32
    chart: Int32
    origins: Float32
    turn: Int32
    directions: Float32
    local: Float32
    axes: Float32
    reached: NDArray[np.bool_]
    cell: float


def charts_of(corners: Float32, unit: float, rays: int) -> Charts | None:
    """The charts of triangles (T, 3, 3) in a stage of `unit` metres, None if there are none. rays: maximum number of rays per
    node.
    """
    places = corners.astype(np.float64)
    charts = [piece for chart in _planes(places, unit) for piece in _pieces(chart, places, unit)]
    if not charts:
        return None
    boxes = np.array([_box(piece, places) for piece in charts])
    cells = unit / CELL
    while (size := _nodes(boxes, cells)[1].prod(axis=1)).sum() > max(MOST, 4 * len(charts)):
        cells *= 0.95
    return _settled(charts, *_nodes(boxes, cells), size, places, cells, rays)


def _nodes(boxes: Float, cells: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The first node of each chart in boxes (C, 2, 2), and the numbers of its nodes along both axes, (C, 2)."""
    low, high = np.floor(boxes[:, 0] * cells), np.ceil(boxes[:, 1] * cells)
    return low.astype(np.int64), (np.maximum(high - low, 1) + 1).astype(np.int64)


def has_planes(corners: Float32, unit: float) -> bool:
    """Return whether some of these triangles (T, 3, 3) form a plane that is wide enough for a chart."""
    return next(_planes(corners.astype(np.float64), unit), None) is not None


def _planes(corners: Float, unit: float) -> Iterator[_Chart]:
    """Yield the triangles of each plane that is large enough, as a chart."""
    a, b, c = corners.transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    area = np.sqrt((normals * normals).sum(axis=1)) * (unit * unit / 2)
    normals /= np.maximum(np.sqrt((normals * normals).sum(axis=1, keepdims=True)), 1e-300)
    offsets = (normals * a).sum(axis=1) * (unit / APART)
    steps = np.column_stack([np.rint(normals * PLANES), np.rint(offsets)])
    solid = np.flatnonzero((area > 0) & np.isfinite(steps).all(axis=1))
    steps = steps[solid].astype(np.int64)
    keys = steps @ np.array([1, 1 << 12, 1 << 24, 1 << 36], np.int64)  # wide enough for planes of a thousand kilometres
    _, first, plane = np.unique(keys, return_index=True, return_inverse=True)
    wide = np.bincount(plane, area[solid]) >= LEAST
    order = np.argsort(plane, kind="stable")
    stops = np.cumsum(np.bincount(plane))
    for k in np.flatnonzero(wide).tolist():
        own = solid[order[stops[k - 1] if k else 0 : stops[k]]]
        yield _Chart(own, _axes(normals[solid[first[k]]]))


def _axes(normal: Float) -> Float:
    """Axes (3, 3) of a plane, the normal last; the first axis is horizontal unless the plane is."""
    across = np.cross([0.0, 0.0, 1.0] if abs(normal[2]) < 0.9 else [0.0, 1.0, 0.0], normal)
    across /= math.sqrt(float(across @ across))
    return np.stack([across, np.cross(normal, across), normal])


def _pieces(chart: _Chart, corners: Float, unit: float) -> Iterator[_Chart]:
    """The chart's parts that are connected by common corners, if they are wide. Surfaces beyond a wall have light of their own,
    and half of a narrow strip may be inside a wall.
    """
    flat = corners[chart.triangles] @ chart.axes[:2].T * unit
    steps = np.rint(flat.reshape(-1, 2) / SAME).astype(np.int64)
    _, corner = np.unique(steps @ np.array([1, 1 << 31]), return_inverse=True)
    piece = kernels.pieces(corner.reshape(-1, 3), int(corner.max()) + 1)
    a, b, c = flat.transpose(1, 0, 2)
    (ux, uy), (vx, vy) = (b - a).T, (c - a).T
    area = np.bincount(piece, np.abs(ux * vy - uy * vx) / 2)
    around = np.bincount(piece, _borders(corner.reshape(-1, 3), flat), len(area))
    for k in np.flatnonzero((area >= LEAST) & (2 * area >= NARROW * around)).tolist():
        yield _Chart(chart.triangles[piece == k], chart.axes)


def _borders(corner: NDArray[np.int64], flat: Float) -> Float:
    """Return the length of each triangle's edges, (T,), that it shares with no other.

    corner (T, 3): the numbers of its corners.
    """
    a, b = corner, np.roll(corner, -1, axis=1)
    edges = np.minimum(a, b) * (corner.max() + 1) + np.maximum(a, b)
    _, which, counts = np.unique(edges, return_inverse=True, return_counts=True)
    length = np.sqrt(((np.roll(flat, -1, axis=1) - flat) ** 2).sum(axis=2))
    return (length * (counts[which.reshape(edges.shape)] == 1)).sum(axis=1)


def _box(chart: _Chart, corners: Float) -> Float:
    """The chart's lowest and highest places along both axes, (2, 2)."""
    flat = (corners[chart.triangles] @ chart.axes[:2].T).reshape(-1, 2)
    return np.stack([flat.min(axis=0), flat.max(axis=0)])


def _settled(
    found: list[_Chart],
    lows: NDArray[np.int64],
    wide: NDArray[np.int64],
    counts: NDArray[np.int64],
    corners: Float,
    cells: float,
    rays: int,
) -> Charts:
    firsts = np.cumsum(counts) - counts
    charts, chart = np.zeros((len(found), kernels.CHART), np.float64), np.full(len(corners), -1, np.int32)
    flat = np.empty((sum(len(piece.triangles) for piece in found), 3, 2))
    which, done = np.empty(len(flat), np.int64), 0
    for k, (piece, low) in enumerate(zip(found, lows, strict=True)):
        own = charts[k]
        for axis in range(2):
            own[4 * axis : 4 * axis + 4] = [*(piece.axes[axis] * cells), -low[axis]]
        own[kernels.NORMAL : kernels.NORMAL + 3] = piece.axes[2]
        own[kernels.FIRST], (own[kernels.WIDE], own[kernels.HIGH]) = firsts[k], wide[k]
        chart[piece.triangles] = k
        at = slice(done, done + len(piece.triangles))
        flat[at], which[at], done = corners[piece.triangles] @ piece.axes[:2].T * cells - low, k, at.stop
    total = int(counts.sum())
    places, distances = np.zeros((total, 2)), np.full(total, np.inf)
    kernels.settle(flat, which, charts, INSET, places, distances)
    ways, orientation = np.unique(np.rint(charts[:, kernels.NORMAL : kernels.NORMAL + 3] * PLANES), axis=0, return_inverse=True)
    rays = max(1, min(rays, ROOM // max(total, 4 * TURNS * TURNS * len(ways))))
    axes = np.empty((len(ways), 3, 3))
    own_axes = np.array([piece.axes for piece in found])
    axes[orientation] = own_axes
    own = np.repeat(np.arange(len(found)), counts)
    offsets = np.array([float(corners[piece.triangles[0], 0] @ piece.axes[2]) for piece in found])
    flat_places = np.column_stack([(places + lows[own]) / cells, offsets[own] + OFF / cells])
    origins = (flat_places[:, None, :] @ own_axes[own])[:, 0]
    at = np.arange(total) - firsts[own]
    turn = at % wide[own, 0] % TURNS + TURNS * (at // wide[own, 0] % TURNS)
    local = domes(rays, TURNS * TURNS)
    directions = np.einsum("rkc,wcd->wrkd", local, axes).reshape(-1, rays, 3)
    return Charts(
        charts.astype(np.float32),
        chart,
        origins.astype(np.float32),
        (orientation.reshape(-1)[own] * TURNS * TURNS + turn).astype(np.int32),
        np.ascontiguousarray(directions, np.float32),
        local.astype(np.float32),
        np.repeat(axes, TURNS * TURNS, axis=0).astype(np.float32),
        distances < NEAR,
        1 / cells,
    )
