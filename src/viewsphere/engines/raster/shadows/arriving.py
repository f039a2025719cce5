"""Irradiance of a light on level ground, place by place, for the baked maps of the ground."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.raster.records import Float32
from viewsphere.engines.raster.shadows.kernels_arriving import arrive_on_ground
from viewsphere.engines.raster.shadows.shadow_maps import Lights


def arriving(
    lights: Lights, which: int, places: NDArray[np.floating[Any]], width: float | NDArray[np.floating[Any]]
) -> tuple[Float32, Float32]:
    """Unshadowed irradiance (N, 3) at places (N, 3) that face up, and the share (N,) of it that shadows leave.

    `width` is the distance between places: one number, or one for each (N,).
    """
    light = np.empty((5, len(places)), np.float32)
    widths = np.full(len(places), width, np.float32)
    arrive_on_ground(lights, which, np.ascontiguousarray(places.T, np.float32), widths, light)
    return (light[1:4] * np.maximum(light[0], 0)).T, light[4]
