"""The reflections of near things in polished level surfaces, if light bounces: floors, or the top of a table.

Their material mirrors the blurred and slightly displaced view of the probes. Here the scene's own mirror image replaces it,
sharp where a thing touches the surface. The rougher the surface, the more blurred and the weaker the image.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.raster.materials.kernels_material import L_ROUGH, L_ROUGH_TEXEL
from viewsphere.engines.raster.records import Float32
from viewsphere.engines.raster.reflections import kernels_mirror
from viewsphere.engines.raster.reflections.mirroring import blurred, is_above, looked_at, lying, mirrored
from viewsphere.engines.raster.shading import kernels_paint, kernels_split
from viewsphere.engines.raster.shading.painting import Baked, view_of
from viewsphere.model.sensors.camera import Camera
from viewsphere.truth.raster.visibility import Visibility

LEVEL = 0.9995
"""Minimum z of the normal of a level mirror."""

THICK = 0.004
"""Thickness in metres of one level; things on the mirror within it, or below, are not reflected."""

LEAST = 0.02
"""Minimum share of a picture for a mirror to count."""

SHARP, MATT = 0.3, 0.5
"""Roughness up to which the mirror image has full weight, and above which it has none: there, the probes' view is equally
blurred.
"""

SPREAD = 0.6
"""Reach of the blur of distant things, in halves of the picture's height, over the square of the roughness."""


NOWHERE = np.empty(0, np.intp)
"""No pixels."""


def mirror_in_polish(baked: Baked, camera: Camera, visibility: Visibility, radiance: Float32) -> NDArray[np.intp]:
    """Replace the reflections of polished surfaces in `radiance` (H * W, 4) by the mirror image of things, if light bounces.
    Return the pixels (n,) that show these surfaces.
    """
    if baked.bounces.grid[0] == 0:
        return NOWHERE
    at, plane = _mirror(baked, camera, visibility)
    if not len(at):
        return NOWHERE
    gloss = np.empty((len(at), kernels_split.GLOSS), np.float32)
    triangle, depth = visibility.triangle.reshape(-1), visibility.inverse_depth.reshape(-1)
    light = baked.surrounding, baked.occlusion, baked.bounces
    own = view_of(baked, camera, triangle=triangle), baked.surfaces, baked.textures, baked.floor
    kernels_split.gloss(*own, *light, at.astype(np.int32), triangle, depth, gloss)
    shines = gloss[:, 6] < MATT
    if not shines.all():
        at, gloss = at[shines], gloss[shines]
    if len(at) < LEAST * visibility.triangle.size:
        return NOWHERE
    seen = mirrored(baked, camera, plane, lying(baked.geometry, plane + THICK), at)
    image = (seen.things + (1 - seen.hidden) * seen.sky).astype(np.float32)
    reach = SPREAD * float(np.mean(gloss[:, 6])) ** 2 * camera.height / 2
    soft = blurred(image, at, camera, (max(1, round(reach)), max(1, round(reach / 3))))
    near = blurred(image, at, camera, (1, 1))
    borders = np.float32(SHARP), np.float32(MATT)
    kernels_mirror.polish(at, gloss, near, soft, seen.nearness, depth, *borders, radiance)
    return at


def _mirror(baked: Baked, camera: Camera, visibility: Visibility) -> tuple[NDArray[np.intp], float]:
    """Pixels (n,) of the level surface below the camera that covers most pixels, and its height."""
    shown = visibility.triangle.reshape(-1)
    polished = baked.surfaces.looks[:, L_ROUGH] + baked.surfaces.looks[:, L_ROUGH_TEXEL] < MATT  # before any texture reduces it
    is_level = (np.abs(baked.surfaces.normals[:, 2]) > LEVEL) & (baked.kind[:-1] == kernels_paint.SOLID)
    is_level &= polished[baked.surfaces.material]
    at = np.flatnonzero((shown >= 0) & is_level[shown])
    if len(at) < LEAST * len(shown):
        return at[:0], 0.0
    _, place = looked_at(camera, visibility, at)
    is_below = is_above(camera, place[:, 2] + THICK)
    at, height = at[is_below], place[is_below, 2]
    if not len(at):
        return at, 0.0
    known, counts = np.unique(np.rint(height / THICK), return_counts=True)
    is_own = np.abs(height - known[np.argmax(counts)] * THICK) <= THICK
    return at[is_own], float(np.median(height[is_own]))
