"""A model's surface for distance measurements, and points that represent it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from viewsphere.assets.mesh import Mesh
from viewsphere.assets.primitive import face_normals
from viewsphere.geometry.diameter import diameter

Float = NDArray[np.float64]

SPREAD = 2000
"""Number of points spread over the surface, and the greatest number of vertices added to them."""

FINEST = 64
"""Cells along the diameter."""


@dataclass(frozen=True, eq=False)
class DistanceField:
    """Distances from a surface (X, Y, Z) float32 at nodes `step` metres apart from `start` on, valid at least up to `most`."""

    nodes: NDArray[np.float32]
    start: Float
    step: float
    most: float

    def misfits(self, motions: Float, points: Float) -> Float:
        """The approximate sum of squared distances of moved points (N, 3) from the surface, for each motion (M, 4, 4). It is
        infinite only if a point is beyond the field's limit. The cost does not depend on the number of triangles.
        """
        from viewsphere.assets.metadata.kernels_near import field_misfits

        sums = np.zeros(len(motions))
        field_misfits(points, np.ascontiguousarray(motions[:, :3]), self.nodes, self.start, self.step, self.most, sums)
        return sums


@dataclass(frozen=True, eq=False)
class Surface:
    """The triangles with non-zero area: their corners (T, 3, 3) float64, metres in the object's axes."""

    corners: Float

    @staticmethod
    def from_mesh(mesh: Mesh) -> Surface:
        """The surface of a mesh, without its materials."""
        corners = mesh.vertices.astype(np.float64)[mesh.triangles]
        solid = (face_normals(mesh.vertices.astype(np.float64), mesh.triangles) != 0).any(axis=1)
        return Surface(np.ascontiguousarray(corners[solid]))

    @cached_property
    def diameter(self) -> float:
        """The largest distance between two vertices, metres."""
        return diameter(self.corners.reshape(-1, 3))

    @cached_property
    def areas(self) -> Float:
        """The areas of the triangles (T,), square metres."""
        a, b, c = (self.corners[:, i] for i in range(3))
        return np.sqrt((np.cross(b - a, c - a) ** 2).sum(axis=1)) / 2

    @cached_property
    def center(self) -> Float:
        """The centroid of the surface (3,): every symmetry leaves it fixed."""
        return (self.areas[:, None] * self.corners.mean(axis=1)).sum(axis=0) / self.areas.sum()

    @cached_property
    def spread(self) -> Float:
        """The second moments (3, 3) of the surface about its centroid, square metres. Symmetries leave them unchanged."""
        around = self.corners - self.center
        around = np.concatenate([around, 3 * around.mean(axis=1, keepdims=True)], axis=1)
        share = self.areas / (12 * self.areas.sum())
        return np.array([[(share[:, None] * around[..., i] * around[..., j]).sum() for j in range(3)] for i in range(3)])

    @cached_property
    def points(self) -> Float:
        """Points (N, 3) that represent the surface: evenly spread points and vertices, in a mixed order. Equal surfaces have
        equal points.
        """
        vertices = np.unique(self.corners.reshape(-1, 3), axis=0)
        vertices = vertices[:: -(-len(vertices) // SPREAD)]
        points = np.concatenate([self._even(SPREAD), vertices])
        return np.ascontiguousarray(points[np.random.default_rng(0).permutation(len(points))])

    def _even(self, count: int) -> Float:
        """`count` points with uniform density by area, from Roberts' sequence R2, folded into the triangles."""
        number = np.arange(count) + 0.5
        ends = np.cumsum(self.areas)
        triangle = np.searchsorted(ends, number * (ends[-1] / count)).clip(max=len(ends) - 1)
        plastic = 1.32471795724474602596
        u, v = number / plastic % 1, number / plastic**2 % 1
        folded = u + v > 1
        u, v = np.where(folded, 1 - u, u)[:, None], np.where(folded, 1 - v, v)[:, None]
        a, b, c = (self.corners[triangle, i] for i in range(3))
        return a + u * (b - a) + v * (c - a)

    def are_near(self, motions: ArrayLike, limit: float, points: Float | None = None) -> NDArray[np.bool_]:
        """A mask of the motions (M, 4, 4) that move all points (by default the surface's own) to within `limit` metres of the
        surface.
        """
        from viewsphere.assets.metadata.kernels_near import all_near  # imports numba, which the code that starts workers avoids

        motions = np.ascontiguousarray(np.asarray(motions, np.float64)[:, :3])
        near = np.zeros(len(motions), np.bool_)
        all_near(self.points if points is None else points, motions, self._grid, limit, near)
        return near

    def closest(self, points: Float, motion: Float, limit: float) -> tuple[Float, Float, Float]:
        """For points (N, 3) moved by (4, 4): their squared distances (N,) from the surface, infinite beyond `limit`; the
        nearest points (N, 3) of the surface; and the unit normals (N, 3) there.
        """
        from viewsphere.assets.metadata.kernels_near import closest

        found = np.zeros((len(points), 7))
        closest(points, np.ascontiguousarray(motion[:3]), self._grid, limit, found)
        return found[:, 0], found[:, 1:4], found[:, 4:]

    def field(self, limit: float) -> DistanceField:
        """A field of the distances from the surface, for points within `limit` of it."""
        from viewsphere.assets.metadata.kernels_near import into_field

        low, step, sides = self._grid[3:]
        most = limit + step  # between nodes, the distances are off by less than the half diagonal of a cell
        margin = math.ceil(most / step) + 1
        start = low - margin * step
        nodes = np.zeros([side + 2 * margin + 1 for side in sides], np.float32)
        into_field(self._grid, start, step, 1.01 * most, nodes)
        return DistanceField(nodes, start, step, most)

    @cached_property
    def _grid(self) -> tuple[Any, ...]:
        """The triangles in a grid of cells, in the form that kernels expect."""
        from viewsphere.assets.metadata.kernels_near import into_cells

        low, high = self.corners.min(axis=(0, 1)), self.corners.max(axis=(0, 1))
        cell = float((high - low).max()) / FINEST or 1.0
        shape = tuple(math.floor(side) + 1 for side in ((high - low) / cell).tolist())
        counts = np.zeros(shape, np.int64)
        into_cells(self.corners, low, cell, counts, np.zeros(0, np.int32), False)
        ends = np.cumsum(counts)
        counts[...] = ends.reshape(shape)
        members = np.zeros(ends[-1], np.int32)
        into_cells(self.corners, low, cell, counts, members, True)
        return self.corners, np.append(counts.reshape(-1), ends[-1]), members, low, cell, shape
