"""Lenses that bend the plane of angles: a direction at angle theta from the axis is at radius theta of this plane."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.lenses.shared.image_plane import through_plane
from viewsphere.geometry.lenses.shared.warp import Map, warp_of

Float = NDArray[np.float64]

WIDEST = math.pi * (1 - 1e-12)
"""The largest angle; the direction straight behind the camera has no single position."""


def fisheye_functions(bend: Map) -> dict[str, Any]:
    """The functions of a `LensSpec` whose `coefficients` are those of this map of the plane of angles."""

    def to_plane(own: Any, points: Float) -> Float:
        from viewsphere.geometry.lenses.shared import kernels_angles as kernels

        at = np.empty((2, len(points)))
        kernels.to_angles(points, at)
        return np.stack(warp_of(bend, own.coefficients, WIDEST).forward(*at), axis=1)

    def from_plane(own: Any, at: Float) -> Float:
        from viewsphere.geometry.lenses.shared import kernels_angles as kernels

        x, y = warp_of(bend, own.coefficients, WIDEST).inverse(at[:, 0], at[:, 1])
        directions = np.empty((len(x), 3))
        kernels.from_angles(x, y, directions)
        return directions

    return through_plane(to_plane, from_plane)
