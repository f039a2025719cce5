"""A pinhole: pixels are K times points, and straight lines stay straight."""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.lenses import NEAR, Bounds, ColmapLens, Lens, LensParameters, LensSpec, OpenCVLens, Rays, central

Float = NDArray[np.float64]


class Pinhole(LensParameters, frozen=True):
    """No parameters besides K."""

    model: Literal["pinhole"] = "pinhole"


def _rays(lens: Lens, xy: Float) -> Rays:
    """Rays of z = 1."""
    i, out = lens.intrinsics, np.ones((len(xy), 3))
    out[:, 1] = (xy[:, 1] - i.cy) / i.fy
    out[:, 0] = (xy[:, 0] - i.cx - i.skew * out[:, 1]) / i.fx
    return central(out)


def _project(lens: Lens, points: Float) -> Float:
    """Positions of points in front of the camera."""
    z = np.where(points[:, 2] > 0, points[:, 2], np.nan)
    return lens.positions(points[:, 0] / z, points[:, 1] / z)


def _bounds(
    lens: Lens, R: Float, t: Float, vertices: Float, is_used: NDArray[np.bool_], triangles: NDArray[np.int32]
) -> tuple[Bounds | None, bool]:
    """The box of the corners; triangles that cross the plane z = NEAR of the camera are cut there."""
    from viewsphere.geometry.lenses.shared import kernels_linear as kernels

    k = lens.intrinsics.K
    x0, y0, x1, y1, front = kernels.whole_bounds(vertices, is_used, 0, k, R, t, NEAR)
    if front:
        return (x0, y0, x1, y1), True
    x0, y0, x1, y1, whole = kernels.cut_bounds(vertices, triangles, 0, len(triangles), 0, len(vertices), k, R, t, NEAR)
    return ((x0, y0, x1, y1) if x0 <= x1 else None), bool(whole)


def _field_of_view(lens: Lens) -> tuple[float, float]:
    """Angles through the principal point."""
    i = lens.intrinsics
    across = math.atan(i.cx / i.fx) + math.atan((i.width - i.cx) / i.fx)
    return math.degrees(across), math.degrees(math.atan(i.cy / i.fy) + math.atan((i.height - i.cy) / i.fy))


def _as_opencv(lens: Any) -> OpenCVLens:
    """No coefficients."""
    return OpenCVLens(False, ())


def _as_colmap(_lens: Any) -> ColmapLens:
    """No parameters."""
    return ColmapLens("PINHOLE", ())


LENS = LensSpec(
    parameters=Pinhole,
    rays=_rays,
    project=_project,
    has_unit_rays=False,
    is_linear=True,
    bounds=_bounds,
    field_of_view=_field_of_view,
    as_opencv=_as_opencv,
    as_colmap=_as_colmap,
)
