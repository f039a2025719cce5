"""Panoramas: columns are azimuths around the camera's y axis, rows are elevations or heights on a cylinder."""

from __future__ import annotations

import math

import numpy as np

from viewsphere.geometry.lenses.shared.kernels_lens import azimuth_from
from viewsphere.geometry.lenses.shared.kernels_scan import is_above, steepest
from viewsphere.kernels.jit import njit

ROUNDING = 1e-12
"""Radians by which a position at the border of a full turn or at a pole may exceed it."""


@njit
def rays(is_cylinder, limit, matrix, xy, out):
    """Unit rays through positions xy (N, 2); NaN beyond a full turn around the middle, and beyond the elevation `limit`."""
    for i in range(xy.shape[0]):
        u = (xy[i, 0] - matrix[0, 2]) / matrix[0, 0]
        v = (xy[i, 1] - matrix[1, 2]) / matrix[1, 1]
        elevation = -math.atan(v) if is_cylinder else -v
        out[i, 0] = out[i, 1] = out[i, 2] = np.nan
        if abs(u) <= math.pi + ROUNDING and abs(elevation) <= limit + ROUNDING:
            level = 1.0 / math.sqrt(1.0 + v * v) if is_cylinder else math.cos(elevation)
            out[i, 0], out[i, 2] = level * math.sin(u), level * math.cos(u)
            out[i, 1] = level * v if is_cylinder else -math.sin(elevation)


@njit
def project(is_cylinder, limit, points, out):
    """Azimuth (-pi to pi, rightwards) and height (downwards; K applies to both) of camera points (N, 3); NaN beyond the
    elevation `limit` and at the camera's centre. Straight up and down have azimuth 0.
    """
    for i in range(points.shape[0]):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        level = math.sqrt(x * x + z * z)
        elevation = math.atan2(-y, level)
        out[i, 0] = out[i, 1] = np.nan
        if (level > 0.0 or y != 0.0) and abs(elevation) <= limit + ROUNDING:
            out[i, 0] = azimuth_from(0.0, x, z)
            out[i, 1] = y / level if is_cylinder else -elevation


@njit
def bounds(vertices, is_used, triangles, r, t, room):
    """Azimuths (left, right) and elevations (lowest, highest), radians, of triangles (n, 3), and how the azimuths lie: 0 from
    `left` to `right`, within half a turn; 1 around more than half a turn; 2 all around, above or below the centre.

    room (v, 5) then has each used vertex's azimuth in its last column; it is scratch. Azimuths are -pi to pi, and those of
    vertices to the last digit, so that the order of vertices changes nothing.
    """
    first, left, right, lowest, highest = np.nan, 0.0, 0.0, np.inf, -np.inf
    begin = end = 0.0
    for i in range(vertices.shape[0]):
        if is_used[i]:
            for c in range(3):
                room[i, c] = r[c, 0] * vertices[i, 0] + r[c, 1] * vertices[i, 1] + r[c, 2] * vertices[i, 2] + t[c]
            x, y, z = room[i, 0], room[i, 1], room[i, 2]
            room[i, 4] = math.atan2(x, z)
            if math.isnan(first):
                first = begin = end = room[i, 4]
            room[i, 3] = azimuth_from(first, x, z)
            if room[i, 3] < left:
                left, begin = room[i, 3], room[i, 4]
            if room[i, 3] > right:
                right, end = room[i, 3], room[i, 4]
            elevation = math.atan2(-y, math.sqrt(x * x + z * z))
            lowest, highest = min(lowest, elevation), max(highest, elevation)
    lies = 0 if right - left < math.pi else 1
    for f in range(triangles.shape[0]):
        around = 0.0
        for c in range(3):
            a, b = room[triangles[f, c]], room[triangles[f, (c + 1) % 3]]
            lowest, highest = steepest(a, b, lowest, highest)
            turned = b[3] - a[3]
            if abs(turned) > math.pi:
                turned -= math.copysign(2.0 * math.pi, turned)
            around += turned
        if abs(around) > math.pi:
            lies = 2
            if is_above(room[triangles[f, 0]], room[triangles[f, 1]], room[triangles[f, 2]]):
                highest = 0.5 * math.pi
            else:
                lowest = -0.5 * math.pi
    return begin, end, lowest, highest, lies
