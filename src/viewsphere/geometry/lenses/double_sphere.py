"""The double sphere model (Usenko, Demmel and Cremers 2018, https://arxiv.org/abs/1807.08957)."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.geometry.lenses import LensParameters, LensSpec
from viewsphere.geometry.lenses.shared.image_plane import on_sphere, through_plane
from viewsphere.geometry.lenses.shared.unified import horizon, lifted

Float = NDArray[np.float64]


class DoubleSphere(LensParameters, frozen=True):
    """A point is projected onto a unit sphere, then onto a second one, and then through a shifted pinhole."""

    model: Literal["double_sphere"] = Field(default="double_sphere", description="the double sphere model")
    xi: float = Field(gt=-1, lt=1, description="distance of the second sphere's centre ahead of the first one's")
    alpha: float = Field(ge=0, le=1, description="shift of the pinhole: alpha / (1 - alpha) ahead of the second centre")


def _to_plane(own: DoubleSphere, points: Float) -> Float:
    """Positions of points beyond the horizon of the second sphere are NaN."""
    x, y, z = on_sphere(points)
    z = own.xi + z
    away = np.sqrt(x * x + y * y + z * z)
    below = own.alpha * away + (1 - own.alpha) * z
    below = np.where(z > -horizon(own.alpha) * away, below, np.nan)
    return np.stack([x / below, y / below], axis=1)


def _from_plane(own: DoubleSphere, at: Float) -> Float:
    """Unit directions; NaN beyond the circle in which the lens shows all that it can."""
    x, y, z = lifted(at, own.alpha).T
    square = x * x + y * y
    scale = (z * own.xi + np.sqrt(z * z + (1 - own.xi * own.xi) * square)) / (z * z + square)
    return np.stack([scale * x, scale * y, scale * z - own.xi], axis=1)


LENS = LensSpec(parameters=DoubleSphere, **through_plane(_to_plane, _from_plane))
