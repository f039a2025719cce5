"""Points on triangles by their barycentrics, and the rays of a lens through arbitrary positions of its picture."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from viewsphere.truth.raster.geometry import Geometry
from viewsphere.truth.view import View

Float = NDArray[np.float64]
Whole = NDArray[np.int32]


def rays_through(view: View, xy: Float) -> Float:
    """Rays (N, 3) through positions (N, 2): (x, y, 1) if straight lines stay straight, otherwise as in
    `geometry.camera.pixel_rays`.
    """
    lens = view.camera.lens
    return np.column_stack((xy, np.ones(len(xy)))) if lens.is_straight else lens.rays(xy).directions


def weights_of(view: View, triangle: Whole, rays: Float) -> Float:
    """Barycentrics (N, 3) of rays (N, 3), as `rays_through` gives them, in triangles (N,) of the view."""
    from viewsphere.truth.surface_points import kernels_attached as kernels

    out = np.empty((len(triangle), 3))
    kernels.weights(view.geometry.triangles, triangle, view.corners, rays, out)
    return out


def stick(geometry: Geometry, triangle: Whole, weights: Float, out: Float) -> Float:
    """Write the world places of points (N, 3) on these triangles (N,), skipping points of triangle -1; returns `out`."""
    from viewsphere.truth.surface_points import kernels_attached as kernels

    kernels.stick(geometry.corners(triangle), triangle, weights, out)
    return out


def shifts(own: View, other: View) -> Whole:
    """Return the shifts of triangle numbers from one view to another, for each thing of a view and for the ground."""
    here, there = own.geometry.triangle_start, other.geometry.triangle_start
    count = min(len(here), len(there)) - 1
    out = np.zeros(len(here), np.int32)
    out[:count] = np.subtract(there[:count], here[:count])
    out[-1] = there[-1] - here[-1]
    return out
