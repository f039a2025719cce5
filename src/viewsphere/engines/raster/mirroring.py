"""What level surfaces mirror: the scene once more, as an eye below them sees it, which the mirror image of the eye does."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.raster import kernels_mirror as kernels
from viewsphere.engines.raster.environment import sky_behind
from viewsphere.engines.raster.painting import NO_SPLIT, Baked, shade_all, view_of
from viewsphere.engines.raster.records import Float32
from viewsphere.geometry.camera import pixel_rays
from viewsphere.model.camera import Camera
from viewsphere.truth.geometry import Geometry
from viewsphere.truth.visibility import Visibility, rasterize

Float = NDArray[np.float64]

BRIGHTEST = 4.0
"""Radiance of what is mirrored, at most: highlights on it would dot what mirrors it."""


class Mirrored(NamedTuple):
    """What n pixels mirror: things (n, 3), their radiance; hidden (n, 1), the share of the sky that they hide; sky (n, 3), its
    radiance; nearness (n,), one over the depth of things from the mirror image of the camera, 0 for none.
    """

    things: Float32
    hidden: Float32
    sky: Float32
    nearness: Float32


def lying(geometry: Geometry, height: float) -> NDArray[np.bool_]:
    """Which triangles (T,) lie below a height altogether."""
    below = np.concatenate([*(geometry.places(i)[:, 2] for i in range(len(geometry.poses))), geometry.ground[:, 2]]) < height
    return np.all(below[geometry.triangles], axis=1)


def looked_at(camera: Camera, visibility: Visibility, at: NDArray[np.intp]) -> tuple[Float, Float]:
    """Cosines (n,) of these pixels' rays to the vertical, and the places (n, 3) of the world that they meet."""
    ray = pixel_rays(camera.intrinsics).reshape(-1, 3)[at] @ camera.R
    cosine = np.clip(-ray[:, 2] / np.linalg.norm(ray, axis=1), 0, 1)
    return cosine, camera.center + ray / visibility.inverse_depth.reshape(-1)[at][:, None]


def mirrored(baked: Baked, camera: Camera, plane: float, left_out: NDArray[np.bool_], at: NDArray[np.intp]) -> Mirrored:
    """What a mirror at the height `plane` shows in the pixels `at` (n,), without the triangles `left_out` (T,)."""
    below = _below(camera, plane)
    corner = baked.geometry.triangles[:, :1]
    kept = np.where(left_out[:, None], corner, baked.geometry.triangles)
    geometry = replace(baked.geometry, triangles=kept)
    own = replace(baked, geometry=geometry, blended=replace(baked.blended, triangles=kept))
    found, view = rasterize(geometry, below), view_of(baked, below)
    baked.rows.write_seen(below, found, geometry)
    triangle, depth = np.full(found.triangle.size, -1, np.int32), np.zeros(found.triangle.size, np.float32)
    triangle[at], depth[at] = found.triangle.reshape(-1)[at], found.inverse_depth.reshape(-1)[at]
    light = np.zeros((len(triangle), 4), np.float32)
    shape = found.triangle.shape
    seen = Visibility(triangle.reshape(shape), depth.reshape(shape))
    shade_all(own, below, view, seen, triangle, depth, light, NO_SPLIT)
    sky = np.ones_like(light)
    sky[at] = 0  # looked up here alone
    sky_behind(view, baked.surrounding, sky)
    return Mirrored(np.minimum(light[at, :3], BRIGHTEST), light[at, 3:], sky[at, :3], depth[at])


def _below(camera: Camera, plane: float) -> Camera:
    """The mirror image of a camera in a level plane: it sees things where their mirror images are."""
    turned = camera.R * np.array([1.0, 1.0, -1.0])
    center = camera.center * np.array([1.0, 1.0, -1.0]) + np.array([0.0, 0.0, 2 * plane])
    return Camera(camera.intrinsics, turned, -turned @ center)


def blurred(image: Float32, at: NDArray[np.intp], camera: Camera, reach: tuple[int, int]) -> Float32:
    """The mean (n, 3) of mirror images (n, 3) around each pixel of `at` (n,), so many pixels down and across."""
    first, last = int(at.min()) // camera.width, int(at.max()) // camera.width
    rows = np.zeros((last - first + 1, camera.width, 4), np.float32)
    flat, own = rows.reshape(-1, 4), at - first * camera.width
    flat[own, :3], flat[own, 3] = image, 1
    other = np.empty_like(rows)
    for _ in range(2):  # two boxes are nearly a bell
        kernels.box_down(rows, reach[0], other)
        kernels.box_across(other, reach[1], rows)
    return np.divide(flat[own, :3], np.maximum(flat[own, 3:], 1e-6), dtype=np.float32)
