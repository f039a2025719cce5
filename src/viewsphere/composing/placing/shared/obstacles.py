"""Obstacles on a place's floor, from its mesh, as a grid seen from above."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]

CELLS = 1024
"""Cells along the longer side of a grid: 1 cm for 10 m, as fine as the gaps in recipes."""

FINE = 0.08
"""Largest cell, metres: grids of more than 40 m have more cells instead, so that gaps between parked cars remain visible."""

MOST_CELLS = 8192
"""Most cells along a side, however far a layout reaches: 64 MiB while the grid is drawn."""

REACH = 20.0
"""Least radius around the middle, in metres, within which the mesh is used; layouts that reach farther pass their own."""

STEP = 0.02
"""Metres above the floor up to which a mesh is floor: carpets, sills and the slope of a floor that is nearly level."""

FREE = 0.01
"""Share of the grid that must be free. A mesh that leaves less, such as hilly ground, is ignored."""


@dataclass(frozen=True, eq=False)
class Obstacles:
    """Cells (columns, rows) that a place fills, from a corner (2,) on; metres."""

    corner: Float
    cell: float
    filled: NDArray[np.bool_]

    def meets(self, corners: Float, gap: float) -> bool:
        """Return whether a convex polygon (N, 2), in either order, is nearer than a gap to the filled cells."""
        low, high = ((edge - self.corner) / self.cell for edge in (corners.min(axis=0) - gap, corners.max(axis=0) + gap))
        x0, y0 = np.maximum(np.floor(low).astype(int), 0)
        x1, y1 = np.minimum(np.ceil(high).astype(int), self.filled.shape)
        if x1 <= x0 or y1 <= y0:
            return False
        cells = np.argwhere(self.filled[x0:x1, y0:y1])
        return bool(len(cells)) and _is_near(corners, self.corner + (cells + (x0, y0) + 0.5) * self.cell, gap + self.cell / 2)


def _is_near(corners: Float, points: Float, gap: float) -> bool:
    """Return whether one of the points (N, 2) is inside a convex polygon whose sides are moved out by a gap."""
    sides = np.roll(corners, -1, axis=0) - corners
    turn = sides[0, 0] * sides[1, 1] - sides[0, 1] * sides[1, 0]
    lengths = np.maximum(np.linalg.norm(sides, axis=1), 1e-12)
    outward = np.stack([sides[:, 1], -sides[:, 0]], axis=1) / lengths[:, None] * np.sign(turn or 1.0)
    beyond = points @ outward.T - (corners * outward).sum(axis=1)
    return bool((beyond <= gap).all(axis=1).any())


def obstacles(
    vertices: Float, triangles: NDArray[np.int32], height: float, reach: float = REACH, step: float = STEP
) -> Obstacles | None:
    """The cells filled between the floor and a height by triangles (M, 3) of vertices (N, 3), in the floor's axes, up to the
    layout's `reach` from the middle; None if no cell is. `step`: metres up to which a mesh counts as floor.
    """
    from PIL import Image, ImageDraw

    corners = vertices[triangles]
    reach = max(reach, REACH)
    above = (corners[..., 2].max(axis=1) > step) & (corners[..., 2].min(axis=1) < height)
    near = ((corners[..., :2].min(axis=1) <= reach) & (corners[..., :2].max(axis=1) >= -reach)).all(axis=1)
    flat = corners[above & near][..., :2]
    if not len(flat):
        return None
    low, high = (edge.clip(-2 * reach, 2 * reach) for edge in (flat.min(axis=(0, 1)), flat.max(axis=(0, 1))))
    cell = _cell(float((high - low).max()))
    columns, rows = (int(n) + 3 for n in np.ceil((high - low) / cell))
    picture = Image.new("1", (columns, rows))
    draw = ImageDraw.Draw(picture)
    for polygon in ((flat - low) / cell + 1).round().astype(int).reshape(-1, 6).tolist():
        draw.polygon(polygon, fill=1)
        draw.line([*polygon, *polygon[:2]], fill=1)  # a polygon's outline has holes where the triangle is upright
    filled = np.asarray(picture).T.copy()
    return None if (~filled).mean() < FREE else Obstacles(low - 1.5 * cell, cell, filled)


def _cell(side: float) -> float:
    """Side of a cell, metres, for a grid with a longer side of this length."""
    return max(side / CELLS if side <= CELLS * FINE else max(FINE, side / MOST_CELLS), 1e-4)
