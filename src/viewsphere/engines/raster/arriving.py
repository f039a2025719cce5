"""Irradiance of a light on level ground, place by place, for the maps of the ground that are baked once."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.raster import kernels_block as rows
from viewsphere.engines.raster.kernels_arrive import arrive
from viewsphere.engines.raster.lights import Lights
from viewsphere.engines.raster.records import Float32


def arriving(lights: Lights, which: int, places: NDArray[np.floating[Any]], width: float) -> tuple[Float32, Float32]:
    """Unshadowed irradiance (N, 3) at places (N, 3) that face up, `width` apart; the share (N,) that shadows leave of it."""
    b = np.zeros((rows.ROWS, rows.BLOCK), np.float32)
    for row, value in ((rows.NZ, 1), (rows.GZ, 1), (rows.PIXEL, width)):
        b[row // rows.BLOCK] = value
    x, light = rows.PX // rows.BLOCK, rows.LZ // rows.BLOCK
    found = np.empty((5, len(places)), np.float32)
    for start in range(0, len(places), rows.BLOCK):
        count = min(rows.BLOCK, len(places) - start)
        b[x : x + 3, :count] = places[start : start + count].T
        arrive(count, lights, which, b.reshape(-1))
        found[:, start : start + count] = b[light : light + 5, :count]
    return (found[1:4] * np.maximum(found[0], 0)).T, found[4]
