"""Lenses made of two functions: from camera axes to the plane to which K applies, and back."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.geometry.lenses import Lens, Rays, central

Float = NDArray[np.float64]


def through_plane(to_plane: Callable[[Any, Float], Float], from_plane: Callable[[Any, Float], Float]) -> dict[str, Any]:
    """The `rays`, `project` and `focal` of a `LensSpec`.

    `to_plane(parameters, points)` maps points (N, 3) in camera axes to positions (N, 2), in focal lengths from the principal
    point; `from_plane(parameters, positions)` maps them back to directions (N, 3). Both return NaN where the lens shows
    nothing.
    """

    def rays(lens: Lens, xy: Float) -> Rays:
        i = lens.intrinsics
        y = (xy[:, 1] - i.cy) / i.fy
        x = (xy[:, 0] - i.cx - i.skew * y) / i.fx
        return central(from_plane(lens.parameters, np.stack([x, y], axis=1)))

    def project(lens: Lens, points: Float) -> Float:
        return lens.positions(*to_plane(lens.parameters, points).T)

    def focal(parameters: Any, fov: float, extent: float) -> float:
        across, ahead = math.sin(fov / 2), math.cos(fov / 2)
        right, left = to_plane(parameters, np.array([[across, 0.0, ahead], [-across, 0.0, ahead]]))[:, 0].tolist()
        if not right > left:
            raise ValueError(f"expected an angle of view that the lens {parameters.model} shows; found {math.degrees(fov):g}")
        return extent / (right - left)

    return {"rays": rays, "project": project, "focal": focal}


def unit(x: Float, y: Float, z: Float) -> Float:
    """Directions (N, 3) of length 1 along vectors (x, y, z)."""
    length = np.sqrt(x * x + y * y + z * z)
    return np.stack([x / length, y / length, z / length], axis=1)


def on_sphere(points: Float) -> tuple[Float, Float, Float]:
    """The coordinates x, y and z of points (N, 3) scaled to distance 1; NaN at the camera's centre."""
    x, y, z = points.T
    length = np.sqrt(x * x + y * y + z * z)
    length[length == 0] = np.nan
    return x / length, y / length, z / length
