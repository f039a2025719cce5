"""An orthographic camera: all rays are parallel to its axis, and a metre covers equally many pixels at any distance.

K maps x and y in camera axes, metres, to pixels: fx and fy are pixels a metre.
"""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from viewsphere.geometry.lenses import NEAR, BlenderLens, Bounds, Calibration, Lens, LensOptions, LensParameters, LensSpec, Rays

Float = NDArray[np.float64]

WIDEST = 1e6
"""Largest width of a picture in metres: float32 pictures of larger scenes would show the rounding of their coordinates."""

NARROWEST = 1e-6
"""Smallest width of a picture in metres: light shows no details of a smaller scene, and the squares of a pixel's size underflow
far below it.
"""


class Orthographic(LensParameters, frozen=True):
    """No parameters besides K."""

    model: Literal["orthographic"] = "orthographic"


class OrthographicOptions(LensOptions, frozen=True):
    """The width of the picture in the scene."""

    projection: Literal["orthographic"] = "orthographic"
    width_m: Annotated[float, Field(strict=True, ge=NARROWEST, le=WIDEST)] | None = Field(
        default=None,
        description="the width in metres that the picture spans, at any distance; required unless viewpoints have distance: "
        "{fill: ...}, which sets it for each frame",
    )

    @property
    def is_open(self) -> bool:
        """Return whether the width is not set."""
        return self.width_m is None


def _calibrate(options: OrthographicOptions, size: tuple[int, int]) -> Calibration:
    """Square pixels, and the axis in the middle of the picture; 1 m wide until viewpoints set the width."""
    scale = size[0] / (options.width_m or 1.0)
    return Calibration(scale, scale, size[0] / 2, size[1] / 2, Orthographic())


def _rays(lens: Lens, xy: Float) -> Rays:
    """Rays along the axis, which begin in the plane z = 0 of the camera."""
    i, origins, directions = lens.intrinsics, np.zeros((len(xy), 3)), np.zeros((len(xy), 3))
    origins[:, 1] = (xy[:, 1] - i.cy) / i.fy
    origins[:, 0] = (xy[:, 0] - i.cx - i.skew * origins[:, 1]) / i.fx
    directions[:, 2] = 1.0
    return Rays(origins, directions)


def _project(lens: Lens, points: Float) -> Float:
    """Positions of points in front of the camera."""
    xy = lens.positions(points[:, 0], points[:, 1])
    xy[~(points[:, 2] > 0)] = np.nan
    return xy


def _bounds(
    lens: Lens, R: Float, t: Float, vertices: Float, is_used: NDArray[np.bool_], triangles: NDArray[np.int32]
) -> tuple[Bounds | None, bool]:
    """The box of the corners; triangles that cross the plane z = NEAR of the camera are cut there."""
    x, y, z = (R[k, 0] * vertices[:, 0] + R[k, 1] * vertices[:, 1] + R[k, 2] * vertices[:, 2] + t[k] for k in range(3))
    xy, is_shown = lens.positions(x, y), is_used & (z >= NEAR)
    whole = bool(is_shown.sum() == is_used.sum())
    chosen = [xy[is_shown]] if whole else [xy[is_shown], _cuts(xy, z, triangles)]
    points = np.concatenate(chosen)
    if not len(points):
        return None, whole
    (x0, y0), (x1, y1) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    return (x0, y0, x1, y1), whole


def _cuts(xy: Float, z: Float, triangles: NDArray[np.int32]) -> Float:
    """Positions (N, 2) at which edges of triangles pass through the plane z = NEAR."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    edges = edges[(z[edges[:, 0]] < NEAR) != (z[edges[:, 1]] < NEAR)]
    (a, b), (za, zb) = xy[edges.T], z[edges.T]
    return a + (b - a) * ((NEAR - za) / (zb - za))[:, None]


def _field_of_view(lens: Lens) -> tuple[float, float]:
    """No angle: all rays are parallel."""
    return 0.0, 0.0


def _as_blender(lens: Lens) -> BlenderLens | None:
    """Blender's orthographic camera, unless pixels are skewed."""
    i = lens.intrinsics
    return None if i.skew else BlenderLens("ORTHO", lengths={"ortho_scale": i.width / i.fx})


LENS = LensSpec(
    parameters=Orthographic,
    options=OrthographicOptions,
    calibrate=_calibrate,
    rays=_rays,
    project=_project,
    has_unit_rays=False,
    is_parallel=True,
    as_blender=_as_blender,
    bounds=_bounds,
    field_of_view=_field_of_view,
)
