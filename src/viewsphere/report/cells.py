"""The sphere of viewpoints cut into cells of azimuth and elevation, and the frames in each."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

WIDTHS = (30.0, 24.0, 22.5, 20.0, 18.0, 15.0, 12.0, 10.0, 9.0, 7.5, 6.0, 5.0)
"""Widths that a cell may have, degrees; each divides a full turn."""

FREE = 10.0
"""Cell width for viewpoints that are not on a grid, degrees."""

PER_DEGREE = 2
"""Steps per degree to which viewpoints are rounded before the search for a grid."""


@dataclass(frozen=True)
class _Cells:
    """Cells on the sphere: `azimuth` and `elevation` are (first edge, width) in degrees.

    `occupied` holds (column, row, frames): a cell spans the azimuths from first edge + column * width on, one width, and the
    elevations likewise, within -90 and 90.
    """

    azimuth: tuple[float, float]
    elevation: tuple[float, float]
    occupied: tuple[tuple[int, int, int], ...]


def sphere_cells(azimuth_deg: NDArray[np.floating], elevation_deg: NDArray[np.floating]) -> _Cells:
    """Count viewpoints in cells that fit them: centred on a grid's steps where they lie on one, else 10 degrees wide.

    So a regular grid fills its cells evenly, and the cells add no pattern of their own. Viewpoints that are NaN are left out.
    """
    known = np.isfinite(azimuth_deg) & np.isfinite(elevation_deg)
    azimuth = np.round(azimuth_deg[known].astype(np.float64), 4) % 360
    elevation = np.round(elevation_deg[known].astype(np.float64), 4)
    first_azimuth, width = _edges(azimuth, 360.0)
    first_elevation, height = _edges(elevation, 0.0)
    columns = np.floor(np.round((azimuth - first_azimuth) % 360 / width, 6)).astype(int) % round(360 / width)
    rows = np.floor(np.round((elevation - first_elevation) / height, 6)).astype(int)
    lowest = rows.min(initial=0)
    height_in_rows = rows.max(initial=0) - lowest + 1
    cells, counts = np.unique(columns * height_in_rows + rows - lowest, return_counts=True)
    found = zip(*np.divmod(cells, height_in_rows), counts, strict=True)
    occupied = tuple((int(column), int(row + lowest), int(count)) for column, row, count in found)
    return _Cells((first_azimuth, width), (first_elevation, height), occupied)


def _edges(degrees: NDArray[np.float64], turn: float) -> tuple[float, float]:
    """First edge and width of the cells of one coordinate; `turn` is 360 for azimuth, which comes round, else 0."""
    values = np.unique(np.round(degrees * PER_DEGREE).astype(int))
    step = math.gcd(*np.diff(values).tolist(), int(turn * PER_DEGREE)) / PER_DEGREE if len(values) else 0.0
    # A single elevation has no step.
    fitting = [w for w in WIDTHS if step == 0 or math.isclose(step / w, round(step / w))] if len(values) else []
    if not fitting or (step and step < WIDTHS[-1]):
        return (0.0 if turn else -90.0), FREE
    width = FREE if step == 0 else fitting[0]
    first = float(values[0]) / PER_DEGREE - width / 2
    return first, width
