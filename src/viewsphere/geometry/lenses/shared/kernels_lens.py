"""Lens models: the forward maps and their inverses by Newton's method."""

from __future__ import annotations

import math

import numpy as np

from viewsphere.kernels.jit import njit

TOLERANCE = 1e-14


@njit
def brown_conrady(k, x, y):
    """Distorted (x, y) and the map's Jacobian; k is k1 k2 p1 p2 k3 k4 k5 k6 and (x, y) the undistorted x/z, y/z."""
    s = x * x + y * y
    n = 1.0 + s * (k[0] + s * (k[1] + s * k[4]))
    d = 1.0 + s * (k[5] + s * (k[6] + s * k[7]))
    dn = k[0] + s * (2.0 * k[1] + s * 3.0 * k[4])
    dd = k[5] + s * (2.0 * k[6] + s * 3.0 * k[7])
    g, dg = n / d, 2.0 * (dn * d - n * dd) / (d * d)
    u = x * g + 2.0 * k[2] * x * y + k[3] * (s + 2.0 * x * x)
    v = y * g + k[2] * (s + 2.0 * y * y) + 2.0 * k[3] * x * y
    uy = x * y * dg + 2.0 * k[2] * x + 2.0 * k[3] * y
    ux = g + x * x * dg + 2.0 * k[2] * y + 6.0 * k[3] * x
    vy = g + y * y * dg + 6.0 * k[2] * y + 2.0 * k[3] * x
    return u, v, ux, uy, vy


@njit
def radial_brown(k, r):
    """r times the radial factor, and its derivative."""
    s = r * r
    n = 1.0 + s * (k[0] + s * (k[1] + s * k[4]))
    d = 1.0 + s * (k[5] + s * (k[6] + s * k[7]))
    dn = k[0] + s * (2.0 * k[1] + s * 3.0 * k[4])
    dd = k[5] + s * (2.0 * k[6] + s * 3.0 * k[7])
    return r * n / d, n / d + 2.0 * s * (dn * d - n * dd) / (d * d)


@njit
def radial_fisheye(k, theta):
    """Kannala and Brandt's theta_d, and its derivative."""
    s = theta * theta
    f = 1.0 + s * (k[0] + s * (k[1] + s * (k[2] + s * k[3])))
    return theta * f, 1.0 + s * (3.0 * k[0] + s * (5.0 * k[1] + s * (7.0 * k[2] + s * 9.0 * k[3])))


@njit
def invert_radial(k, fisheye, target, limit):
    """r in [0, limit] with radial(r) = target, NaN if there is none; the radial map rises up to `limit` (may be infinite)."""
    low, high = 0.0, limit
    if limit == np.inf:
        high = max(1.0, target)
        while radial_brown(k, high)[0] < target and high < 1e300:
            high *= 2.0
    r = min(target, high)
    if (radial_fisheye(k, high) if fisheye else radial_brown(k, high))[0] < target:
        return np.nan
    for number in range(200):
        value, slope = radial_fisheye(k, r) if fisheye else radial_brown(k, r)
        if value < target:
            low = r
        else:
            high = r
        step = (target - value) / slope if slope > 0.0 else np.inf
        following = r + step
        # Newton's method may jump between both ends for ever, so bisection follows its first 60 steps.
        if not low <= following <= high or number >= 60:
            following = 0.5 * (low + high)
        if abs(following - r) <= TOLERANCE * r:
            return following
        r = following
    return r


@njit
def rays_brown(k, limit, matrix, xy, out):
    """Undistorted rays (x, y, 1) through positions xy (N, 2); NaN beyond the range in which the lens map is one-to-one."""
    for i in range(xy.shape[0]):
        v = (xy[i, 1] - matrix[1, 2]) / matrix[1, 1]
        u = (xy[i, 0] - matrix[0, 2] - matrix[0, 1] * v) / matrix[0, 0]
        x, y = undistort_brown(k, limit, u, v)
        out[i, 0], out[i, 1], out[i, 2] = x, y, np.nan if math.isnan(x) else 1.0


@njit
def undistort_brown(k, limit, u, v):
    """(x/z, y/z) within radius `limit` that the lens maps to (u, v); NaN if there is none.

    Newton's method with step halving: inside the limit the Jacobian is positive definite, so it finds the only solution.
    """
    target = math.sqrt(u * u + v * v)
    r = invert_radial(k, False, target, limit)
    start = 0.99 * limit if np.isnan(r) else min(r, 0.99 * limit)
    scale = start / target if target > 0.0 else 1.0
    x, y = u * scale, v * scale
    fu, fv, ux, uy, vy = brown_conrady(k, x, y)
    for _ in range(100):
        determinant = ux * vy - uy * uy
        du, dv = u - fu, v - fv
        sx, sy = (vy * du - uy * dv) / determinant, (ux * dv - uy * du) / determinant
        if abs(sx) + abs(sy) <= TOLERANCE * (1.0 + abs(x) + abs(y)):
            return x, y
        step = 1.0
        while step > 1e-9:
            nx, ny = x + step * sx, y + step * sy
            fu, fv, ux, uy, vy = brown_conrady(k, nx, ny)
            closer = (u - fu) ** 2 + (v - fv) ** 2 < du * du + dv * dv
            if closer and nx * nx + ny * ny < limit * limit:
                break
            step *= 0.5
        if step <= 1e-9:
            small = du * du + dv * dv <= (1e-13 * (1.0 + target)) ** 2  # at the rounding floor, no step improves the result
            return (x, y) if small else (np.nan, np.nan)
        x, y = nx, ny
    return np.nan, np.nan


@njit
def rays_fisheye(k, limit, matrix, xy, out):
    """Unit rays through positions xy (N, 2) of the picture; NaN beyond the largest angle `limit`."""
    for i in range(xy.shape[0]):
        v = (xy[i, 1] - matrix[1, 2]) / matrix[1, 1]
        u = (xy[i, 0] - matrix[0, 2] - matrix[0, 1] * v) / matrix[0, 0]
        radius = math.sqrt(u * u + v * v)
        if radius == 0.0:
            out[i, 0], out[i, 1], out[i, 2] = 0.0, 0.0, 1.0
            continue
        theta = invert_radial(k, True, radius, limit)
        sine = math.sin(theta) / radius
        out[i, 0], out[i, 1] = u * sine, v * sine
        out[i, 2] = math.cos(theta)


@njit
def elevation_at(k, y):
    """Elevation, in radians, at row y of a scan; k holds the azimuth of the scan's middle, then the elevations of its rings."""
    count = k.shape[0] - 1
    row = y - 0.5
    ring = int(min(max(math.floor(row), 0.0), count - 1.0))
    following = ring + 1 if ring + 1 < count else ring
    return k[1 + ring] + (row - ring) * (k[1 + following] - k[following])


@njit
def row_of(k, elevation):
    """The row of a scan at this elevation: the inverse of `elevation_at`."""
    low, high = 0, k.shape[0] - 3  # the ring above the elevation, unless it is above or below all of them
    while low < high:
        middle = (low + high + 1) // 2
        if k[1 + middle] >= elevation:
            low = middle
        else:
            high = middle - 1
    return low + (k[1 + low] - elevation) / (k[1 + low] - k[2 + low]) + 0.5


@njit
def scan_ray(k, u, v):
    """Unit ray at azimuth u from a scan's middle and row v; NaN beyond a full turn, and beyond straight up and down."""
    elevation = elevation_at(k, v)
    if abs(u) > math.pi or abs(elevation) > 0.5 * math.pi:
        return np.nan, np.nan, np.nan
    level = math.cos(elevation)
    return level * math.sin(u + k[0]), -math.sin(elevation), level * math.cos(u + k[0])


@njit
def rays_scan(k, matrix, xy, out):
    """Unit rays through positions xy (N, 2); NaN beyond a full turn around the middle, and beyond straight up and down."""
    for i in range(xy.shape[0]):
        v = (xy[i, 1] - matrix[1, 2]) / matrix[1, 1]
        u = (xy[i, 0] - matrix[0, 2] - matrix[0, 1] * v) / matrix[0, 0]
        out[i, 0], out[i, 1], out[i, 2] = scan_ray(k, u, v)


@njit
def azimuth_from(turn, x, z):
    """Azimuth of a direction to the right of `turn`, within half a turn."""
    angle = math.atan2(x, z) - turn
    return angle - 2.0 * math.pi * math.floor((angle + math.pi) / (2.0 * math.pi))


@njit
def distort_scan(k, points, out):
    """Azimuth from a scan's middle, and row, of camera points (N, 3); NaN straight above and below, and at the centre."""
    for i in range(points.shape[0]):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        level = math.sqrt(x * x + z * z)
        out[i, 0] = out[i, 1] = np.nan
        if level > 0.0:
            out[i, 0], out[i, 1] = azimuth_from(k[0], x, z), row_of(k, math.atan2(-y, level))


@njit
def distort_brown(k, limit, points, out):
    """Distorted (x, y) of camera points (N, 3); NaN where z <= 0 or beyond the unfolded range."""
    for i in range(points.shape[0]):
        out[i, 0] = out[i, 1] = np.nan
        if points[i, 2] > 0.0:
            x, y = points[i, 0] / points[i, 2], points[i, 1] / points[i, 2]
            if math.sqrt(x * x + y * y) < limit:
                out[i, 0], out[i, 1] = brown_conrady(k, x, y)[:2]


@njit
def distort_fisheye(k, limit, points, out):
    """Distorted (x, y) of camera points (N, 3); NaN at the camera's centre, straight behind, and beyond angle `limit`."""
    for i in range(points.shape[0]):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        r = math.sqrt(x * x + y * y)
        theta = math.atan2(r, z)
        out[i, 0] = out[i, 1] = np.nan
        if r == 0.0 and z > 0.0:
            out[i, 0] = out[i, 1] = 0.0
        elif r > 0.0 and theta <= limit:
            scale = radial_fisheye(k, theta)[0] / r
            out[i, 0], out[i, 1] = x * scale, y * scale
