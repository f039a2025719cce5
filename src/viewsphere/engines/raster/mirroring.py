"""What wet ground mirrors: the scene once more, as an eye below the ground sees it, which the mirror image of the eye does.

The film's own mirror image of the sky is part of its material; here is what things in front of that sky change. In puddles it
is sharp, in the film on rough ground it is drawn out along the picture's columns.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.wetting import FILM
from viewsphere.engines.raster.environment import sky_behind
from viewsphere.engines.raster.painting import NO_SPLIT, Baked, shade_all, view_of
from viewsphere.engines.raster.records import Float32
from viewsphere.geometry.camera import pixel_rays
from viewsphere.model.camera import Camera
from viewsphere.model.classes import STUFF_IDS
from viewsphere.model.weather import Wet
from viewsphere.surroundings.puddles import puddles
from viewsphere.truth.geometry import Geometry
from viewsphere.truth.visibility import Visibility, rasterize

Float = NDArray[np.float64]

LOW = 0.3
"""Metres above the ground up to which a surface mirrors, and is not mirrored: kerbs and pavements lie in between."""

LEVEL = 0.97
"""z of a normal from which on a surface mirrors."""

WATER = 0.02
"""Reflectance of water at normal incidence."""

PAVED = [STUFF_IDS[name] for name in ("ground", "scenery", "road", "road marking", "pavement")]
"""Classes that mirror."""

BRIGHTEST = 4.0
"""Radiance of what is mirrored, at most: highlights on it would dot the water."""

DRAWN_OUT = 30, 150
"""The picture's height over the reach of a film's blur, down and across."""

UNDER_WATER = 0.35
"""Share of a puddle's ground that is not seen for what swims in it."""


def mirror(baked: Baked, camera: Camera, visibility: Visibility, wet: Wet, radiance: Float32) -> None:
    """Add to `radiance` (H * W, 4) of a picture, in place, what its wet ground mirrors."""
    geometry, shown = baked.geometry, visibility.triangle.reshape(-1)
    plane = 0.0 if geometry.has_scenery or geometry.ground_z is None else geometry.ground_z  # in a place things stand on 0
    if camera.center[2] <= plane + LOW:
        return
    low = _low(geometry, plane)
    is_mirror = low & (geometry.triangle_normals[:, 2] > LEVEL) & np.isin(geometry.triangle_class, PAVED)
    at = np.flatnonzero((shown >= 0) & is_mirror[shown])
    if not len(at):
        return
    cosine, place = _looked_at(camera, visibility, at)
    water = (WATER + (1 - WATER) * (1 - cosine) ** 5).astype(np.float32)
    deep = puddles(wet, place[:, 0], place[:, 1])
    radiance[at, :3] *= 1 - (UNDER_WATER * deep)[:, None]
    things, sky = _mirrored(baked, _below(camera, plane), low, at)
    image = np.zeros_like(radiance[:, :3])
    image[at] = water[:, None] * things
    film = wet.amount * FILM * (1 - deep)[:, None] * _blurred(image, at, camera)
    pool = deep[:, None] * (image[at] + (1 - wet.amount * FILM) * water[:, None] * sky)
    radiance[at, :3] = np.maximum(radiance[at, :3] + film + pool, 0)


def _low(geometry: Geometry, plane: float) -> NDArray[np.bool_]:
    """Which triangles (T,) lie at the ground altogether."""
    height = geometry.vertices[:, 2]
    return np.max(height[geometry.triangles], axis=1) < plane + LOW


def _looked_at(camera: Camera, visibility: Visibility, at: NDArray[np.intp]) -> tuple[Float, Float]:
    """Cosines (n,) of these pixels' rays to the vertical, and the places (n, 3) of the world that they meet."""
    ray = pixel_rays(camera.intrinsics).reshape(-1, 3)[at] @ camera.R
    cosine = np.clip(-ray[:, 2] / np.linalg.norm(ray, axis=1), 0, 1)
    return cosine, camera.center + ray / visibility.inverse_depth.reshape(-1)[at][:, None]


def _below(camera: Camera, plane: float) -> Camera:
    """The mirror image of a camera in the ground: it sees things where their mirror images are."""
    turned = camera.R * np.array([1.0, 1.0, -1.0])
    center = camera.center * np.array([1.0, 1.0, -1.0]) + np.array([0.0, 0.0, 2 * plane])
    return Camera(camera.intrinsics, turned, -turned @ center)


def _mirrored(baked: Baked, below: Camera, low: NDArray[np.bool_], at: NDArray[np.intp]) -> tuple[Float32, Float32]:
    """The light (n, 3) of things that pixels mirror, less that of the sky behind them, and the sky's (n, 3)."""
    corner = baked.geometry.triangles[:, :1]
    risen = np.where(low[:, None], corner, baked.geometry.triangles)
    geometry = replace(baked.geometry, triangles=risen)
    own = replace(baked, geometry=geometry, blended=replace(baked.blended, triangles=risen))
    found, view = rasterize(geometry, below), view_of(baked, below)
    triangle, depth = np.full(found.triangle.size, -1, np.int32), np.zeros(found.triangle.size, np.float32)
    triangle[at], depth[at] = found.triangle.reshape(-1)[at], found.inverse_depth.reshape(-1)[at]
    light = np.zeros((len(triangle), 4), np.float32)
    shape = found.triangle.shape
    seen = Visibility(triangle.reshape(shape), depth.reshape(shape))
    shade_all(own, below, view, seen, triangle, depth, light, NO_SPLIT)
    sky = np.ones_like(light)
    sky[at] = 0  # looked up here alone
    sky_behind(view, baked.surrounding, sky)
    seen_light, hidden = np.minimum(light[at, :3], BRIGHTEST), light[at, 3:]
    return seen_light - hidden * sky[at, :3], sky[at, :3]


def _blurred(image: Float32, at: NDArray[np.intp], camera: Camera) -> Float32:
    """The mean (n, 3) of mirror images around each pixel of `at`, more of them above and below."""
    shape, there = (camera.height, camera.width), np.zeros(len(image), np.float32)
    there[at] = 1
    rows = np.concatenate([image, there[:, None]], axis=1).reshape(*shape, 4)
    for axis, part in enumerate(DRAWN_OUT):
        for _ in range(2):  # two boxes are nearly a bell
            rows = _box(rows, max(1, camera.height // part), axis)
    flat = rows.reshape(-1, 4)[at]
    return np.divide(flat[:, :3], np.maximum(flat[:, 3:], 1e-6), dtype=np.float32)


def _box(values: Float32, reach: int, axis: int) -> Float32:
    """Sums over `reach` neighbours on either side along an axis."""
    count = values.shape[axis]
    total = np.cumsum(values, axis=axis, dtype=np.float64)
    total = np.concatenate([np.zeros_like(np.take(total, [0], axis)), total], axis)
    ends = np.minimum(np.arange(count) + reach + 1, count), np.maximum(np.arange(count) - reach, 0)
    return (np.take(total, ends[0], axis) - np.take(total, ends[1], axis)).astype(np.float32)
