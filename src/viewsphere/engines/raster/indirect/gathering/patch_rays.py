"""Rays of patches that no lightmap lights: probes between small things are too coarse for the light that these reflect."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.raster.indirect import kernels_probes as kernels
from viewsphere.engines.raster.indirect.emissive_triangles import EmissiveTriangles
from viewsphere.engines.raster.indirect.kernels_emissive import shine_at
from viewsphere.engines.raster.indirect.radiosity_patches import Patches, Rays
from viewsphere.engines.raster.records import Float32, Int32
from viewsphere.engines.raster.reflections.tracing import Tree, cast
from viewsphere.engines.raster.sky.environment import Surrounding, sky_along

RAYS = 8
"""Number of rays from each stored hit of a patch."""

WAYS = 32
"""Number of rotations of the rays of hits."""

SOME = 4096
"""Number of hits processed at a time."""


class PatchRays(NamedTuple):
    """The rays of patches. which, share (N,): the patch of each origin, and its share of this patch; normals (N, 3)."""

    which: Int32
    share: Float32
    normals: Float32
    rays: Rays

    def from_afar(
        self,
        ids: Int32,
        surrounding: Surrounding,
        tree: Tree,
        emissive: EmissiveTriangles,
        turns: int,
        emitted: Float32,
        off: float,
    ) -> Float32:
        """Return the light of the sky, the distant ground and emissive triangles at these origins, (N, 3).

        The light is given as the radiance of white matt surfaces. The rays of the origins hit patches `ids` (K, N). Emissive
        triangles send `emitted` (M, 3).
        """
        light = np.zeros((len(self.which), 3), np.float32)
        for start in range(0, len(light), SOME):
            sky = sky_along(surrounding, self.rays.directions[start : start + SOME])
            kernels.see_around(ids, start, sky, surrounding.below, light)
        if len(emissive.points):
            points = turns * kernels.HITS, np.float32(kernels.HITS), emissive.points
            near = ids, self.rays.far, emissive.froms, emitted
            shine_at(tree, self.rays.origins, self.normals, *points, *near, np.float32(off), light)
        return light


def rays_of(patches: Patches, which: Int32, dome: Float32, tree: Tree, off: float) -> PatchRays:
    """Rays from some patches in directions distributed by their cosine, `dome` (RAYS * WAYS, 3).

    They begin at the patches' hits, `off` the surface, because the mean of several places on a round thing is inside that
    thing.
    """
    table = patches.table
    rows, columns = np.nonzero(np.arange(kernels.HITS) < table.known[which, None])
    own = which[rows]
    normals = table.normal[own, columns]
    origins = (table.place[own, columns] + normals * np.float32(off)).astype(np.float32)
    turn = np.arange(len(own), dtype=np.int32)
    turned = dome.reshape(RAYS, WAYS, 3).transpose(1, 0, 2)[turn % WAYS]
    directions = np.matmul(turned, axes_along(normals), dtype=np.float32)
    rays = Rays(origins, directions, turn, *cast(tree, origins, directions, turn, np.inf))
    return PatchRays(own, (1 / table.known[own]).astype(np.float32), normals, rays)


def axes_along(normals: NDArray[np.float32]) -> NDArray[np.float32]:
    """Axes (N, 3, 3) whose last one is the normal (Duff et al., Building an Orthonormal Basis, Revisited, 2017)."""
    x, y, z = normals.T
    sign = np.where(z < 0, np.float32(-1), np.float32(1))
    a = -1 / (sign + z)
    b = x * y * a
    across = np.stack([1 + sign * x * x * a, sign * b, -sign * x], axis=1)
    return np.stack([across, np.stack([b, sign + y * y * a, -y], axis=1), normals], axis=1).astype(np.float32)
