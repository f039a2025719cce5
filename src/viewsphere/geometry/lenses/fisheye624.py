"""Project Aria's FISHEYE624, COLMAP's RAD_TAN_THIN_PRISM_FISHEYE: Kannala and Brandt's lens with tangential and prism terms."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from viewsphere.geometry.lenses import ColmapLens, LensParameters, LensSpec
from viewsphere.geometry.lenses.shared.fisheye_plane import WIDEST, fisheye_functions
from viewsphere.geometry.lenses.shared.warp import Bent, check_unfolded

Float = NDArray[np.float64]
Term = Annotated[float, Field(ge=-1e3, le=1e3)]


class Fisheye624(LensParameters, frozen=True):
    """k0 to k5, p0 p1, s0 to s3 (https://facebookresearch.github.io/projectaria_tools/docs/tech_insights/camera_intrinsic_models)."""

    model: Literal["fisheye624"] = Field(default="fisheye624", description="Project Aria's FISHEYE624")
    coefficients: tuple[Term, Term, Term, Term, Term, Term, Term, Term, Term, Term, Term, Term] = Field(
        description="k0 k1 k2 k3 k4 k5 p0 p1 s0 s1 s2 s3"
    )

    @model_validator(mode="after")
    def _unfolded(self) -> Self:
        check_unfolded(_bend, self.coefficients, WIDEST)
        return self


def _bend(k: tuple[float, ...], x: Float, y: Float) -> Bent:
    """The radial polynomial, then the tangential and prism terms of its result."""
    k0, k1, k2, k3, k4, k5, p0, p1, s0, s1, s2, s3 = k
    q = x * x + y * y
    g = 1 + q * (k0 + q * (k1 + q * (k2 + q * (k3 + q * (k4 + q * k5)))))
    slope = 2 * (k0 + q * (2 * k1 + q * (3 * k2 + q * (4 * k3 + q * (5 * k4 + q * 6 * k5)))))
    a, b = x * g, y * g
    ax, mixed, by = g + x * x * slope, x * y * slope, g + y * y * slope
    s, tilt = a * a + b * b, 2 * (p0 * a + p1 * b)
    u = a + tilt * a + p0 * s + s * (s0 + s1 * s)
    v = b + tilt * b + p1 * s + s * (s2 + s3 * s)
    across, down = 2 * (s0 + 2 * s1 * s), 2 * (s2 + 2 * s3 * s)
    ua, ub = 1 + tilt + 4 * p0 * a + across * a, 2 * p1 * a + (2 * p0 + across) * b
    va, vb = 2 * p0 * b + (2 * p1 + down) * a, 1 + tilt + 4 * p1 * b + down * b
    return Bent(u, v, ua * ax + ub * mixed, ua * mixed + ub * by, va * ax + vb * mixed, va * mixed + vb * by)


def _as_colmap(lens: Any) -> ColmapLens:
    """The same coefficients."""
    return ColmapLens("RAD_TAN_THIN_PRISM_FISHEYE", lens.parameters.coefficients)


LENS = LensSpec(parameters=Fisheye624, as_colmap=_as_colmap, **fisheye_functions(_bend))
