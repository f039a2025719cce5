"""Mirror images in level surfaces: the scene rendered again from the camera's mirror image below the surface."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.raster.records import Float32
from viewsphere.engines.raster.reflections import kernels_mirror as kernels
from viewsphere.engines.raster.shading.painting import NO_SPLIT, Baked, shade_all, view_of
from viewsphere.engines.raster.sky.environment import sky_behind
from viewsphere.geometry.camera import inverse_camera_matrix
from viewsphere.geometry.rotation import product
from viewsphere.model.sensors.camera import Camera
from viewsphere.model.sensors.rolling import RowPoses
from viewsphere.truth.raster.alpha_masks import NEVER
from viewsphere.truth.raster.geometry import Geometry, with_both_sides
from viewsphere.truth.raster.rolling import centers_of, ways_of_rows
from viewsphere.truth.raster.visibility import Visibility, lens_rays_to, rasterize

Float = NDArray[np.float64]

BRIGHTEST = 4.0
"""Maximum radiance of mirrored things: brighter highlights would show as dots in the mirror."""


class _Mirrored(NamedTuple):
    """The mirror image in n pixels.

    things (n, 3): the radiance of things; hidden (n, 1): the share of the sky that they hide; sky (n, 3): the sky's radiance;
    nearness (n,): one over the depth of things from the camera's mirror image, 0 for none.
    """

    things: Float32
    hidden: Float32
    sky: Float32
    nearness: Float32


def lying(geometry: Geometry, height: float) -> NDArray[np.bool_]:
    """Return a mask of the triangles (T,) that are wholly below a height."""
    return geometry.triangle_tops < height


def looked_at(camera: Camera, visibility: Visibility, at: NDArray[np.intp]) -> tuple[Float, Float]:
    """Cosines (n,) of the angles between these pixels' rays and the vertical, and the world places (n, 3) where
    the rays end.
    """
    rays, camera_from_pixel = lens_rays_to(camera, visibility.inverse_depth), inverse_camera_matrix(camera.intrinsics)
    shifts = None
    if camera.rows is not None:
        turns, shifts = ways_of_rows(camera, camera.rows, {})
        row, column = np.indices(visibility.triangle.shape) + 0.5
        pixels = np.stack([column, row, np.ones_like(row)], axis=-1)
        rays = product(turns[0][:, None], pixels[..., None])[..., 0]
    table = np.zeros((0, 3)) if rays is None else rays.reshape(-1, 3)
    table.setflags(write=False)  # same type as for a lens, for one compilation
    cosine, place = np.empty(len(at)), np.empty((len(at), 3))
    pose, depth = (camera.R, camera.center), visibility.inverse_depth.reshape(-1)
    kernels.meet(at, camera.width, table, camera_from_pixel, *pose, depth, cosine, place)
    if shifts is not None:
        place += shifts[0, at // camera.width]
    if camera.lens.is_parallel:
        cosine[:] = max(-camera.R[2, 2], 0.0)
    return cosine, place


def is_above(camera: Camera, height: NDArray[np.float64] | float) -> NDArray[np.bool_]:
    """Return whether the camera may see level surfaces at these heights from above."""
    height = np.asarray(height, np.float64)
    if camera.lens.is_parallel:
        return np.full(height.shape, camera.R[2, 2] < 0)
    return height < camera.center[2]


def mirrored(baked: Baked, camera: Camera, plane: float, left_out: NDArray[np.bool_], at: NDArray[np.intp]) -> _Mirrored:
    """Return the image of a mirror at the height `plane` in the pixels `at` (n,), without the triangles `left_out` (T,)."""
    below = _below(camera, plane)
    geometry, blended = (_without(geometry, left_out) for geometry in (baked.geometry, baked.blended))
    mirror = replace(baked, geometry=geometry, blended=blended, is_fine=False)
    visibility = rasterize(geometry, below)
    baked.rows.write_seen(below, visibility, geometry)
    triangle, depth = np.full(visibility.triangle.size, -1, np.int32), np.zeros(visibility.triangle.size, np.float32)
    triangle[at], depth[at] = visibility.triangle.reshape(-1)[at], visibility.inverse_depth.reshape(-1)[at]
    light = np.zeros((len(triangle), 4), np.float32)
    shape = visibility.triangle.shape
    seen = Visibility(triangle.reshape(shape), depth.reshape(shape), active=visibility.active)
    shade_all(mirror, below, seen, triangle, depth, light, NO_SPLIT)
    sky = np.ones_like(light)
    sky[at] = 0  # read only here
    sky_behind(view_of(baked, below), baked.surrounding, sky)
    return _Mirrored(np.minimum(light[at, :3], BRIGHTEST), light[at, 3:], sky[at, :3], depth[at])


def _without(geometry: Geometry, left_out: NDArray[np.bool_]) -> Geometry:
    """The geometry without these triangles (T,), and with all others visible from both sides, because a mirror is not a
    camera.
    """
    return replace(with_both_sides(geometry), triangle_cutout=np.where(left_out, np.int32(NEVER), geometry.triangle_cutout))


def _below(camera: Camera, plane: float) -> Camera:
    """The mirror image of a camera in a level plane: it sees things at the places of their mirror images."""
    turned = camera.R * np.array([1.0, 1.0, -1.0])
    center = camera.center * np.array([1.0, 1.0, -1.0]) + np.array([0.0, 0.0, 2 * plane])
    return Camera(camera.intrinsics, turned, -turned @ center, camera.rows and _rows_below(camera.rows, plane))


def _rows_below(rows: RowPoses, plane: float) -> RowPoses:
    """The mirror image of the poses of rows."""
    flip = np.array([1.0, 1.0, -1.0])
    turned = rows.rotation * flip
    centers = centers_of(rows) * flip + np.array([0.0, 0.0, 2 * plane])
    return RowPoses(turned, -product(turned, centers[..., None])[..., 0], rows.moving)


def blurred(image: Float32, at: NDArray[np.intp], camera: Camera, reach: tuple[int, int]) -> Float32:
    """The mean (n, 3) of mirror images (n, 3) around each pixel of `at` (n,), over `reach` pixels down and across."""
    first, last = int(at.min()) // camera.width, int(at.max()) // camera.width
    rows = np.zeros((last - first + 1, camera.width, kernels.COLUMNS), np.float32)
    own = at - first * camera.width
    kernels.spread_out(own, image, rows.reshape(-1, kernels.COLUMNS))
    other = np.empty_like(rows)
    for _ in range(2):  # two boxes are nearly a Gaussian
        kernels.box_down(rows.reshape(len(rows), -1), reach[0], other.reshape(len(rows), -1))
        kernels.box_across(other, reach[1], rows)
    means = np.empty((len(at), 3), np.float32)
    kernels.gather_means(own, rows.reshape(-1, kernels.COLUMNS), means)
    return means
