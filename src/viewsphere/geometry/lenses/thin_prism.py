"""OpenCV's whole lens model: rational, tangential and thin-prism terms, and a sensor that is tilted behind the lens."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from viewsphere.geometry.lenses import LensParameters, LensSpec, OpenCVLens
from viewsphere.geometry.lenses.shared.image_plane import through_plane
from viewsphere.geometry.lenses.shared.warp import Bent, check_unfolded, warp_of

Float = NDArray[np.float64]

STEEPEST = 1.2
"""Largest tilt of the sensor about an axis, radians; real ones (Scheimpflug) stay below 0.4."""


class ThinPrism(LensParameters, frozen=True):
    """k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 [tx ty] (https://docs.opencv.org/4.x/d9/d0c/group__calib3d.html)."""

    model: Literal["thin_prism"] = Field(default="thin_prism", description="OpenCV's model of 12 or 14 coefficients")
    coefficients: tuple[Annotated[float, Field(ge=-1e6, le=1e6)], ...] = Field(description="12 or 14 in OpenCV's order")

    @model_validator(mode="after")
    def _counted(self) -> Self:
        if len(self.coefficients) not in (12, 14):
            raise ValueError(f"thin_prism: expected 12 or 14 coefficients, got {len(self.coefficients)}")
        if max(map(abs, self.coefficients[12:]), default=0.0) > STEEPEST:
            raise ValueError(f"thin_prism: expected tilts within {STEEPEST} radians; found {self.coefficients[12:]}")
        check_unfolded(_bend, self.coefficients[:12])
        return self


def _bend(k: tuple[float, ...], x: Float, y: Float) -> Bent:
    """The map before the tilt."""
    k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4 = k
    s = x * x + y * y
    n, d = 1 + s * (k1 + s * (k2 + s * k3)), 1 + s * (k4 + s * (k5 + s * k6))
    d = np.where(d > 0, d, np.nan)
    g = n / d
    slope = 2 * (k1 + s * (2 * k2 + s * 3 * k3) - g * (k4 + s * (2 * k5 + s * 3 * k6))) / d
    u = x * g + 2 * p1 * x * y + p2 * (s + 2 * x * x) + s * (s1 + s2 * s)
    v = y * g + 2 * p2 * x * y + p1 * (s + 2 * y * y) + s * (s3 + s4 * s)
    mixed, across, down = x * y * slope + 2 * p1 * x + 2 * p2 * y, 2 * (s1 + 2 * s2 * s), 2 * (s3 + 2 * s4 * s)
    ux = g + x * x * slope + 2 * p1 * y + 6 * p2 * x + across * x
    vy = g + y * y * slope + 2 * p2 * x + 6 * p1 * y + down * y
    return Bent(u, v, ux, mixed + across * y, mixed + down * x, vy)


@lru_cache(maxsize=64)
def _tilt(coefficients: tuple[float, ...]) -> tuple[Float, Float]:
    """The homography (3, 3) of a tilted sensor, and its inverse."""
    tx, ty = (*coefficients[12:], 0.0, 0.0)[:2]
    cx, sx, cy, sy = math.cos(tx), math.sin(tx), math.cos(ty), math.sin(ty)
    turned = np.array([[cy, sx * sy, -sy * cx], [0.0, cx, sx], [sy, -sx * cy, cx * cy]])
    along = cx * cy
    ahead = np.array([[along, 0.0, sy * cx], [0.0, along, -sx], [0.0, 0.0, 1.0]])
    back = np.array([[1 / along, 0.0, -sy * cx / along], [0.0, 1 / along, sx / along], [0.0, 0.0, 1.0]])
    return _product(ahead, turned), _product(np.ascontiguousarray(turned.T), back)


def _product(a: Float, b: Float) -> Float:
    return (a[:, :, None] * b[None]).sum(axis=1)


def _through(homography: Float, x: Float, y: Float) -> tuple[Float, Float]:
    """Images of positions under a homography, NaN from its horizon on."""
    u, v, w = (row[0] * x + row[1] * y + row[2] for row in homography)
    w = np.where(w > 0, w, np.nan)
    return u / w, v / w


def _to_plane(own: ThinPrism, points: Float) -> Float:
    """Positions of points with z > 0 within the limit."""
    z = np.where(points[:, 2] > 0, points[:, 2], np.nan)
    bent = warp_of(_bend, own.coefficients[:12]).forward(points[:, 0] / z, points[:, 1] / z)
    return np.stack(_through(_tilt(own.coefficients)[0], *bent), axis=1)


def _from_plane(own: ThinPrism, at: Float) -> Float:
    """Rays of z = 1; NaN where `_to_plane` has no position."""
    bent = _through(_tilt(own.coefficients)[1], at[:, 0], at[:, 1])
    x, y = warp_of(_bend, own.coefficients[:12]).inverse(*bent)
    return np.stack([x, y, 0 * x + 1], axis=1)


def _as_opencv(lens: Any) -> OpenCVLens:
    """The coefficients, unchanged."""
    return OpenCVLens(False, lens.parameters.coefficients)


LENS = LensSpec(parameters=ThinPrism, has_unit_rays=False, as_opencv=_as_opencv, **through_plane(_to_plane, _from_plane))
