"""Light of still curved surfaces, at the vertices of their triangles and at more points on large ones.

Mesh colours (Yuksel, Keyser and House 2010), with fewer rays. Light is gathered at sites: each cell has one for each of six
directions that its surfaces face. The light of a point is the mean of the sites around it that face the same way.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.raster.indirect.directions import domes
from viewsphere.engines.raster.indirect.gathering.patch_rays import axes_along
from viewsphere.engines.raster.lightmaps import kernels_sites as kernels
from viewsphere.engines.raster.lightmaps.kernels_lightmap import ALONG, COLUMNS, WEIGHT, count_in
from viewsphere.engines.raster.lightmaps.kernels_vertex_light import FACET, NONE
from viewsphere.engines.raster.records import Float32, Int32
from viewsphere.engines.raster.reflections.tracing import Tree, cast

Float = NDArray[np.float64]

CELL, MOST = 0.06, 16_000
"""Minimum size of a cell in metres, and maximum number of sites."""

ROOM = 1 << 16
"""Places in the table of sites."""

WAYS = 16
"""Number of rotations of the rays of sites."""

LONG, MOST_PARTS = 1.25, 32
"""Maximum distance, in cells, between points along the edges of triangles, and maximum number of parts of an edge."""

OFF = 5e-4
"""Distance of the sites' ray origins off the surface, in metres."""

NEAR, NEAR_RAYS = 1.5, 16
"""Distance in cells within which a point tests for blocking surfaces itself, and the number of rays for this."""

THROWN_BACK = 0.3
"""Light that near surfaces reflect, as a share of the light that they block."""


@dataclass(frozen=True, eq=False)
class Sites:
    """The part of the light at sites that does not depend on light.

    low (3,): the lowest corner of the cells; keys, sites: their table; places, normals (N, 3): see `kernels_sites.settle`;
    origins (N, 3), and directions (N, K, 3) of their rays, which are `local` (R, K, 3), site by site, in axes (N, 3, 3).
    """

    low: Float32
    cell: float
    keys: NDArray[np.uint64]
    sites: Int32
    places: Float32
    normals: Float32
    origins: Float32
    directions: Float32
    local: Float32
    axes: Float32

    def light_at(self, facets: Facets, nodes: Float32, open_: Float32) -> Float32:
        """The mean light of the sites, (P, 12), at the facets' points, multiplied by the openness of these.

        nodes (N, 12): as in `kernels_lightmap.see`; light of the result is along x, y and z instead. open_ (N,): the openness
        of the sites.
        """
        along = nodes[:, ALONG : ALONG + 9].reshape(-1, 3, 3)[:, [1, 2, 0]]  # along both axes, and along the normal
        turned = np.zeros_like(nodes)
        turned[:, WEIGHT] = nodes[:, WEIGHT] * open_  # the value that is read is divided by it
        turned[:, ALONG : ALONG + 9] = np.matmul(self.axes.transpose(0, 2, 1), along).reshape(-1, 9)
        light = np.empty((len(facets.places), COLUMNS), np.float32)
        table = self.keys, self.sites, self.places, self.normals
        kernels.spread(facets.places, facets.normals, self.low, np.float32(1 / self.cell), *table, turned, light)
        light[:, ALONG : ALONG + 9] *= facets.open[:, None]
        return light


@dataclass(frozen=True, eq=False)
class Facets:
    """Triangles whose light is stored at points. facets (F, 5), knots (I,): see `Lightmap`; which (F,): their numbers among the
    bounce scene's triangles; places, normals (P, 3): those of the points; open (P,): see `openness`.
    """

    facets: Float32
    knots: Int32
    which: NDArray[np.intp]
    places: Float32
    normals: Float32
    open: Float32


def openness(far: Float32, reach: float) -> Float32:
    """Return the share (N,) of the light from beyond `reach` that arrives at N places.

    The share includes the light that nearer things reflect. far (K, N): the distances of the hits of rays whose density is
    proportional to their cosine to the surface.
    """
    return (THROWN_BACK + (1 - THROWN_BACK) * (far > reach).mean(axis=0)).astype(np.float32)


def vertex_light_of(
    tree: Tree,
    vertices: Float32,
    triangles: NDArray[np.uint32],
    which: NDArray[np.intp],
    normals: Float32,
    unit: float,
    rays: int,
    is_inside_out: bool = False,
) -> tuple[Sites, Facets] | None:
    """The sites and facets of the triangles `which` (N,) among (T, 3), in a stage of `unit` metres. None if none of them has an
    area, or all are within things.

    tree: the tree of all triangles; vertices: see `Surfaces`; normals (T, 3).
    """
    corners = vertices[triangles[which], 11:14]
    edges = np.roll(corners, -1, axis=1) - corners
    longest = np.sqrt((edges * edges).sum(axis=2).max(axis=1))
    across = np.cross(edges[:, 0], edges[:, 1])
    area = np.sqrt((across * across).sum(axis=1, dtype=np.float64)) / 2
    with np.errstate(invalid="ignore"):
        usable = np.flatnonzero((area > 0) & np.isfinite(area) & np.isfinite(normals[which]).all(axis=1))
    if not len(usable):
        return None
    which, corners, longest = which[usable], corners[usable], longest[usable]
    facing = np.ascontiguousarray(normals[which])
    size = max(CELL / unit, float(np.sqrt(2 * area[usable].sum() / MOST)), float(np.ptp(corners, axis=(0, 1)).max()) / 500_000)
    grid = _Grid.from_corners(corners, facing, longest, size)
    facets = _facets(vertices, triangles, which, corners, facing, grid.parts)
    ways, met, far = look_near(tree, facets.places, facets.normals, NEAR * grid.cell, unit)
    each, counted = np.arange(len(facets.places), dtype=np.int32), np.empty(len(facets.places), np.float32)
    count_in(met, far, ways, each, normals, np.float32(grid.cell), is_inside_out, counted)
    open_ = openness(far, NEAR * grid.cell)
    counts = (grid.parts + 1) * (grid.parts + 2) // 2
    shares = np.add.reduceat(np.where(counted < 1, 0.0, open_)[facets.knots], np.cumsum(counts) - counts) / counts
    if not shares.any():
        return None
    return grid.sites(corners, facing, shares, unit, rays), replace(facets, open=open_)


@dataclass(frozen=True, eq=False)
class _Grid:
    """The smallest cells, not below a minimum size, that give few enough sites.

    low (3,): the corner of the first cell; parts (T,): each triangle is cut into the square of this number for these cells.
    """

    low: Float32
    cell: float
    parts: NDArray[np.int64]

    @classmethod
    def from_corners(cls, corners: Float32, normals: Float32, longest: Float32, cell: float) -> _Grid:
        low, all_ = corners.min(axis=(0, 1)).astype(np.float32), np.ones(len(corners))
        while True:
            parts = np.clip(np.ceil(longest / (LONG * cell)), 1, MOST_PARTS).astype(np.int64)
            grid = cls(low, cell, parts)
            if grid._group(corners, normals, all_)[0] >= 0:
                return grid
            cell *= 1.1

    def _group(self, corners: Float32, normals: Float32, shares: Float) -> tuple[int, NDArray[np.uint64], Int32, Float]:
        """The result of `kernels_sites.group`."""
        keys, sites, sums = np.zeros(ROOM, np.uint64), np.full(ROOM, -1, np.int32), np.zeros((MOST, 7))
        cells = np.float32(1 / self.cell)
        return kernels.group(corners, normals, self.parts, shares, self.low, cells, keys, sites, sums), keys, sites, sums

    def sites(self, corners: Float32, normals: Float32, shares: Float, unit: float, rays: int) -> Sites:
        """The sites of triangles with this openness, (T,), with this many rays each."""
        count, keys, sites, sums = self._group(corners, normals, shares)
        best, places, facing = np.full(count, np.inf), np.empty((count, 3), np.float32), np.empty((count, 3), np.float32)
        cells = np.float32(1 / self.cell)
        kernels.settle(corners, normals, self.parts, shares, self.low, cells, keys, sites, sums, best, places, facing)
        axes, local = axes_along(facing), domes(rays, WAYS).astype(np.float32)
        directions = np.matmul(local[np.arange(count) % len(local)], axes)
        origins = (places + facing * np.float32(OFF / unit)).astype(np.float32)
        return Sites(self.low, self.cell, keys, sites, places, facing, origins, directions, local, axes)


def look_near(tree: Tree, places: Float32, normals: Float32, reach: float, unit: float) -> tuple[Float32, Int32, Float32]:
    """Return the rays from places (P, 3) with these normals, and their hits within `reach`.

    The result has the rays' directions (P, K, 3), the triangles that they meet (K, P), -1 for none, and the distances,
    infinite for none.
    """
    each = np.arange(len(places), dtype=np.int32)
    ways = np.matmul(domes(NEAR_RAYS, WAYS).astype(np.float32)[each % WAYS], axes_along(normals))
    origins = (places + normals * np.float32(OFF / unit)).astype(np.float32)
    met, far = cast(tree, origins, ways, each, reach)
    far[met < 0] = np.inf
    return ways, met, far


def _facets(
    vertices: Float32,
    triangles: NDArray[np.uint32],
    which: NDArray[np.intp],
    corners: Float32,
    normals: Float32,
    parts: NDArray[np.int64],
) -> Facets:
    own = triangles[which].astype(np.int64)
    first = int(own.min())
    counts = (parts + 1) * (parts + 2) // 2
    total = int(counts.sum())
    numbers, index = np.full(int(own.max()) - first + 1, -1, np.int32), np.empty(total, np.int32)
    places, facing = np.empty((total, 3), np.float32), np.empty((total, 3), np.float32)
    smooth = vertices[own, :3]
    points = kernels.lay(own - first, corners, smooth, normals, parts, numbers, index, places, facing)
    facets = np.empty((len(which), FACET), np.float32)
    facets[:, :3], facets[:, 3], facets[:, 4] = normals, parts, np.cumsum(counts) - counts
    return Facets(facets, index, which, places[:points].copy(), facing[:points].copy(), np.ones(points, np.float32))


def numbered(chart: Int32, facets: Facets) -> Int32:
    """The charts of a bounce scene's triangles, combined with the numbers of facets, if there are any: see `Lightmap`."""
    chart = chart.copy()
    chart[facets.which] = NONE - 1 - np.arange(len(facets.which), dtype=np.int32)
    return chart
