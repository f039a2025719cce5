"""Voxels: the grid of cells of a view, the content of each cell, and the runs in which it is stored."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator

from viewsphere.geometry import voxels
from viewsphere.limits import limits
from viewsphere.model.fields.frozen import Frozen
from viewsphere.model.fields.numbers import Count, Metres, Positive
from viewsphere.model.sensors.camera import Camera

OUTSIDE, FREE, SURFACE, OCCLUDED = range(4)
"""A cell's state for the camera: its centre is outside the picture; its centre is in front of the surface in its pixel; the
cell contains a visible point; its centre is behind the surface in its pixel.
"""

EMPTY, TOUCHED, INSIDE = range(3)
"""Content of a cell: nothing; a surface; only the inside of an object."""

RUN = np.dtype(
    [
        ("length", "<u4"),
        ("class", "<i4"),
        ("instance", "<i4"),
        ("filled", "u1"),
        ("state", "u1"),
        ("indoors", "u1"),
    ]
)
"""A run of equal cells: their number; class as in `semantic`, 0 where the cell is empty; object, 0 for none; content (0
nothing, 1 a surface, 2 an object's inside); state (0 outside the picture, 1 free, 2 a visible surface, 3 occluded); and whether
its centre is between scenery above and scenery or ground below.
"""

LEVEL = 1e-6
"""Length of a viewing direction's horizontal part below which a camera counts as looking straight up or down."""


ROOM = 1 + 1e-6
"""Side of the cube around a model, as a multiple of the model's longest side: keeps the outermost faces inside cells."""


class Voxels(Frozen):
    """Options of the label voxels."""

    size: tuple[Count, Count, Count] = Field(default=(240, 144, 240), description="cells ahead, up, and to the right")
    cell: Annotated[Positive, Field(ge=1e-6)] = Field(default=0.02, description="metres, the side of a cell")
    axes: Literal["view", "world"] = Field(
        default="view",
        description="view: ahead is the camera's direction, kept level; world: ahead is +y, right is +x, as in SSCNet",
    )
    distance: Metres = Field(default=3.4, description="metres from the camera, along its axis, to the middle of the grid")
    bottom: Metres = Field(default=-0.05, description="height of the grid's bottom in the world, metres")

    @field_validator("size")
    @classmethod
    def _bounded(cls, size: tuple[int, int, int]) -> tuple[int, int, int]:
        count = math.prod(size)
        if count > limits.MAX_VOXELS:
            raise ValueError(f"expected at most {limits.MAX_VOXELS:,} cells, found {count:,}: take fewer, larger cells")
        return size


@dataclass(frozen=True, eq=False)
class Grid:
    """Cells along the axes ahead, up and right, which stay level; `cell` metres each. `world_from_grid` (4, 4) is rigid: the
    grid's own coordinates are metres from the corner of its first cell.
    """

    size: tuple[int, int, int]
    cell: float
    world_from_grid: NDArray[np.float64]

    @classmethod
    def for_camera(cls, options: Voxels, camera: Camera) -> Grid:
        """The grid of a camera's view."""
        (x, y), (fx, fy) = _middle(camera, options.distance), (0.0, 1.0)
        if options.axes == "view":
            fx, fy = _heading(camera)
        half_ahead, half_right = options.size[0] * options.cell / 2, options.size[2] * options.cell / 2
        corner = (x - half_ahead * fx - half_right * fy, y - half_ahead * fy + half_right * fx, options.bottom)
        rows = [[fx, 0.0, fy, corner[0]], [fy, 0.0, -fx, corner[1]], [0.0, 1.0, 0.0, corner[2]], [0.0, 0.0, 0.0, 1.0]]
        return cls(options.size, options.cell, np.array(rows))

    def cells(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """World points (N, 3) in units of cells from the grid's corner: the floor of the coordinates is the cell (i, j, k)."""
        m = self.world_from_grid
        x, y, z = (points[:, i] - m[i, 3] for i in range(3))
        return np.column_stack([(m[0, i] * x + m[1, i] * y + m[2, i] * z) / self.cell for i in range(3)])

    def points(self, cells: NDArray[np.floating]) -> NDArray[np.float64]:
        """Return the world places of these cell coordinates, (N, 3) metres: the inverse of `cells`."""
        m, (a, b, c) = self.world_from_grid, cells.T * self.cell
        return np.column_stack([m[i, 0] * a + m[i, 1] * b + m[i, 2] * c + m[i, 3] for i in range(3)])


def _middle(camera: Camera, distance: float) -> tuple[float, float]:
    """The world x and y of the point on the camera's axis at this distance."""
    x, y = (camera.center + distance * camera.R[2])[:2].tolist()
    return x, y


def _heading(camera: Camera) -> tuple[float, float]:
    """The horizontal direction in which the camera looks, of unit length. For a camera that looks straight down or up, it is
    the direction of the top, or the bottom, of its picture.
    """
    _, down, forward = camera.R.tolist()
    x, y, _ = forward
    if math.sqrt(x * x + y * y) < LEVEL:
        sign = math.copysign(1.0, forward[2])
        x, y = sign * down[0], sign * down[1]
    length = math.sqrt(x * x + y * y)
    return x / length, y / length


@dataclass(frozen=True, eq=False)
class Occupancy:
    """The cells of a cube around a model.

    Attributes:
        filled: (n, n, n) uint8 along the object's x, y and z: 0 nothing, 1 a triangle crosses the cell, 2 its centre is
            inside the model.
        cell: Side of a cell, metres.
        corner: (3,) float64, corner of the first cell, object axes, metres.
    """

    filled: NDArray[np.uint8]
    cell: float
    corner: NDArray[np.float64]

    @classmethod
    def from_mesh(cls, vertices: NDArray[np.float32], triangles: NDArray[np.int32], cells: int) -> Occupancy:
        """The cells of a mesh whose longest side is `cells` long; raises ValueError for less than 1 or too many."""
        if not 1 <= cells**3 <= limits.MAX_VOXELS:
            raise ValueError(f"occupancy: expected 1 to {limits.MAX_VOXELS:,} cells in all, found {cells} along each side")
        used = vertices[np.unique(triangles)].astype(np.float64) if len(triangles) else np.zeros((1, 3))
        low, high = used.min(axis=0), used.max(axis=0)
        cell = ROOM * float((high - low).max() or 1.0) / cells
        corner = (low + high) / 2 - cell * cells / 2
        owner, filled = np.full((cells,) * 3, -1, np.int32), np.zeros((cells,) * 3, np.uint8)
        points, rows = (vertices.astype(np.float64) - corner) / cell, np.arange(len(triangles))
        voxels.touch(points, triangles, rows, owner, filled, TOUCHED)
        voxels.fill(points, triangles, rows[voxels.closed(vertices, triangles)], owner, filled, INSIDE)
        return cls(filled, cell, corner)

    def centers(self, chosen: NDArray[np.bool_]) -> NDArray[np.float64]:
        """Centres of the chosen cells.

        Args:
            chosen: (n, n, n) bool, such as `filled > 0`.

        Returns:
            Points (N, 3) float64 in the object's axes, metres.
        """
        return (np.argwhere(chosen) + 0.5) * self.cell + self.corner


@dataclass(frozen=True, eq=False)
class VoxelGrid:
    """The content of each cell of a sample's grid, arrays of shape `grid.size` (ahead, up, right).

    Attributes:
        grid: Place and size of the cells.
        classes: int32, number of the class in a cell; 0 for none.
        instances: int32, id of the object in a cell; 0 for none.
        filled: uint8, 0 nothing, 1 a surface, 2 the inside of an object.
        state: uint8, 0 outside the picture, 1 free, 2 a visible surface, 3 occluded.
        indoors: bool, whether the cell's centre is between scenery above and scenery or ground below.
    """

    grid: Grid
    classes: NDArray[np.int32]
    instances: NDArray[np.int32]
    filled: NDArray[np.uint8]
    state: NDArray[np.uint8]
    indoors: NDArray[np.bool_]

    @classmethod
    def from_runs(cls, runs: NDArray[Any], grid: Grid) -> Self:
        """The cells of runs (N,) of `RUN`; raises ValueError if the grid has another number of cells."""
        count, filled = math.prod(grid.size), int(runs["length"].sum(dtype=np.uint64))
        if filled != count:
            raise ValueError(f"voxels: expected runs of {count:,} cells, found {filled:,}")

        def whole(name: str) -> NDArray[Any]:
            return np.repeat(runs[name], runs["length"]).reshape(grid.size)

        indoors = whole("indoors").astype(np.bool_)
        return cls(grid, whole("class"), whole("instance"), whole("filled"), whole("state"), indoors)

    def centers(self, chosen: NDArray[np.bool_]) -> NDArray[np.float64]:
        """Centres of the chosen cells.

        Args:
            chosen: Array of shape `grid.size`, bool, such as `classes > 0`.

        Returns:
            Points (N, 3) float64 in the world, metres.
        """
        return self.grid.points(np.argwhere(chosen) + 0.5)
