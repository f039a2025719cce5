"""What smooth surfaces mirror of the things that stand still, where light bounces: panes, whichever way they face.

Their material mirrors what probes see, as blurred as roughness 0.5 shows it. A ray from each pixel finds what it sees instead:
sharp, lit by sun, lamps and what bounces. What moves is not in it; level floors have a mirror image of their own (`polish`).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.raster import kernels_mirror, kernels_paint, kernels_probes, kernels_split
from viewsphere.engines.raster.bounces import Hall, tree_of_hall, without_maps
from viewsphere.engines.raster.environment import sky_along
from viewsphere.engines.raster.kernels_material import L_ROUGH, L_ROUGH_TEXEL
from viewsphere.engines.raster.mirroring import BRIGHTEST
from viewsphere.engines.raster.painting import Baked, view_of
from viewsphere.engines.raster.patches import ANY_VIEW
from viewsphere.engines.raster.polish import LEVEL
from viewsphere.engines.raster.records import Float32, Int32
from viewsphere.engines.raster.tracing import Tree, cast
from viewsphere.model.camera import Camera
from viewsphere.truth.visibility import Visibility

SHARP, BLURRED = 0.1, 0.2
"""Roughness up to which what a ray sees counts in full, and from which on not at all."""

OFF = 0.002
"""Metres off a surface at which its rays begin, and those towards lights from what they see."""


def mirror_in_panes(baked: Baked, camera: Camera, visibility: Visibility, radiance: Float32) -> None:
    """Put what rays see in place of what smooth surfaces are taken to mirror in `radiance` (H * W, 4), if light bounces."""
    hall = baked.hall
    if hall is None or baked.bounces.grid[0] == 0:
        return
    at = _panes(baked, visibility)
    if not len(at):
        return
    gloss = np.empty((len(at), kernels_split.GLOSS), np.float32)
    triangle, depth = visibility.triangle.reshape(-1), visibility.inverse_depth.reshape(-1)
    light = baked.surrounding, baked.occlusion, baked.bounces
    view = view_of(baked, camera)
    kernels_split.gloss(view, baked.surfaces, baked.textures, baked.floor, *light, at, triangle, depth, gloss)
    places, ways = gloss[:, 7:10].copy(), gloss[:, 10:13].copy()
    shown = np.minimum(_seen(baked, hall, places, ways, view.pixel * view.scale / depth[at]), np.float32(BRIGHTEST))
    kernels_mirror.glaze(at, gloss, shown, np.float32(SHARP), np.float32(BLURRED), radiance)


def _panes(baked: Baked, visibility: Visibility) -> Int32:
    """Pixels (n,) whose solid surface is smooth, and no level floor."""
    looks, shown = baked.surfaces.looks, visibility.triangle.reshape(-1)
    is_smooth = looks[:, L_ROUGH] + looks[:, L_ROUGH_TEXEL] < BLURRED
    is_pane = is_smooth[baked.surfaces.material] & (baked.kind[:-1] == kernels_paint.SOLID)
    is_pane &= np.abs(baked.surfaces.normals[:, 2]) <= LEVEL
    return np.flatnonzero((shown >= 0) & is_pane[shown]).astype(np.int32)


def _seen(baked: Baked, hall: Hall, places: Float32, ways: Float32, width: NDArray[np.float32]) -> Float32:
    """Radiance (n, 3) of what is seen from places (n, 3) along rays of length 1; width (n,): of a pixel there."""
    tree, off = tree_of_hall(hall), np.float32(OFF / hall.unit)
    origins = (places + off * ways).astype(np.float32)
    turn = np.arange(len(places), dtype=np.int32)
    (met,), (far,) = cast(tree, origins, ways[:, None], turn, np.inf)
    light = sky_along(baked.surrounding, ways)
    hit = np.flatnonzero(met >= 0)
    own = hall.which[met[hit]], (origins[hit] + far[hit, None] * ways[hit]).astype(np.float32), ways[hit]
    light[hit] = _shaded(baked, hall, tree, off, *own, width[hit])
    return light


def _shaded(
    baked: Baked, hall: Hall, tree: Tree, off: np.float32, triangle: Int32, places: Float32, ways: Float32, width: Float32
) -> Float32:
    """Radiance (n, 3) of these triangles at places (n, 3), as if they scattered all light, towards where rays come from."""
    answers, arrived, glow = (np.empty((len(places), columns), np.float32) for columns in (6, 3, 3))
    made = ANY_VIEW, hall.surfaces, hall.textures, hall.floor, baked.surrounding.albedo
    lights = without_maps(baked.lights)
    kernels_probes.shade_hits(*made, tree, lights, off, triangle, places, ways, width, False, answers, arrived)
    normals, inside = hall.surfaces.normals[triangle], np.empty(len(places), np.float32)
    facing = np.where((normals * ways).sum(axis=1, keepdims=True) < 0, normals, -normals).astype(np.float32)
    kernels_probes.look_up(baked.bounces, places, facing, triangle, glow, inside)
    up = (1 + facing[:, 2:]) / 2
    elsewhere = up * baked.surrounding.up + (1 - up) * baked.surrounding.below
    light = arrived / np.float32(math.pi) + glow + (1 - inside[:, None]) * elsewhere
    return (answers[:, 3:] + answers[:, :3] * light).astype(np.float32)
