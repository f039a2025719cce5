"""COLMAP's THIN_PRISM_FISHEYE: an equidistant lens with radial, tangential and thin-prism terms (Weng et al. 1992)."""

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


class ThinPrismFisheye(LensParameters, frozen=True):
    """k1 k2 p1 p2 k3 k4 sx1 sy1, in COLMAP's order (https://colmap.github.io/cameras.html)."""

    model: Literal["thin_prism_fisheye"] = Field(default="thin_prism_fisheye", description="COLMAP's THIN_PRISM_FISHEYE")
    coefficients: tuple[Term, Term, Term, Term, Term, Term, Term, Term] = Field(description="k1 k2 p1 p2 k3 k4 sx1 sy1")

    @model_validator(mode="after")
    def _unfolded(self) -> Self:
        check_unfolded(_bend, self.coefficients, WIDEST)
        return self


def _bend(k: tuple[float, ...], x: Float, y: Float) -> Bent:
    k1, k2, p1, p2, k3, k4, sx, sy = k
    s = x * x + y * y
    g = 1 + s * (k1 + s * (k2 + s * (k3 + s * k4)))
    slope = 2 * (k1 + s * (2 * k2 + s * (3 * k3 + s * 4 * k4)))
    u = x * g + 2 * p1 * x * y + p2 * (s + 2 * x * x) + sx * s
    v = y * g + 2 * p2 * x * y + p1 * (s + 2 * y * y) + sy * s
    mixed = x * y * slope + 2 * p1 * x + 2 * p2 * y
    ux = g + x * x * slope + 2 * p1 * y + 6 * p2 * x + 2 * sx * x
    vy = g + y * y * slope + 2 * p2 * x + 6 * p1 * y + 2 * sy * y
    return Bent(u, v, ux, mixed + 2 * sx * y, mixed + 2 * sy * x, vy)


def _as_colmap(lens: Any) -> ColmapLens:
    """The same coefficients."""
    return ColmapLens("THIN_PRISM_FISHEYE", lens.parameters.coefficients)


LENS = LensSpec(parameters=ThinPrismFisheye, as_colmap=_as_colmap, **fisheye_functions(_bend))
