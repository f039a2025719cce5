"""The box of a projected model in a LiDAR's scan, whose columns are azimuths and whose rows are elevations.

Along an edge, which is an arc of the unit sphere, the azimuth is monotonic. The elevation has its extreme at an end, or where
the arc is level.
"""

from __future__ import annotations

import math

import numpy as np

from viewsphere.geometry.lenses.shared.kernels_lens import azimuth_from, row_of
from viewsphere.kernels.jit import inner, njit


@inner
def steepest(a, b, lowest, highest):
    """The range of elevations grown by those between two directions."""
    nx, ny, nz = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    steepest = math.atan2(math.sqrt(nx * nx + nz * nz), abs(ny))  # of the circle that the arc is a part of
    if steepest <= highest and -steepest >= lowest:
        return lowest, highest
    px, py, pz = ny * nx, -(nx * nx + nz * nz), ny * nz  # the circle's highest direction
    after = (a[1] * pz - a[2] * py) * nx + (a[2] * px - a[0] * pz) * ny + (a[0] * py - a[1] * px) * nz
    before = (py * b[2] - pz * b[1]) * nx + (pz * b[0] - px * b[2]) * ny + (px * b[1] - py * b[0]) * nz
    if after > 0.0 and before > 0.0:
        highest = max(highest, steepest)
    if after < 0.0 and before < 0.0:
        lowest = min(lowest, -steepest)
    return lowest, highest


@inner
def is_above(a, b, c):
    """Return whether the plane of a triangle passes above the centre rather than below it."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    return (nx * a[0] + ny * a[1] + nz * a[2]) * ny < 0.0


@njit
def bounds(vertices, is_used, triangles, r, t, k, room):
    """Azimuths from the scan's middle, in radians, and rows (u0, v0, u1, v1) of triangles (n, 3).

    The corners are vertices (v, 3), of which some are used; k as in `kernels_lens.elevation_at`; room (v, 5) is scratch. The
    azimuths span a full turn if an edge passes behind the middle.
    """
    left, right, lowest, highest = np.inf, -np.inf, np.inf, -np.inf
    for i in range(vertices.shape[0]):
        if is_used[i]:
            for c in range(3):
                room[i, c] = r[c, 0] * vertices[i, 0] + r[c, 1] * vertices[i, 1] + r[c, 2] * vertices[i, 2] + t[c]
            x, y, z = room[i, 0], room[i, 1], room[i, 2]
            room[i, 3], room[i, 4] = azimuth_from(k[0], x, z), math.atan2(-y, math.sqrt(x * x + z * z))
            left, right = min(left, room[i, 3]), max(right, room[i, 3])
            lowest, highest = min(lowest, room[i, 4]), max(highest, room[i, 4])
    for f in range(triangles.shape[0]):
        around = 0.0
        for c in range(3):
            a, b = room[triangles[f, c]], room[triangles[f, (c + 1) % 3]]
            lowest, highest = steepest(a, b, lowest, highest)
            turned = b[3] - a[3]
            if abs(turned) > math.pi:
                left, right = -math.pi, math.pi
                turned -= math.copysign(2.0 * math.pi, turned)
            around += turned
        if abs(around) > math.pi:  # it is above or below the centre
            if is_above(room[triangles[f, 0]], room[triangles[f, 1]], room[triangles[f, 2]]):
                highest = 0.5 * math.pi
            else:
                lowest = -0.5 * math.pi
    return left, row_of(k, highest), right, row_of(k, lowest)
