"""Reflections in wet ground: sharp in puddles, stretched along the picture's columns in the film on rough ground.

The material of a film already reflects the sky or, if light bounces, the probes' view. Here the scene's own mirror image
replaces this reflection.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from viewsphere.assets.appearance.wetting import FILM
from viewsphere.engines.raster.records import Float32
from viewsphere.engines.raster.reflections.mirroring import blurred, is_above, looked_at, lying, mirrored
from viewsphere.engines.raster.shading import kernels_paint, kernels_split
from viewsphere.engines.raster.shading.painting import Baked, view_of
from viewsphere.model.annotations.classes import STUFF_IDS
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.weather import Wet
from viewsphere.truth.raster.visibility import Visibility

Float = NDArray[np.float64]
OCTAVES = ((0.35, 0.6), (0.9, 0.3), (2.6, 0.1))
"""Waves per metre, and the weight of each octave."""

SHORE = 0.035
"""Share of the noise's range over which a puddle's border fades."""


LOW = 0.3
"""Height in metres above the ground up to which a surface mirrors, and is not mirrored: kerbs and pavements are below it."""

LEVEL = 0.97
"""Minimum z of the normal of a surface that mirrors."""

WATER = 0.02
"""Reflectance of water at normal incidence."""

PAVED = [STUFF_IDS[name] for name in ("ground", "scenery", "road", "road marking", "pavement")]
"""Classes that mirror."""

DRAWN_OUT = 30, 150
"""The picture's height over the reach of a film's blur, down and across."""

UNDER_WATER = 0.35
"""Share of a puddle's ground that murky water hides."""


def mirror_in_water(baked: Baked, camera: Camera, visibility: Visibility, wet: Wet, radiance: Float32) -> None:
    """Add the reflections of wet ground to `radiance` (H * W, 4) of a picture, in place."""
    geometry, shown = baked.geometry, visibility.triangle.reshape(-1)
    plane = 0.0 if geometry.has_scenery or geometry.ground_z is None else geometry.ground_z  # places have their ground at 0
    if not is_above(camera, plane + LOW):
        return
    low = lying(geometry, plane + LOW)
    is_mirror = low & (baked.surfaces.normals[:, 2] > LEVEL) & np.isin(geometry.triangle_class, PAVED)
    at = np.flatnonzero((shown >= 0) & is_mirror[shown])
    if not len(at):
        return
    cosine, place = looked_at(camera, visibility, at)
    water = WATER + (1 - WATER) * (1 - cosine) ** 5
    deep = puddles(wet, place[:, 0], place[:, 1])
    radiance[at, :3] *= 1 - (UNDER_WATER * deep)[:, None]
    seen = mirrored(baked, camera, plane, low, at)
    image = (seen.things + (1 - seen.hidden) * seen.sky).astype(np.float32)
    share, taken = _taken(baked, camera, visibility, at, (wet.amount * FILM * water).astype(np.float32), seen.sky)
    reach = max(1, camera.height // DRAWN_OUT[0]), max(1, camera.height // DRAWN_OUT[1])
    film = ((1 - deep) * share)[:, None] * blurred(image, at, camera, reach)
    pool = (deep * water)[:, None] * image
    radiance[at, :3] = np.maximum(radiance[at, :3] + film + pool - taken, 0)


def _taken(
    baked: Baked, camera: Camera, visibility: Visibility, at: NDArray[np.intp], share: Float32, sky: Float32
) -> tuple[Float32, Float32]:
    """The share of light that the films of pixels (n,) mirror, (n,), and the light that they were assumed to mirror, (n, 3):
    for the ground, that share of the `sky`.
    """
    triangle, depth = visibility.triangle.reshape(-1), visibility.inverse_depth.reshape(-1)
    is_thing = baked.kind[triangle[at]] != kernels_paint.FLOOR
    slots = at[is_thing].astype(np.int32)
    colors, light = np.empty((len(slots), 4), np.float32), (baked.surrounding, baked.occlusion, baked.bounces)
    kernels_split.film(
        view_of(baked, camera), baked.surfaces, baked.textures, baked.floor, *light, slots, triangle, depth, colors
    )
    taken = share[:, None] * sky
    share[is_thing], taken[is_thing] = colors[:, 3], colors[:, :3]
    return share, taken


def puddles(wet: Wet, x: Float, y: Float) -> NDArray[np.float32]:
    """Return the share of water at places of the floor, world metres, (n,): 1 in a puddle, 0 without water."""
    if not wet.puddles or not wet.amount:
        return np.zeros(len(x), np.float32)
    level = sum((weight * _noise(wet.seed + i, x * waves, y * waves) for i, (waves, weight) in enumerate(OCTAVES)), np.zeros(1))
    rise = np.clip((level - _least(wet.puddles)) / SHORE + 0.5, 0, 1)
    return (rise * rise * (3 - 2 * rise)).astype(np.float32)


def _least(share: float) -> float:
    """The level that a share of the floor exceeds: the noise is nearly normal, with mean 1/2 and deviation 0.132."""
    from statistics import NormalDist

    return NormalDist(0.5, 0.132).inv_cdf(min(max(1 - share, 1e-6), 1 - 1e-6))


def _noise(seed: int, x: Float, y: Float) -> Float:
    """Smooth numbers from 0 to 1: random values at integer places, with cubic interpolation between them."""
    column, row = np.floor(x), np.floor(y)
    across, down = ((v - i) ** 2 * (3 - 2 * (v - i)) for v, i in ((x, column), (y, row)))
    i, j = column.astype(np.int64), row.astype(np.int64)
    upper = _random(seed, i, j) * (1 - across) + _random(seed, i + 1, j) * across
    lower = _random(seed, i, j + 1) * (1 - across) + _random(seed, i + 1, j + 1) * across
    return upper * (1 - down) + lower * down


def _random(seed: int, i: NDArray[np.int64], j: NDArray[np.int64]) -> Float:
    """A number in [0, 1) for a place: SplitMix64's last steps applied to a sum of its coordinates."""
    step = np.uint64(0x9E3779B97F4A7C15)
    state = _mixed(i.astype(np.uint64) * step + np.uint64(seed))
    return (_mixed(state + j.astype(np.uint64) * step) >> np.uint64(11)).astype(np.float64) / 2**53


def _mixed(x: NDArray[np.uint64]) -> NDArray[np.uint64]:
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))
