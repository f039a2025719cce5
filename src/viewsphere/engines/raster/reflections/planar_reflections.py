"""Reflections of still things in smooth surfaces, if light bounces: window panes, mirrors, polished metal.

Their material mirrors the probes' view, as blurred as at roughness 0.5. A ray from each pixel finds the reflected thing
instead: sharp, lit by sun, lamps and bounced light. With fine bounces, rays in the lobes of rougher surfaces do this, too.
Targets in front of scenery, and moving things, neither mirror in this way nor are mirrored. Cut-out textures count as solid. If
a ray meets the ground, the probes' light is kept. The largest visible level surface has its own mirror image of all things
(`glossy_reflections`).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.raster.indirect import kernels_probes
from viewsphere.engines.raster.indirect.bounces import BounceScene, without_maps
from viewsphere.engines.raster.indirect.gathering.patch_rays import axes_along
from viewsphere.engines.raster.indirect.radiosity_patches import ANY_VIEW
from viewsphere.engines.raster.materials.kernels_material import L_ROUGH, L_ROUGH_TEXEL
from viewsphere.engines.raster.records import Float32, Int32, PictureRays
from viewsphere.engines.raster.reflections import kernels_mirror
from viewsphere.engines.raster.reflections.mirroring import BRIGHTEST
from viewsphere.engines.raster.reflections.tracing import Tree, cast
from viewsphere.engines.raster.shading import kernels_paint, kernels_split
from viewsphere.engines.raster.shading.painting import Baked, view_of
from viewsphere.model.sensors.camera import Camera
from viewsphere.truth.raster.visibility import Visibility

Float = NDArray[np.float64]
SMOOTHEST = 1e-3
"""Minimum squared roughness."""

GOLDEN = 0.6180339887
PLASTIC = 0.7548776662, 0.5698402910
"""Steps of sequences that fill an interval, and a square, evenly (Roberts 2018)."""


SHARP, BLURRED = 0.1, 0.2
"""Roughness up to which the result of a ray has full weight, and above which it has none."""

FINE_SHARP, FINE_BLURRED, LOBE_RAYS = 0.45, 0.55, 16
"""The same limits for fine bounces, and the number of rays in each pixel's lobe: the probes' view is as blurred as at roughness
0.5.
"""

OFF = 0.002
"""Distance in metres along a ray at which it begins, and offset from its hit at which rays towards lights begin."""

LAYERS = 3
"""Maximum number of surfaces on a ray, if they are blended with their background; the last one is solid."""

SKY_ROUGHNESS = np.float32(0.03)
"""Roughness of the sky map that is read: nearly sharp."""

SOME = 1 << 16
"""Number of pixels processed at a time: each takes about 300 bytes."""


def mirror_in_panes(
    baked: Baked, camera: Camera, visibility: Visibility, left_out: NDArray[np.intp], radiance: Float32
) -> None:
    """Replace the reflections of smooth surfaces in `radiance` (H * W, 4) by the results of rays, if light bounces, except in
    the pixels `left_out` (n,).
    """
    if baked.bounce_scene is None or baked.tree is None:
        return
    panes = _panes(baked, baked.bounce_scene, visibility, left_out)
    triangle, depth = visibility.triangle.reshape(-1), visibility.inverse_depth.reshape(-1)
    view, light = view_of(baked, camera, triangle=triangle), (baked.surrounding, baked.occlusion, baked.bounces)
    borders = (FINE_SHARP, FINE_BLURRED) if baked.is_fine else (SHARP, BLURRED)
    for start in range(0, len(panes), SOME):
        at = panes[start : start + SOME]
        gloss = np.empty((len(at), kernels_split.GLOSS), np.float32)
        kernels_split.gloss(view, baked.surfaces, baked.textures, baked.floor, *light, at, triangle, depth, gloss)
        away = np.ones(len(at)) if view.is_parallel else 1 / depth[at]
        width = (view.pixel * view.scale * away).astype(np.float32)
        if baked.is_fine:
            toward, normals = _facing(view, gloss)
            shown, is_known = _seen_in_lobes(baked, baked.bounce_scene, baked.tree, view, (toward, normals), gloss, at, width)
            made_of = baked.surfaces.material[triangle[at]]
            shown = kernels_mirror.shared(at, normals, made_of, gloss, shown, is_known, camera.width)
        else:
            sights = gloss[:, 7:10].copy(), gloss[:, 10:13].copy(), width
            shown, is_known = _seen(baked, baked.bounce_scene, baked.tree, sights, view.spread)
        at, gloss, shown = at[is_known].astype(np.intp), gloss[is_known], shown[is_known]
        nearness = np.zeros(len(at), np.float32)
        kernels_mirror.polish(at, gloss, shown, shown, nearness, depth, *map(np.float32, borders), radiance)


def _facing(view: PictureRays, gloss: Float32) -> tuple[Float32, Float32]:
    """Directions towards the viewer, and normals, (n, 3) each; gloss (n, 13): see `kernels_split.gloss`."""
    toward = np.tile(-view.rotation[2], (len(gloss), 1)) if view.is_parallel else view.eye - gloss[:, 7:10]
    toward /= np.sqrt((toward * toward).sum(axis=1, keepdims=True))
    normals = toward + gloss[:, 10:13]
    return toward, normals / np.maximum(np.sqrt((normals * normals).sum(axis=1, keepdims=True)), np.float32(1e-6))


def _seen_in_lobes(
    baked: Baked,
    bounce_scene: BounceScene,
    tree: Tree,
    view: PictureRays,
    facing: tuple[Float32, Float32],
    gloss: Float32,
    at: Int32,
    width: Float32,
) -> tuple[Float32, NDArray[np.bool_]]:
    """The mean radiance (n, 3) along `LOBE_RAYS` rays from each of the pixels `at` (n,), and whether there is any, (n,). Rays
    with an unknown result have the light that the pixel was assumed to mirror.

    facing: see `_facing`; gloss (n, 13): see `kernels_split.gloss`; width (n,): the width of a pixel there.
    """
    shown, known = np.zeros((len(at), 3), np.float32), np.zeros(len(at), np.bool_)
    toward, normals = facing
    taken = gloss[:, 3:6] / np.maximum(gloss[:, :3], np.float32(1e-6))
    for start in range(0, len(at), SOME // LOBE_RAYS):
        chunk = slice(start, start + SOME // LOBE_RAYS)
        ways, weights = lobe_rays(toward[chunk], normals[chunk], gloss[chunk, 6], at[chunk], int(view.columns), LOBE_RAYS)
        sights = np.tile(gloss[chunk, 7:10], (LOBE_RAYS, 1)), ways.reshape(-1, 3), np.tile(width[chunk], LOBE_RAYS)
        seen, is_known = _seen(baked, bounce_scene, tree, sights, view.spread)
        total = weights.sum(axis=0)
        each = np.where(is_known.reshape(*weights.shape, 1), seen.reshape(*weights.shape, 3), taken[chunk])
        shown[chunk] = (weights[..., None] * each).sum(axis=0) / np.maximum(total, np.float32(1e-6))[:, None]
        known[chunk] = total > 0
    return shown, known


def _panes(baked: Baked, bounce_scene: BounceScene, visibility: Visibility, left_out: NDArray[np.intp]) -> Int32:
    """Pixels (n,) that show a smooth surface of the bounce scene, and are not left out."""
    looks, shown = baked.surfaces.looks, visibility.triangle.reshape(-1)
    is_smooth = looks[:, L_ROUGH] + looks[:, L_ROUGH_TEXEL] < (FINE_BLURRED if baked.is_fine else BLURRED)
    is_pane = (shown >= 0) & is_smooth[baked.surfaces.material[shown]] & (baked.kind[shown] == kernels_paint.SOLID)
    is_pane[left_out] = False
    at = np.flatnonzero(is_pane)
    if not len(at):
        return at.astype(np.int32)
    return at[bounce_scene.owns[shown[at]]].astype(np.int32)


def _seen(
    baked: Baked, bounce_scene: BounceScene, tree: Tree, sights: tuple[Float32, Float32, Float32], pixel: float
) -> tuple[Float32, NDArray[np.bool_]]:
    """Radiance (n, 3) along rays, and whether it is known (n,). sights: origins of rays (n, 3), their directions of length 1
    (n, 3), and the width of a pixel there (n,), which grows by `pixel` per length.
    """
    origins, ways, width = sights
    off, ground = np.float32(OFF / bounce_scene.unit), bounce_scene.ground_z is not None
    origins, light = (origins + off * ways).astype(np.float32), np.zeros_like(origins)
    left, at = np.ones(len(origins), np.float32), np.arange(len(origins))
    is_known = np.ones(len(origins), np.bool_)
    for layer in range(LAYERS):
        turn = np.arange(len(at), dtype=np.int32)
        (met,), (far,) = cast(tree, origins[at], ways[at][:, None], turn, np.inf)
        on = at[met < 0]
        is_known[on] &= (not ground) | (ways[on, 2] >= 0)
        sky = np.empty((len(on), 3), np.float32)
        kernels_probes.sky_from(baked.surrounding, ways[on], SKY_ROUGHNESS, sky)
        light[on] += left[on, None] * sky
        at, far, met = at[met >= 0], far[met >= 0], met[met >= 0]
        origins[at] += far[:, None] * ways[at]
        width[at] += far * np.float32(pixel)
        shaded, opacity = _shaded(baked, bounce_scene, tree, off, (bounce_scene.which[met], origins[at], ways[at], width[at]))
        opacity = np.ones_like(opacity) if layer == LAYERS - 1 else opacity
        light[at] += (left[at] * opacity)[:, None] * shaded
        left[at] *= 1 - opacity
        at = at[left[at] > 0]
        origins[at] += off * ways[at]
        if not len(at):
            break
    return light, is_known


def _shaded(
    baked: Baked, bounce_scene: BounceScene, tree: Tree, off: np.float32, hits: tuple[Int32, Float32, Float32, Float32]
) -> tuple[Float32, Float32]:
    """Radiance (n, 3) of the hits of rays, computed as if they scattered all light, and its opacity (n,). hits: triangles (n,),
    places and the rays' directions (n, 3), and a pixel's width (n,).
    """
    triangle, places, ways, _ = hits
    answers, arrived, glow = (np.empty((len(places), columns), np.float32) for columns in (7, 3, 3))
    made = ANY_VIEW, bounce_scene.surfaces, bounce_scene.textures, bounce_scene.floor, baked.surrounding.albedo
    lights = without_maps(baked.lights)
    kernels_probes.shade_hits(*made, tree, lights, off, *hits, False, False, answers, arrived)
    normals, inside = bounce_scene.surfaces.normals[triangle], np.empty(len(places), np.float32)
    facing = np.where((normals * ways).sum(axis=1, keepdims=True) < 0, normals, -normals).astype(np.float32)
    kernels_probes.look_up(baked.bounces, places, facing, triangle, glow, inside)
    up = (1 + facing[:, 2:]) / 2
    elsewhere = up * baked.surrounding.up + (1 - up) * baked.surrounding.below
    light = arrived / np.float32(math.pi) + glow + (1 - inside[:, None]) * elsewhere
    shaded = answers[:, 3:6] + answers[:, :3] * light
    return np.minimum(shaded, BRIGHTEST).astype(np.float32), answers[:, 6].copy()


def lobe_rays(
    toward: Float32, normals: Float32, roughness: Float32, pixels: Int32, columns: int, count: int
) -> tuple[Float32, Float32]:
    """Directions (count, N, 3) from which rough surfaces reflect light towards the viewer, in the direction `toward` (N, 3),
    and their weights, (count, N), 0 for directions into the surface.

    GGX's visible normals (Dupuy and Benyoub, Sampling Visible GGX Normals with Spherical Caps, 2023), each weighted by its
    unshadowed share. normals (N, 3); roughness (N,); pixels (N,), with `columns` in a row: neighbours have different
    directions.
    """
    row, column = np.divmod(pixels, columns)
    steps = np.arange(count)[:, None]
    first = ((steps + 0.5) / count + PLASTIC[0] * column + PLASTIC[1] * row) % 1.0
    second = (steps * GOLDEN + PLASTIC[1] * column + (1 - PLASTIC[0]) * row) % 1.0
    axes = axes_along(normals)
    view = np.einsum("nij,nj->ni", axes, toward).astype(np.float64)
    view[:, 2] = np.maximum(view[:, 2], 1e-4)
    alpha = np.maximum(roughness.astype(np.float64) ** 2, SMOOTHEST)
    half = _visible(view, alpha, first, second)
    ways = 2 * (view * half).sum(axis=-1, keepdims=True) * half - view
    up = np.maximum(ways[..., 2], 0)
    weights = 2 * up / (up + np.sqrt(alpha * alpha + (1 - alpha * alpha) * up * up))
    return np.einsum("nij,kni->knj", axes, ways).astype(np.float32), weights.astype(np.float32)


def _visible(view: Float, alpha: Float, first: Float, second: Float) -> Float:
    """Visible normals (K, N, 3), in axes with the surface's normal along z, for numbers (K, N) in 0..1; view (N, 3), alpha
    (N,).
    """
    stretch = np.stack([alpha, alpha, np.ones_like(alpha)], axis=1)
    view = view * stretch
    view /= np.sqrt((view * view).sum(axis=1, keepdims=True))
    z = (1 - second) * (1 + view[:, 2]) - view[:, 2]
    radius, angle = np.sqrt(np.maximum(1 - z * z, 0)), 2 * math.pi * first
    half = (np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=-1) + view) * stretch
    return half / np.sqrt((half * half).sum(axis=-1, keepdims=True))
