"""The omnidirectional model of Scaramuzza, Martinelli and Siegwart 2006: OCamCalib, and MATLAB's `fisheyeParameters`."""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated, Any, Literal, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from viewsphere.geometry.lenses import ColmapLens, LensParameters, LensSpec
from viewsphere.geometry.lenses.shared.bent import first_positive_root
from viewsphere.geometry.lenses.shared.image_plane import on_sphere, through_plane, unit
from viewsphere.geometry.lenses.shared.warp import ROUNDED, check_limit

Float = NDArray[np.float64]
Term = Annotated[float, Field(ge=-1e4, le=1e4)]

FARTHEST = 1e3
"""The largest radius, in focal lengths, that the lens shows, where its polynomial has no limit of its own."""

KNOTS = 4096
"""Number of radii in the table from which the inverse starts; a radius is searched between two of them."""

STEPS = 80
"""Maximum number of steps of the inverse; bisection alone would need 60."""


class Scaramuzza(LensParameters, frozen=True):
    """The ray at position (x, y), in focal lengths, is (x, y, 1 + c2 rho^2 + c3 rho^3 + ...), with rho its distance from the
    principal point.

    With OCamCalib's a0, a2, ..., in pixels and positive ahead, the focal length is a0, and c_n = a_n a0^(n - 1). Its table of
    the inverse (`invpol`) is an approximation and is not used. `shear` is added to y for each unit of x by the sensor.
    """

    model: Literal["scaramuzza"] = Field(default="scaramuzza", description="Scaramuzza's omnidirectional model")
    coefficients: tuple[Term, ...] = Field(min_length=1, max_length=11, description="c2 c3 c4 ...")
    shear: float = Field(default=0.0, ge=-0.5, le=0.5, description="y of the picture for each unit of x")

    @model_validator(mode="after")
    def _unfolded(self) -> Self:
        check_limit(float(_table(self.coefficients).radii[-1]))
        return self


class _Table(NamedTuple):
    """Radii (K,) up to the limit, and the `_pseudo_angle` of their rays, which rises."""

    radii: Float
    angles: Float


@lru_cache(maxsize=64)
def _table(c: tuple[float, ...]) -> _Table:
    """The rays' angle to the axis rises with rho while 1 - c2 rho^2 - 2 c3 rho^3 - ... is positive."""
    falling = np.array([-(n + 1) * term for n, term in reversed(list(enumerate(c)))] + [0.0, 1.0])
    limit = min(first_positive_root(falling), FARTHEST)
    radii = limit * np.linspace(0.0, 1.0, KNOTS) ** 2
    return _Table(radii, np.maximum.accumulate(_pseudo_angle(radii, _height(c, radii)[0])))


def _height(c: tuple[float, ...], rho: Float) -> tuple[Float, Float]:
    """The z of rays at radii, and its derivative."""
    height, slope = np.zeros_like(rho), np.zeros_like(rho)
    for term in (*reversed(c), 0.0, 1.0):
        slope = height + rho * slope
        height = term + rho * height
    return height, slope


def _pseudo_angle(r: Float, z: Float) -> Float:
    """A number from 0 to 2 that rises with the angle of (r, z) to the axis: the diamond angle, without sines."""
    return np.where(z >= 0, r / (r + np.abs(z)), 1 + np.abs(z) / (r + np.abs(z)))


def _to_plane(own: Scaramuzza, points: Float) -> Float:
    """Positions of points up to the limit."""
    x, y, z = on_sphere(points)
    r = np.sqrt(x * x + y * y)
    table, angle = _table(own.coefficients), _pseudo_angle(r, z)
    is_shown, rho = (angle <= table.angles[-1]) & ((r > 0) | (z > 0)), np.full(len(r), np.nan)
    rho[is_shown] = _radii(own.coefficients, r[is_shown], z[is_shown], angle[is_shown])
    scale = rho / np.where(r > 0, r, 1.0)
    u = x * scale
    return np.stack([u, y * scale + own.shear * u], axis=1)


def _radii(c: tuple[float, ...], r: Float, z: Float, angle: Float) -> Float:
    """The radii of rays within the limit, by Newton's method between the two radii of the table around each."""
    table = _table(c)
    knot = np.clip(np.searchsorted(table.angles, angle) - 1, 0, KNOTS - 2)
    radii, index = np.empty(len(r)), np.arange(len(r))
    low, high = table.radii[knot], table.radii[knot + 1]
    rho = (low + high) / 2
    for _ in range(STEPS):
        height, slope = _height(c, rho)
        error = rho * z - r * height  # below 0 inside the ray's radius
        low, high = np.where(error < 0, rho, low), np.where(error < 0, high, rho)
        steep = z - r * slope
        step = rho - error / np.where(steep == 0, 1.0, steep)
        following = np.where((step >= low) & (step <= high) & (steep != 0), step, (low + high) / 2)
        radii[index] = following
        # A step back to an end is rounding, and would go to and fro for ever.
        going = (np.abs(following - rho) > ROUNDED * rho) & (following > low) & (following < high)
        index = index[going]
        rho, low, high, r, z = (values[going] for values in (following, low, high, r, z))
        if not len(index):
            break
    return radii


def _from_plane(own: Scaramuzza, at: Float) -> Float:
    """Unit directions, by the polynomial alone; NaN beyond the limit."""
    x, y = at[:, 0], at[:, 1] - own.shear * at[:, 0]
    rho = np.sqrt(x * x + y * y)
    z = _height(own.coefficients, rho)[0]
    limit = _table(own.coefficients).radii[-1] * (1 - 1e-12)
    return unit(x, y, np.where(rho <= limit, z, np.nan))


def _as_colmap(lens: Any) -> ColmapLens | None:
    """COLMAP's DIVISION, if c2 is the only coefficient."""
    own = lens.parameters
    return None if len(own.coefficients) > 1 or own.shear else ColmapLens("DIVISION", own.coefficients)


LENS = LensSpec(parameters=Scaramuzza, as_colmap=_as_colmap, **through_plane(_to_plane, _from_plane))
