"""The solid glass of a stage, through which rays are followed: see `kernels_bend`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from viewsphere.engines.raster.materials.kernels_material import L_BENDS
from viewsphere.engines.raster.materials.surface import Rows
from viewsphere.engines.raster.records import Float32, Int32
from viewsphere.engines.raster.reflections.kernels_trace import WIDE
from viewsphere.engines.raster.reflections.tracing import tree_of


class Glass(NamedTuple):
    """The solid glass of a stage. tree: the tree of its triangles, see `tracing.Tree`. For each place in its leaves: normals (L
    * 8, 9) float32 of the three corners, and material (L * 8,) int32, a row of `Surfaces.looks`. Empty if nothing refracts
    light.
    """

    bounds: Float32
    links: Int32
    corners: Float32
    normals: Float32
    material: Int32


NO_GLASS = Glass(
    np.zeros((0, 6 * WIDE), np.float32),
    np.zeros((0, WIDE), np.int32),
    np.zeros((0, 9 * WIDE), np.float32),
    np.zeros((0, 9), np.float32),
    np.zeros(0, np.int32),
)


def glass_of(rows: Rows) -> Glass:
    """Return the triangles that bound solid glass."""
    surfaces = rows.surfaces
    bends = surfaces.looks[:, L_BENDS] > 0
    if not bends.any():
        return NO_GLASS
    bending = np.flatnonzero(bends[surfaces.material])
    if not len(bending):
        return NO_GLASS
    things = np.searchsorted(rows.geometry.triangle_start, bending, side="right") - 1
    rows.write(np.unique(things).tolist())
    corners = surfaces.vertices[surfaces.triangles[bending]]
    tree = tree_of(corners[..., 11:14])
    normals = corners[tree.order, :, :3].reshape(-1, 9)
    return Glass(tree.bounds, tree.links, tree.corners, normals, surfaces.material[bending[tree.order]])
