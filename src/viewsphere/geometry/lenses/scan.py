"""The rays of a LiDAR: rows are its rings, columns azimuths."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from viewsphere.geometry.lenses import Bounds, Lens, LensParameters, LensSpec, Rays, central

Float = NDArray[np.float64]
Degrees = Annotated[float, Field(ge=-90, le=90)]

CELLS = 128
"""Number of cells along a side of the cube around a scan; smaller cells are slower, because rows of rays are sparse."""


class Scan(LensParameters, frozen=True):
    """The rays of a LiDAR: each ring (a row of the picture) has one elevation, each column one azimuth.

    Azimuths are measured to the right from the picture's middle, which is `turn_deg` to the right of the z axis. K maps an
    azimuth (radians) to a column, and a ring's number + 0.5 to a row. Elevations are linear between rings; beyond the outermost
    rings they continue with the nearest step. The rows of a single ring are a degree apart.
    """

    model: Literal["scan"] = "scan"
    elevations_deg: tuple[Degrees, ...] = Field(min_length=1, description="elevation of each ring, highest first")
    turn_deg: float = Field(default=0.0, ge=-360, le=360, description="azimuth of the picture's middle, to the right")

    @model_validator(mode="after")
    def _falling(self) -> Self:
        for above, below in pairwise(self.elevations_deg):
            if above <= below:
                raise ValueError(f"expected elevations that fall from ring to ring; found {above:g}, then {below:g}")
        return self

    @property
    def numbers(self) -> tuple[float, ...]:
        """`turn_deg`, then the elevations, degrees."""
        return (self.turn_deg, *self.elevations_deg)


def _rays(lens: Lens, xy: Float) -> Rays:
    """Unit rays; NaN beyond a full turn around the scan's middle, and beyond straight up and down."""
    from viewsphere.geometry.lenses.shared import kernels_lens as kernels

    out = np.empty((len(xy), 3))
    kernels.rays_scan(_angles(lens.parameters), lens.intrinsics.K, xy, out)
    return central(out)


def _project(lens: Lens, points: Float) -> Float:
    """Positions of points in all directions except straight up and down."""
    from viewsphere.geometry.lenses.shared import kernels_lens as kernels

    out = np.empty((len(points), 2))
    kernels.distort_scan(_angles(lens.parameters), points, out)
    return lens.positions(*out.T)


def _bounds(
    lens: Lens, R: Float, t: Float, vertices: Float, is_used: NDArray[np.bool_], triangles: NDArray[np.int32]
) -> tuple[Bounds | None, bool]:
    """The box of azimuths and rows; the full circle if the triangles span it, or cross both the first and the last column."""
    from viewsphere.geometry.lenses.shared import kernels_scan

    i, room = lens.intrinsics, np.empty((len(vertices), 5))
    u0, v0, u1, v1 = kernels_scan.bounds(vertices, is_used, triangles, R, t, _angles(lens.parameters), room)
    assert i.skew == 0
    return (i.fx * u0 + i.cx, i.fy * v0 + i.cy, i.fx * u1 + i.cx, i.fy * v1 + i.cy), True


def _field_of_view(lens: Lens) -> tuple[float, float]:
    """The angle across all columns, and the angle from the lowest to the highest ring."""
    rings = lens.parameters.elevations_deg
    return math.degrees(lens.intrinsics.width / lens.intrinsics.fx), rings[0] - rings[-1]


def _angles(scan: Scan) -> Float:
    """The azimuth of the middle and the elevations, in radians, of at least two rings."""
    lone = (scan.elevations_deg[0] - 1.0,) if len(scan.elevations_deg) == 1 else ()
    return np.array([math.radians(angle) for angle in (*scan.numbers, *lone)])


LENS = LensSpec(
    parameters=Scan,
    rays=_rays,
    project=_project,
    is_scan=True,
    bounds=_bounds,
    field_of_view=_field_of_view,
    ray_cells=CELLS,
)
