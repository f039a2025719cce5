"""The unified model with distortion: OpenCV's `cv2.omnidir`, Kalibr's omni-radtan (Mei and Rives 2007)."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from viewsphere.geometry.lenses import LensParameters, LensSpec
from viewsphere.geometry.lenses.shared.image_plane import on_sphere, through_plane, unit
from viewsphere.geometry.lenses.shared.unified import horizon, lifted
from viewsphere.geometry.lenses.shared.warp import FARTHEST, Bent, Warp, check_unfolded, warp_of

Float = NDArray[np.float64]
Term = Annotated[float, Field(ge=-1e3, le=1e3)]


class Unified(LensParameters, frozen=True):
    """A point is projected onto a unit sphere, through a pinhole behind its centre, and then distorted (k1 k2 p1 p2)."""

    model: Literal["unified"] = Field(default="unified", description="the unified (omnidirectional) model of Mei and Rives")
    xi: float = Field(ge=0, le=100, description="distance of the pinhole behind the sphere's centre; 0: a pinhole")
    coefficients: tuple[Term, Term, Term, Term] = Field(default=(0.0, 0.0, 0.0, 0.0), description="k1 k2 p1 p2")

    @model_validator(mode="after")
    def _unfolded(self) -> Self:
        check_unfolded(_bend, self.coefficients)
        return self


def _bend(k: tuple[float, ...], x: Float, y: Float) -> Bent:
    k1, k2, p1, p2 = k
    s = x * x + y * y
    g, slope = 1 + s * (k1 + s * k2), 2 * k1 + 4 * s * k2
    u = x * g + 2 * p1 * x * y + p2 * (s + 2 * x * x)
    v = y * g + 2 * p2 * x * y + p1 * (s + 2 * y * y)
    mixed = x * y * slope + 2 * p1 * x + 2 * p2 * y
    return Bent(u, v, g + x * x * slope + 2 * p1 * y + 6 * p2 * x, mixed, mixed, g + y * y * slope + 2 * p2 * x + 6 * p1 * y)


def _warp(own: Unified) -> Warp:
    """The distortion within the circle in which the sphere projects."""
    farthest = 1 / math.sqrt(own.xi * own.xi - 1) if own.xi > 1 else FARTHEST
    return warp_of(_bend, own.coefficients, min(farthest, FARTHEST))


def _to_plane(own: Unified, points: Float) -> Float:
    """Positions of points beyond the sphere's horizon, and of those that the distortion folds back, are NaN."""
    x, y, z = on_sphere(points)
    below = np.where(z > -horizon(own.xi / (1 + own.xi)), z + own.xi, np.nan)
    return np.stack(_warp(own).forward(x / below, y / below), axis=1)


def _from_plane(own: Unified, at: Float) -> Float:
    """Unit directions; NaN where `_to_plane` has no position."""
    straight = np.stack(_warp(own).inverse(at[:, 0], at[:, 1]), axis=1)
    return unit(*lifted(straight * (1 + own.xi), own.xi / (1 + own.xi)).T)


LENS = LensSpec(parameters=Unified, **through_plane(_to_plane, _from_plane))
