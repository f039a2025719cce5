"""How much of each light arrives at the samples of a block: distance, cone, and shadows that soften with distance.

Area lights: the light vector of a polygon (Lambert 1760).
"""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from viewsphere.engines.raster.kernels_block import (
    GX,
    GY,
    GZ,
    IB,
    IG,
    IR,
    LX,
    LY,
    LZ,
    NX,
    NY,
    NZ,
    PX,
    PY,
    PZ,
    SHARE,
    T0,
    WIDTH,
)  # fmt: skip
from viewsphere.engines.raster.kernels_look import FACING, look
from viewsphere.engines.raster.kernels_texture import FAST
from viewsphere.geometry.jit import njit

f4 = nb.float32
U = nb.uintp
DISTANT, POINT, SPOT, AREA = 0, 1, 2, 3
GRAZING = 0.02  # a plane's slope in a map is limited to that of a light this far above it


@njit(fastmath=FAST)
def _edge(ax, ay, az, bx, by, bz):
    """One edge's part of a polygon's light vector: the arc's length about the plane through both unit vectors."""
    one = f4(1)
    c = ax * bx + ay * by + az * bz
    y = min(abs(c), one)
    # Arc cosine: Abramowitz and Stegun 4.4.45.
    arc = np.sqrt(one - y) * (f4(1.5707288) + y * (f4(-0.2121144) + y * (f4(0.0742610) + y * f4(-0.0187293))))
    arc = arc if c >= f4(0) else f4(math.pi) - arc
    s = arc / np.sqrt(max(one - y * y, f4(1e-12)))
    s = s if y < f4(0.999999) else one
    return (ay * bz - az * by) * s, (az * bx - ax * bz) * s, (ax * by - ay * bx) * s


@njit(fastmath=FAST)
def _from_area(count, lights, k, b):
    """Direction and size (into T0) of the irradiance of a rectangle of unit strength; FACING: distance."""
    zero, one = f4(0), f4(1)
    cx, cy, cz = lights.place[k, 0], lights.place[k, 1], lights.place[k, 2]
    wx, wy, wz = lights.axis[k, 0], lights.axis[k, 1], lights.axis[k, 2]
    rx, ry, rz = lights.right[k, 0], lights.right[k, 1], lights.right[k, 2]
    ux, uy, uz = lights.up[k, 0], lights.up[k, 1], lights.up[k, 2]
    radius = lights.radius[k]
    across, along = rx * rx + ry * ry + rz * rz, ux * ux + uy * uy + uz * uz
    scale = f4(0.125) / max(f4(math.sqrt(across * along)), f4(1e-12))
    size = f4(math.sqrt(across + along))
    for i in range(count):
        x, y, z = cx - b[PX + i], cy - b[PY + i], cz - b[PZ + i]
        squared = x * x + y * y + z * z + f4(1e-12)
        inverse = one / np.sqrt(squared)
        lx, ly, lz = x * inverse, y * inverse, z * inverse
        front = max(-(lx * wx + ly * wy + lz * wz), zero)
        far = front / max(squared, radius * radius * f4(0.01))
        close = min(max(size * inverse * f4(10) - f4(0.5), zero), one)  # 0 below a twentieth, 1 from 0.15
        ax, ay, az = x - rx - ux, y - ry - uy, z - rz - uz
        dx, dy, dz = x + rx - ux, y + ry - uy, z + rz - uz
        ex, ey, ez = x + rx + ux, y + ry + uy, z + rz + uz
        gx, gy, gz = x - rx + ux, y - ry + uy, z - rz + uz
        s = one / np.sqrt(ax * ax + ay * ay + az * az + f4(1e-12))
        ax, ay, az = ax * s, ay * s, az * s
        s = one / np.sqrt(dx * dx + dy * dy + dz * dz + f4(1e-12))
        dx, dy, dz = dx * s, dy * s, dz * s
        s = one / np.sqrt(ex * ex + ey * ey + ez * ez + f4(1e-12))
        ex, ey, ez = ex * s, ey * s, ez * s
        s = one / np.sqrt(gx * gx + gy * gy + gz * gz + f4(1e-12))
        gx, gy, gz = gx * s, gy * s, gz * s
        px, py, pz = _edge(ax, ay, az, dx, dy, dz)
        qx, qy, qz = _edge(dx, dy, dz, ex, ey, ez)
        sx, sy, sz = _edge(ex, ey, ez, gx, gy, gz)
        tx, ty, tz = _edge(gx, gy, gz, ax, ay, az)
        px, py, pz = (px + qx + sx + tx) * scale, (py + qy + sy + ty) * scale, (pz + qz + sz + tz) * scale
        s = f4(-1) if px * lx + py * ly + pz * lz < zero else one
        s = s * close if front > zero else zero
        px, py, pz = px * s + lx * far * (one - close), py * s + ly * far * (one - close), pz * s + lz * far * (one - close)
        strength = np.sqrt(px * px + py * py + pz * pz)
        s = one / max(strength, f4(1e-20))
        dark = strength <= f4(1e-20)
        b[LX + i] = lx if dark else px * s
        b[LY + i] = ly if dark else py * s
        b[LZ + i] = lz if dark else pz * s
        b[T0 + i] = strength
        b[WIDTH + i] = min(radius * inverse, f4(0.5 * math.pi))
        b[FACING + i] = squared * inverse


@njit(fastmath=FAST)
def _from_place(count, lights, k, b):
    """Direction and size (into T0) of the irradiance of a point or spot of unit strength; FACING: distance."""
    zero, one = f4(0), f4(1)
    cx, cy, cz = lights.place[k, 0], lights.place[k, 1], lights.place[k, 2]
    wx, wy, wz = lights.axis[k, 0], lights.axis[k, 1], lights.axis[k, 2]
    radius, outer, ramp = lights.radius[k], lights.cone[k, 0], lights.cone[k, 1]
    for i in range(count):
        x, y, z = cx - b[PX + i], cy - b[PY + i], cz - b[PZ + i]
        squared = x * x + y * y + z * z + f4(1e-12)
        inverse = one / np.sqrt(squared)
        x, y, z = x * inverse, y * inverse, z * inverse
        inside = min(max((-(x * wx + y * wy + z * wz) - outer) * ramp, zero), one)
        b[LX + i], b[LY + i], b[LZ + i] = x, y, z
        b[T0 + i] = inside * inside * (f4(3) - inside - inside) / max(squared, radius * radius)
        b[WIDTH + i] = min(radius * inverse, f4(0.5 * math.pi))
        b[FACING + i] = squared * inverse


@njit(fastmath=FAST)
def arrive(count, lights, k, b):
    """Fill LX..LZ, IR..IB, SHARE and WIDTH of a block for light k.

    The irradiance faces the light and has no shadows in it; SHARE is the share they leave. Smooth normals on coarse triangles:
    the light fades before the first facet turns away from it.
    """
    zero, one = f4(0), f4(1)
    k = U(k)
    if lights.kind[k] == DISTANT:
        lx, ly, lz, width = lights.place[k, 0], lights.place[k, 1], lights.place[k, 2], lights.radius[k]
        for i in range(count):
            b[LX + i], b[LY + i], b[LZ + i], b[T0 + i], b[WIDTH + i], b[FACING + i] = lx, ly, lz, one, width, one
    elif lights.kind[k] == AREA:
        _from_area(count, lights, k, b)
    else:
        _from_place(count, lights, k, b)
    left = zero
    for i in range(count):
        lx, ly, lz = b[LX + i], b[LY + i], b[LZ + i]
        facing = b[GX + i] * lx + b[GY + i] * ly + b[GZ + i] * lz
        turned = b[NX + i] * lx + b[NY + i] * ly + b[NZ + i] * lz
        fade = min(max(turned, zero) / (f4(3) * abs(turned - facing) + f4(1e-6)), one)
        share = min(max(facing * f4(20), zero), one) * fade * fade * (f4(3) - fade - fade)
        share = share if b[T0 + i] > zero else zero
        b[SHARE + i] = share
        facing = max(facing, f4(GRAZING)) * b[FACING + i] if share > zero else zero
        b[FACING + i] = facing
        left += facing
    views, stop = lights.views, lights.first[k + U(1)]
    if left > zero and lights.first[k] < stop:
        window = np.empty(256, np.float32)
        for which in range(lights.first[k], stop):
            look(count, views.form, views.grid, views.depth, views.bounds, U(which), window, b)
    red, green, blue = lights.color[k, 0], lights.color[k, 1], lights.color[k, 2]
    for i in range(count):
        arrives = b[T0 + i]
        b[IR + i], b[IG + i], b[IB + i] = red * arrives, green * arrives, blue * arrives
