"""OpenCV's fisheye model: an equidistant lens with a radial polynomial (Kannala and Brandt 2006)."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from viewsphere.geometry.lenses import Bounds, ColmapLens, Lens, LensParameters, LensSpec, OpenCVLens, Rays, central
from viewsphere.geometry.lenses.shared.bent import BentLens, bent_bounds, first_positive_root
from viewsphere.geometry.lenses.shared.warp import check_limit

Float = NDArray[np.float64]


class Fisheye(LensParameters, frozen=True):
    """k1 k2 k3 k4 of theta_d = theta (1 + k1 theta^2 + k2 theta^4 + ...)."""

    model: Literal["fisheye"] = Field(default="fisheye", description="OpenCV's fisheye model")
    coefficients: tuple[Annotated[float, Field(ge=-1e6, le=1e6)], ...] = Field(description="4 in OpenCV's order")

    @model_validator(mode="after")
    def _counted(self) -> Self:
        if len(self.coefficients) != 4:
            raise ValueError(f"fisheye: expected 4 coefficients, got {len(self.coefficients)}")
        check_limit(limit(self.coefficients))
        return self


def _rays(lens: Lens, xy: Float) -> Rays:
    """Unit rays, which may point sideways or back; NaN beyond the largest angle."""
    from viewsphere.geometry.lenses.shared import kernels_lens as kernels

    k, out = lens.parameters.coefficients, np.empty((len(xy), 3))
    kernels.rays_fisheye(np.array(k), limit(k), lens.intrinsics.K, xy, out)
    return central(out)


def _project(lens: Lens, points: Float) -> Float:
    """Positions of points up to the largest angle, including points behind the camera."""
    from viewsphere.geometry.lenses.shared import kernels_lens as kernels

    k, out = lens.parameters.coefficients, np.empty((len(points), 2))
    kernels.distort_fisheye(np.array(k), limit(k), points, out)
    return lens.positions(*out.T)


def _bounds(
    lens: Lens, R: Float, t: Float, vertices: Float, is_used: NDArray[np.bool_], triangles: NDArray[np.int32]
) -> tuple[Bounds | None, bool]:
    """The box of the bent edges, to 1e-5 px; triangles are cut at the limit."""
    k = lens.parameters.coefficients
    return bent_bounds(BentLens(True, k, limit(k), lens.intrinsics.K), R, t, vertices, is_used, triangles)


def _focal(_own: Fisheye, fov: float, extent: float) -> float:
    """The focal length without coefficients: the distance from the centre is this length times the angle."""
    return extent / fov


def _as_opencv(lens: Any) -> OpenCVLens:
    """The coefficients, unchanged."""
    return OpenCVLens(True, lens.parameters.coefficients)


def _as_colmap(lens: Any) -> ColmapLens:
    """The coefficients, unchanged."""
    return ColmapLens("OPENCV_FISHEYE", lens.parameters.coefficients)


@lru_cache(maxsize=64)
def limit(k: tuple[float, ...]) -> float:
    """The largest angle, radians, up to which the radius rises with the angle, so that the lens map is one-to-one."""
    slope = np.array([9 * k[3], 7 * k[2], 5 * k[1], 3 * k[0], 1.0])
    return min(math.pi, math.sqrt(first_positive_root(slope)))


LENS = LensSpec(
    parameters=Fisheye,
    rays=_rays,
    project=_project,
    bounds=_bounds,
    focal=_focal,
    as_opencv=_as_opencv,
    as_colmap=_as_colmap,
)
