"""OpenCV's standard lens model: radial and tangential distortion (Brown and Conrady)."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from viewsphere.geometry.lenses import NEAR, Bounds, ColmapLens, Lens, LensParameters, LensSpec, OpenCVLens, Rays, central
from viewsphere.geometry.lenses.shared.bent import BentLens, bent_bounds, first_positive_root, padded
from viewsphere.geometry.lenses.shared.warp import check_limit

Float = NDArray[np.float64]


class BrownConrady(LensParameters, frozen=True):
    """k1 k2 p1 p2 [k3 [k4 k5 k6]] (https://docs.opencv.org/4.x/d9/d0c/group__calib3d.html)."""

    model: Literal["brown_conrady"] = Field(default="brown_conrady", description="OpenCV's standard model")
    coefficients: tuple[Annotated[float, Field(ge=-1e6, le=1e6)], ...] = Field(description="4, 5 or 8 in OpenCV's order")

    @model_validator(mode="after")
    def _counted(self) -> Self:
        if len(self.coefficients) not in (4, 5, 8):
            raise ValueError(f"brown_conrady: expected 4 or 5 or 8 coefficients, got {len(self.coefficients)}")
        check_limit(limit(self.coefficients))
        return self


def _rays(lens: Lens, xy: Float) -> Rays:
    """Undistorted rays of z = 1; NaN beyond the range in which the lens map is one-to-one."""
    from viewsphere.geometry.lenses.shared import kernels_lens as kernels

    k, out = lens.parameters.coefficients, np.empty((len(xy), 3))
    kernels.rays_brown(padded(k, 8), limit(k), lens.intrinsics.K, xy, out)
    return central(out)


def _project(lens: Lens, points: Float) -> Float:
    """Positions of points with z > 0 within the limit."""
    from viewsphere.geometry.lenses.shared import kernels_lens as kernels

    k, out = lens.parameters.coefficients, np.empty((len(points), 2))
    kernels.distort_brown(padded(k, 8), limit(k), points, out)
    return lens.positions(*out.T)


def _bounds(
    lens: Lens, R: Float, t: Float, vertices: Float, is_used: NDArray[np.bool_], triangles: NDArray[np.int32]
) -> tuple[Bounds | None, bool]:
    """The box of the bent edges, to 1e-5 px; triangles are cut at the limit."""
    k = lens.parameters.coefficients
    inner = min(float(np.nextafter(limit(k), 0)), 1 / NEAR)
    bent = BentLens(False, tuple(padded(k, 8).tolist()), inner, lens.intrinsics.K)
    return bent_bounds(bent, R, t, vertices, is_used, triangles)


def _as_opencv(lens: Any) -> OpenCVLens:
    """The coefficients, unchanged."""
    return OpenCVLens(False, lens.parameters.coefficients)


def _as_colmap(lens: Any) -> ColmapLens:
    """OPENCV has four coefficients, FULL_OPENCV eight."""
    own = lens.parameters.coefficients
    return ColmapLens("OPENCV", own) if len(own) == 4 else ColmapLens("FULL_OPENCV", (*own, *[0.0] * (8 - len(own))))


def limit(coefficients: tuple[float, ...]) -> float:
    """The radius r/z, which may be infinite, up to which the lens map is one-to-one.

    Beyond it the distortion polynomial folds the picture back on itself, as no real lens does. The map's Jacobian is symmetric
    (the map is the gradient of a potential). Inside the limit it is positive definite everywhere, so the potential is convex
    and no two rays share a pixel.
    """
    return _limit(tuple(padded(coefficients, 8).tolist()))


@lru_cache(maxsize=64)
def _limit(k: tuple[float, ...]) -> float:
    numerator, denominator = np.array([k[4], k[1], k[0], 1.0]), np.array([k[7], k[6], k[5], 1.0])
    twice_s = np.array([2.0, 0.0])
    rising = np.polymul(np.polyadd(numerator, np.polymul(twice_s, np.polyder(numerator))), denominator)
    falling = np.polymul(twice_s, np.polymul(numerator, np.polyder(denominator)))
    slope = np.asarray(np.polysub(rising, falling), np.float64)
    radial = math.sqrt(min(first_positive_root(p) for p in (slope, numerator, denominator)))
    tangential = math.hypot(k[2], k[3])
    return radial if tangential == 0 else _tangential_limit(numerator, denominator, slope, tangential, radial)


def _tangential_limit(numerator: Float, denominator: Float, slope: Float, tangential: float, radial: float) -> float:
    """The radius, at most `radial`, up to which the Jacobian stays positive definite in spite of the tangential terms.

    In polar axes at angle psi from these terms' direction, with c, s = cos(psi), sin(psi), the Jacobian is
    [[a + 6 m c, -2 m s], [-2 m s, b + 2 m c]], where a and b are the radial map's derivative and factor, m = |p| r. The
    Jacobian's determinant is quadratic in c, so its least value over c has a closed form.
    """

    def definite(r: Float) -> NDArray[np.bool_]:
        s, m = r * r, tangential * r
        d = np.polyval(denominator, s)
        a, b = np.polyval(slope, s) / (d * d), np.polyval(numerator, s) / d
        inner = (a + 3 * b >= 16 * m) | (a * b - 4 * m * m > (a + 3 * b) ** 2 / 16)
        return (a > 6 * m) & (b > 2 * m) & inner

    radii = np.tan(np.linspace(0.0, min(math.atan(radial), 1.57), 8192))[:-1]
    good = definite(radii)
    if good.all():
        return min(radial, float(radii[-1]))
    first = int(np.argmin(good))
    low, high = float(radii[first - 1]), float(radii[first])
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if definite(np.array(middle)) else (low, middle)
    return low


LENS = LensSpec(
    parameters=BrownConrady,
    rays=_rays,
    project=_project,
    has_unit_rays=False,
    bounds=_bounds,
    as_opencv=_as_opencv,
    as_colmap=_as_colmap,
)
