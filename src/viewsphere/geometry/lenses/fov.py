"""The FOV or ATAN model (Devernay and Faugeras 2001, https://doi.org/10.1007/PL00013269): COLMAP's FOV, Kalibr's fov."""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.geometry.lenses import ColmapLens, LensParameters, LensSpec
from viewsphere.geometry.lenses.shared.image_plane import through_plane

Float = NDArray[np.float64]


class Fov(LensParameters, frozen=True):
    """A point at r = tan(theta) is shown at radius atan(2 r tan(omega / 2)) / omega, in focal lengths."""

    model: Literal["fov"] = Field(default="fov", description="the FOV or ATAN model")
    omega: float = Field(ge=1e-3, le=3.1, description="the lens's field of view in radians; near 0: a pinhole")


def _to_plane(own: Fov, points: Float) -> Float:
    """Positions of points in front of the camera."""
    from viewsphere.geometry.lenses.shared import kernels_angles as kernels

    z = np.where(points[:, 2] > 0, points[:, 2], np.nan)
    x, y = points[:, 0] / z, points[:, 1] / z
    r, angle = np.sqrt(x * x + y * y), np.empty(len(points))
    kernels.arctangents(2 * math.tan(own.omega / 2) * r, angle)
    scale = np.where(r > 0, angle / np.where(r > 0, own.omega * r, 1.0), 2 * math.tan(own.omega / 2) / own.omega)
    return np.stack([x * scale, y * scale], axis=1)


def _from_plane(own: Fov, at: Float) -> Float:
    """Rays of z = 1; NaN from the radius on at which rays are at right angles to the axis."""
    from viewsphere.geometry.lenses.shared import kernels_angles as kernels

    r = np.sqrt(at[:, 0] * at[:, 0] + at[:, 1] * at[:, 1])
    angle, tangent = np.where(r * own.omega < math.pi / 2, r * own.omega, np.nan), np.empty(len(r))
    kernels.tangents(angle, tangent)
    slope = 2 * math.tan(own.omega / 2)
    scale = np.where(r > 0, tangent / np.where(r > 0, slope * r, 1.0), own.omega / slope)
    return np.stack([at[:, 0] * scale, at[:, 1] * scale, 0 * scale + 1], axis=1)


def _as_colmap(lens: Any) -> ColmapLens:
    """The same parameter."""
    return ColmapLens("FOV", (lens.parameters.omega,))


LENS = LensSpec(parameters=Fov, as_colmap=_as_colmap, has_unit_rays=False, **through_plane(_to_plane, _from_plane))
