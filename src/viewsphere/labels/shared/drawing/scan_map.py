"""The points of a LiDAR as seen from above, ahead at the top."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from viewsphere.labels.shared.drawing.colors import color_of
from viewsphere.model.sample import Sample

Picture = NDArray[np.uint8]

SKY = (16, 18, 24)
GRID = (52, 56, 66)
LOW, HIGH = np.array([70.0, 80.0, 96.0]), np.array([225.0, 230.0, 236.0])
NEAREST, MOST = 2.0, 98.0
"""Minimum radius of the map in metres, and the percentage of points that it shows."""


def from_above(sample: Sample, size: int) -> Picture:
    """A picture (size, size, 3) of a sample's points: objects in their colours, with their boxes; other points are lighter the
    higher they are.

    The circles are at round distances; the sensor is in the middle.
    """
    rows = sample.channels["lidar"]
    xyz = rows["xyz"].astype(np.float64)
    reach = max(float(np.percentile(np.hypot(xyz[:, 0], xyz[:, 1]), MOST)) if len(rows) else 0.0, NEAREST)
    scale = size / (2 * reach)
    picture = Image.new("RGB", (size, size), SKY)
    pen = ImageDraw.Draw(picture)
    step = round_length(reach / 2)
    for i in range(1, math.ceil(reach * math.sqrt(2) / step) + 1):
        radius = i * step * scale
        pen.ellipse((size / 2 - radius, size / 2 - radius, size / 2 + radius, size / 2 + radius), outline=GRID)
    for o in sample.objects:
        if o.is_placed:
            ahead, left = o.box3d_camera[:, 2], -o.box3d_camera[:, 0]
            corners = np.column_stack((size / 2 - left * scale, size / 2 - ahead * scale))[[0, 1, 2, 3, 0]]
            pen.line([tuple(corner) for corner in corners.tolist()], fill=color_of(o.id), width=1)
    out = np.array(picture)
    column = np.floor(size / 2 - xyz[:, 1] * scale).astype(int)
    row = np.floor(size / 2 - xyz[:, 0] * scale).astype(int)
    inside = (column >= 0) & (column < size) & (row >= 0) & (row < size)
    order = np.flatnonzero(inside)[np.argsort(xyz[inside, 2], kind="stable")]  # high points last
    out[row[order], column[order]] = _colors(rows, xyz[:, 2])[order]
    return out


def _colors(rows: NDArray[np.void], height: NDArray[np.float64]) -> Picture:
    """The colour of each point, (N, 3)."""
    low, high = np.percentile(height, (1, 99)) if len(height) else (0.0, 1.0)
    share = np.clip((height - low) / max(high - low, 1e-6), 0.0, 1.0)[:, None]
    out = (LOW + share * (HIGH - LOW)).astype(np.uint8)
    for instance in np.unique(rows["instance"]).tolist():
        if instance:
            out[rows["instance"] == instance] = color_of(instance)
    return out


def round_length(length: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is at most this length."""
    power = 10.0 ** math.floor(math.log10(length))
    return max(times * power for times in (1, 2, 5) if times * power <= length)
