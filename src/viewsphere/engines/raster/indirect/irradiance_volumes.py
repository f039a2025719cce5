"""Volumes of probes: the places of probes, and the hits of their rays on still things, which do not depend on light.

A place that would need too many probes has two volumes of equal shape, like the levels of clipmaps (Tanner, Migdal and Jones
1998). One is around its origin, near the targets, and one is around that, with wider cells.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.raster.indirect import kernels_probes as kernels
from viewsphere.engines.raster.indirect.directions import sphere, turned
from viewsphere.engines.raster.indirect.kernels_bounce import SHARP, SLACK
from viewsphere.engines.raster.indirect.radiosity_patches import Rays
from viewsphere.engines.raster.records import Float32, Int32
from viewsphere.engines.raster.reflections.tracing import Tree, cast, unblocked

Float = NDArray[np.float64]

CELL = 0.2
"""Maximum distance between probes in metres, unless there would be more than `MOST`."""

ALONG, MOST = 24, 40_000
"""Minimum number of probes along the longest side, and maximum number of probes of a volume."""

WIDEST, DEPTH, HEIGHT = 0.8, 1.0, 12.0
"""Maximum distance between probes in metres, and the depth below and height above the origin, in metres, of the part that has
probes in a place that would have too many.
"""

WIDER, FADE, LAST = 6.0, 6.0, 2.0
"""Size of the outer volume's cells, in cells of the inner volume; number of cells over which the inner volume's light fades
into the outer one's; number of cells over which the outer volume's light fades into skylight.
"""

ABOVE = 0.25
"""Height, in cells, of a layer of probes above the ground of wide places: things on the ground are lit as at this height."""

RAYS, FEW_RAYS, MANY_PROBES = 384, 256, 24_000
"""Number of rays of a probe, and of a probe in a volume with at least this many probes; with a lightmap, half of these."""

INSIDE_OUT = 0.5
"""Share of probes inside things above which the thing counts as a room that is modelled inside out."""

PAD = 2
"""Margin around all things, in cells."""


class Grid(NamedTuple):
    """Probes between `corner` (3,) and `last`: layers, rows and columns, shape (3,), and `cells` per length."""

    corner: Float
    cells: float
    shape: NDArray[np.int64]

    @property
    def last(self) -> Float:
        """The position of the last probe, (3,)."""
        return self.corner + (self.shape[::-1] - 1) / self.cells

    def resting(self, ground_z: float) -> Grid:
        """The grid moved up by at most a cell, so that one layer is `ABOVE` the ground."""
        up = (ground_z - float(self.corner[2])) * self.cells + ABOVE
        return self._replace(corner=self.corner + np.array([0, 0, (up - math.floor(up)) / self.cells]))

    def around(self, ground_z: float) -> Grid:
        """The grid with as many probes around the same middle, but with cells `WIDER`, and one layer `ABOVE` the ground. Its
        light ends on all sides except below.
        """
        half = (self.last - self.corner) / 2
        corner = self.corner + half - WIDER * half
        corner[2] = ground_z - (LAST + 1 - ABOVE) * WIDER / self.cells
        return Grid(corner, self.cells / WIDER, self.shape)


@dataclass(frozen=True, eq=False)
class Volume:
    """N probes. own (N,): the probe of each ray origin. opens (3, N): whether nothing is between a probe and the next one along
    x, y and z; None if probes are too far apart to share values. rank (N,), screens (N, 72): see `kernels_probes.screen`.
    is_inside_out: whether most probes are within things.
    """

    grid: Grid
    rays: Rays
    own: Int32
    opens: Float32 | None
    rank: NDArray[np.uint8]
    screens: Float32
    is_inside_out: bool

    @property
    def buried(self) -> NDArray[np.bool_]:
        """A mask of the probes within things, (N,)."""
        return self.rank == 0


def grids_of(low: Float, high: Float, unit: float) -> tuple[Grid, ...]:
    """The grids around things between two corners (3,), in lengths of `unit` metres, finest first."""
    cells = max(unit / CELL, ALONG / float((high - low).max()))
    if np.prod(_shape((high - low) * unit / WIDEST)) <= MOST:
        return (_grid(low, high, cells),)
    ground_z = 0.0 if low[2] <= 0 <= high[2] else float(low[2])
    inner = _grid(*_part(low, high, unit), cells).resting(ground_z)
    return inner, inner.around(ground_z)


def rays_of_probes(grids: tuple[Grid, ...], has_charts: bool) -> Float32:
    """Directions of the rays of all probes, (TURNS, K, 3)."""
    is_many = np.prod(grids[0].shape) > MANY_PROBES
    return turned(sphere((FEW_RAYS if is_many else RAYS) // (2 if has_charts else 1)))


def volume_of(grid: Grid, tree: Tree, normals: Float32, directions: Float32, is_finest: bool) -> Volume:
    """Return the volume of probes that see a tree's triangles; normals (T, 3) are those of the triangles."""
    points, turn, own = _points(grid)
    met, far = cast(tree, points, directions, turn, np.inf)
    buried = np.empty(len(points), np.uint8)
    kernels.bury(met, far, directions, turn, own, normals, np.float32(grid.cells), buried)
    is_inside_out = bool((buried > 0).mean() > INSIDE_OUT)
    if is_inside_out:
        buried[buried == 1] = 0
    screens, rank = np.empty((len(points), 72), np.float32), np.zeros_like(buried)
    kernels.screen(met, far, directions, turn, own, normals, np.float32(grid.cells), grid.shape, buried, screens, rank)
    # Hits of a buried probe are ignored: the inner sides of things need no patches.
    met[:, buried[own] > 0] = -1
    opens = _opens(grid, tree, points, own, buried) if is_finest else None
    return Volume(grid, Rays(points, directions, turn, met, far), own, opens, rank, screens, is_inside_out)


def settle(volume: Volume, light: Float32, views: Float32) -> None:
    """Mix the values, (N, 28) and (N, M), of neighbouring probes that see each other, and copy the value of a neighbour to
    buried probes.
    """
    if volume.opens is not None:
        _smooth(light, volume.opens, volume.grid.shape)
        _smooth(views, volume.opens, volume.grid.shape)
    chosen = np.empty(len(light), np.int32)
    kernels.choose(volume.rank, volume.grid.shape, light, chosen)
    for known in (light, views):
        known[volume.buried] = known[chosen[volume.buried]]


def join(inner: Volume, outer: Volume, known: Iterable[tuple[Float32, Float32]]) -> None:
    """Blend the values of the inner probes (N, C) into those of the outer ones, (N, C), towards the border, for each pair of
    arrays, so that no seam is visible beyond it.
    """
    grid, shape = inner.grid, outer.grid.shape
    at = np.indices(tuple(grid.shape.tolist())).reshape(3, -1).T
    weight = np.clip(np.minimum(at, grid.shape - 1 - at).min(axis=1) / FADE, 0, 1).astype(np.float32)
    border = np.flatnonzero((weight < 1) & ~inner.buried)
    places = (grid.corner + at[border][:, ::-1] / grid.cells - outer.grid.corner) * outer.grid.cells
    first = np.clip(np.floor(places), 0, shape[::-1] - 2).astype(np.int64)
    cell = (first[:, 2] * shape[1] + first[:, 1]) * shape[2] + first[:, 0]
    shares = _shares((places - first).astype(np.float32), outer.screens[cell])
    steps = np.indices((2, 2, 2)).reshape(3, 8)
    probes = cell[:, None] + (steps[0] * shape[1] + steps[1]) * shape[2] + steps[2]
    for mine, around in known:
        total = sum(share[:, None] * around[probe] for share, probe in zip(shares.T, probes.T, strict=True))
        mine[border] += (1 - weight[border, None]) * (total - mine[border])


def _shares(part: Float32, screens: Float32) -> Float32:
    """Return the weights, (n, 8), of a cell's corners at places within the cell, in the order of `kernels_bounce`.

    part (n, 3): how far within the cell each place is.
    """
    bits = np.indices((2, 2, 2)).reshape(3, 8)[::-1]
    near_by = np.prod([np.where(bits[k], part[:, k : k + 1], 1 - part[:, k : k + 1]) for k in range(3)], axis=0) + 1e-4
    planes = screens.reshape(len(part), -1, 8)
    sides = [np.einsum("nk,nkc->nc", part, planes[:, k : k + 3]) + planes[:, k + 3] for k in (0, 4)]
    before = np.minimum(*sides)
    seen = np.minimum(np.maximum((before + SLACK) * SHARP + 1, planes[:, 8]), 1)
    shares = near_by * seen
    return (shares / shares.sum(axis=1, keepdims=True)).astype(np.float32)


def _smooth(light: Float32, opens: Float32, shape: NDArray[np.int64]) -> None:
    """Smooth the light along all three axes; each rotation of the rays then has a weight of an eighth."""
    other = np.empty_like(light)
    for axis, step in enumerate((1, int(shape[2]), int(shape[1] * shape[2]))):
        kernels.blur(light, opens[axis], step, other)
        light[:] = other


def _grid(low: Float, high: Float, cells: float) -> Grid:
    """A grid of at most `MOST` probes."""
    size = high - low
    while np.prod(_shape(size * cells)) > MOST:
        cells *= 0.97
    shape = _shape(size * cells)
    spare = (shape - 1) / cells - size
    return Grid(low - spare / 2, cells, shape[::-1].copy())


def _shape(size: Float) -> NDArray[np.int64]:
    """Columns, rows and layers (3,) around a box of this size in cells, chosen so that walls of even sizes do not run along
    probes.
    """
    return (np.ceil(size + 0.5) + 2 * PAD + 1).astype(np.int64)


def _part(low: Float, high: Float, unit: float) -> tuple[Float, Float]:
    """The part of a wide place that may have enough probes: around its origin, near the targets, or around its middle."""
    middle = np.where((low <= 0) & (high >= 0), 0.0, (low + high) / 2)
    below, above, side = DEPTH / unit, HEIGHT / unit, math.sqrt(MOST * WIDEST**3 / (DEPTH + HEIGHT)) / unit
    first, last = np.array([-side / 2, -side / 2, -below]), np.array([side / 2, side / 2, above])
    return np.maximum(middle + first, low), np.minimum(middle + last, high)


def _points(grid: Grid) -> tuple[Float32, Int32, Int32]:
    """Return the places of all probes (N, 3), sorted by turn, with each probe's turn and its index in the volume.

    Any block of two by two by two neighbouring probes has all rotations.
    """
    at = np.indices(tuple(grid.shape.tolist())).reshape(3, -1).T[:, ::-1]
    turn = at % 2 @ [1, 2, 4]
    own = np.argsort(turn, kind="stable")
    return (grid.corner + at[own] / grid.cells).astype(np.float32), turn[own].astype(np.int32), own.astype(np.int32)


def _opens(grid: Grid, tree: Tree, points: Float32, own: Int32, buried: NDArray[np.uint8]) -> Float32:
    """Return whether the way between each probe and the next along x, y and z is free, and neither is buried: (3, N), by
    place.
    """
    shape = grid.shape
    at = np.indices(tuple(shape.tolist())).reshape(3, -1)[::-1]
    opens = np.empty((3, len(points)), np.float32)
    for axis in range(3):
        way = np.zeros_like(points)
        way[:, axis] = 1 / grid.cells
        ahead, back = unblocked(tree, points, way), unblocked(tree, points + way, -way)
        opens[axis, own] = np.minimum(ahead, back)
        is_last = at[axis] == shape[2 - axis] - 1
        opens[axis, is_last] = 0
        step = int(np.prod(shape[3 - axis :]))
        opens[axis][~is_last] *= (buried[~is_last] == 0) & (buried[np.flatnonzero(~is_last) + step] == 0)
    return opens
