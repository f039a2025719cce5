"""The enhanced unified camera model (Khomutenko, Garcia and Martinet 2016, https://doi.org/10.1109/LRA.2015.2502921)."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.geometry.lenses import ColmapLens, LensParameters, LensSpec
from viewsphere.geometry.lenses.shared.image_plane import on_sphere, through_plane, unit
from viewsphere.geometry.lenses.shared.unified import horizon, lifted

Float = NDArray[np.float64]


class Eucm(LensParameters, frozen=True):
    """A point is projected onto an ellipsoid, and then through a shifted pinhole; the unified model if beta is 1."""

    model: Literal["eucm"] = Field(default="eucm", description="the enhanced unified camera model")
    alpha: float = Field(ge=0, le=1, description="0: a pinhole")
    beta: float = Field(default=1.0, ge=1e-3, le=1e3, description="flattening of the ellipsoid; 1: a sphere")


def _to_plane(own: Eucm, points: Float) -> Float:
    """Positions of points beyond the ellipsoid's horizon are NaN."""
    x, y, z = on_sphere(points)
    away = np.sqrt(own.beta * (x * x + y * y) + z * z)
    below = own.alpha * away + (1 - own.alpha) * z
    below = np.where(z > -horizon(own.alpha) * away, below, np.nan)
    return np.stack([x / below, y / below], axis=1)


def _from_plane(own: Eucm, at: Float) -> Float:
    """Unit directions; NaN beyond the circle in which the lens shows all that it can."""
    return unit(*lifted(at, own.alpha, own.beta).T)


def _as_colmap(lens: Any) -> ColmapLens:
    """The same parameters."""
    return ColmapLens("EUCM", (lens.parameters.alpha, lens.parameters.beta))


LENS = LensSpec(parameters=Eucm, as_colmap=_as_colmap, **through_plane(_to_plane, _from_plane))
