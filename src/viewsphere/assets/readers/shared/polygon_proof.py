"""A check that the triangles of a polygon cover it, by comparing both areas."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.paths.folder import ModelFolder
from viewsphere.assets.primitive import Float, Int, face_normals
from viewsphere.assets.readers.shared.polygon import triangulate

FOLDED = 1e-4
"""Greatest area of flipped triangles, as a share of the polygon's area: float32 rounds thin triangles by about 1e-5."""

BENT = 0.05
"""Excess of the triangles over the outline's area: a square whose halves meet at 36 degrees, nearly a crease, has this
excess.
"""


def cut_polygons(folder: ModelFolder, positions: Float, corners: Int, counts: Int) -> tuple[Int, Int]:
    """The triangles of polygons as `triangulate` returns them; polygons not covered by their triangles cause a warning."""
    triangles, owner = triangulate(positions, corners, counts)
    kept = np.flatnonzero(counts > 3)
    if kept.size:
        points = positions[corners]
        outlines = _outline_normals(points, counts)
        folded, bent = _badly_covered(points, triangles, owner, counts, outlines)
        _warn(folder, kept, folded, "cross or overlap themselves", "draw them without crossings")
        _warn(folder, kept, bent, "are far from flat", "cut them into triangles")
    return triangles, owner


def _outline_normals(points: Float, counts: Int) -> Float:
    """Twice the area vector of each polygon (Newell), from its outline alone."""
    starts = np.cumsum(counts) - counts
    after = np.arange(1, len(points) + 1)
    after[starts + counts - 1] = starts
    local = points - np.repeat(points[starts], counts, axis=0)
    return np.add.reduceat(np.cross(local, local[after]), starts)


def _badly_covered(
    points: Float, triangles: Int, owner: Int, counts: Int, outlines: Float
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Masks (N,) of polygons with a flipped triangle, and of other polygons with more area than their outlines."""
    first = np.cumsum(counts - 2) - (counts - 2)
    faces = face_normals(points, triangles)
    area, outline = np.add.reduceat(_lengths(faces), first), _lengths(outlines)
    along = (faces * outlines[owner]).sum(axis=1)
    least = np.minimum.reduceat(along, first)
    is_known = np.isfinite(area) & (area > 0) & (counts > 3)
    is_crossing = (least < -FOLDED * area * outline) | (outline < FOLDED * area)
    is_bent = area > (1 + BENT) * outline
    return is_known & is_crossing, is_known & is_bent & ~is_crossing


def _lengths(vectors: Float) -> Float:
    return np.sqrt((vectors * vectors).sum(axis=1))


def _warn(folder: ModelFolder, kept: Int, which: NDArray[np.bool_], problem: str, remedy: str) -> None:
    at = np.flatnonzero(which)
    if at.size:
        some = "1 polygon" if at.size == 1 else f"{at.size:,} polygons"
        verb = problem if at.size > 1 else _SINGULAR[problem]
        folder.warn(
            f"{some} of {kept.size:,} with more than 3 corners {verb} (face {at[0] + 1:,}): "
            f"the triangles may differ from the intended surface; {remedy} and export again"
        )


_SINGULAR = {"cross or overlap themselves": "crosses or overlaps itself", "are far from flat": "is far from flat"}
