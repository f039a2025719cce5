"""Emissive surfaces: points distributed over them by their power, which light the probes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from viewsphere.engines.raster.indirect import kernels_emissive as kernels
from viewsphere.engines.raster.indirect.radiosity_patches import Patches
from viewsphere.engines.raster.materials.kernels_material import L_EB, L_ER, L_UNLIT
from viewsphere.engines.raster.records import Float32, Int32, Surfaces

POINTS = 256
"""Number of points on all emissive triangles, shared between the rotations of the probes."""

LARGEST = 0.1
"""Maximum solid angle, in steradians, of the part that a point represents, for the point to count."""


class EmissiveTriangles(NamedTuple):
    """points (J, POINT_COLUMNS): columns named in `kernels_emissive`, empty if nothing is emissive. froms (M,): for each patch,
    the square of the distance from which points represent it, 0 if the triangle is not emissive.
    """

    points: Float32
    froms: Float32


def emissive_triangles_of(
    which: Int32, surfaces: Surfaces, patches: Patches, emitted: Float32, turns: int
) -> EmissiveTriangles:
    """Return the emissive triangles among `which` (T,). Their patches emit `emitted` (M, 3)."""
    looks = surfaces.looks
    glow = looks[:, L_ER : L_EB + 1].astype(np.float64) * (looks[:, L_UNLIT : L_UNLIT + 1] == 0)
    material = np.where(patches.triangles >= 0, surfaces.material[which[patches.triangles]], len(looks) - 1)
    for m in np.unique(material[glow[material].sum(axis=1) > 0]).tolist():
        glow[m] = emitted[material == m].mean(axis=0, dtype=np.float64)  # the emission after its textures
    brightness = glow.sum(axis=1)
    shining = which[brightness[surfaces.material[which]] > 0]
    if not len(shining):
        return EmissiveTriangles(np.zeros((0, kernels.POINT_COLUMNS), np.float32), np.zeros(patches.count, np.float32))
    a, b, c = surfaces.vertices[surfaces.triangles[shining].T.astype(np.int64), 11:14].astype(np.float64)
    area = np.sqrt((np.cross(b - a, c - a) ** 2).sum(axis=1)) / 2
    power = np.cumsum(area * brightness[surfaces.material[shining]])
    own = np.minimum(np.searchsorted(power, (np.arange(POINTS) + 0.5) / POINTS * power[-1]), len(shining) - 1)
    u, v = ((np.arange(POINTS)[:, None] * step) % 1.0 for step in (0.7548776662, 0.5698402910))  # Roberts' sequence
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    own_material = surfaces.material[shining[own]]
    # The power that one point of a rotation represents on a surface of brightness 1.
    share = power[-1] * turns / POINTS
    stands_for = share / brightness[own_material]
    points = [
        a[own] + u * (b - a)[own] + v * (c - a)[own],
        surfaces.normals[shining[own]],
        glow[own_material] * stands_for[:, None],
        stands_for[:, None] / LARGEST,
    ]
    froms = np.where(brightness[material] > 0, share / np.maximum(brightness[material], 1e-30) / LARGEST, 0)
    return EmissiveTriangles(np.concatenate(points, axis=1).astype(np.float32), froms.astype(np.float32))
