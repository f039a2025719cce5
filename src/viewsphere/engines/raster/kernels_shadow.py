"""Depth from far away: the sun's shadow map, and what the objects hide of the sky above the ground."""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from viewsphere.engines.raster.kernels_texture import look_up
from viewsphere.geometry.jit import njit

f4 = nb.float32
U = nb.uintp
BLOCK = 16


@njit
def nearest_depth(points, surfaces, textures, size):
    """Parallel projection: smallest depth over each cell's centre, (size, size) float32, infinity where none.

    points (V, 3) float64: column, row, depth. A surface is there where its alpha reaches its material's last
    column.
    """
    depth = np.full((size, size), np.inf, np.float32)
    uv = np.zeros(4, np.float32)
    sharp = np.zeros(4, np.float32)
    for t in range(surfaces.triangles.shape[0]):
        threshold = surfaces.materials[surfaces.material[t], 16]
        if threshold > f4(1):
            continue
        i, j, k = surfaces.triangles[t]
        ax, ay, az = points[i, 0], points[i, 1], points[i, 2]
        bx, by, bz = points[j, 0], points[j, 1], points[j, 2]
        cx, cy, cz = points[k, 0], points[k, 1], points[k, 2]
        left = max(0, math.ceil(min(ax, bx, cx) - 0.5))
        right = min(size - 1, math.floor(max(ax, bx, cx) - 0.5))
        top = max(0, math.ceil(min(ay, by, cy) - 0.5))
        bottom = min(size - 1, math.floor(max(ay, by, cy) - 0.5))
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if left > right or top > bottom or area == 0.0:
            continue
        r = 1.0 / area
        b0, b1, b2 = (cy - ay) * r, -(cx - ax) * r, (-ax * (cy - ay) + ay * (cx - ax)) * r
        c0, c1, c2 = -(by - ay) * r, (bx - ax) * r, (ax * (by - ay) - ay * (bx - ax)) * r
        slot = surfaces.slots[surfaces.material[t], 0]
        va, vb, vc = surfaces.vertices[i], surfaces.vertices[j], surfaces.vertices[k]
        for y in range(top, bottom + 1):
            for x in range(left, right + 1):
                beta = b0 * (x + 0.5) + b1 * (y + 0.5) + b2
                gamma = c0 * (x + 0.5) + c1 * (y + 0.5) + c2
                if beta < 0.0 or gamma < 0.0 or beta + gamma > 1.0:
                    continue
                z = f4(az + beta * (bz - az) + gamma * (cz - az))
                if z >= depth[U(y), U(x)]:
                    continue
                if threshold > f4(0):
                    g, h = f4(beta), f4(gamma)
                    alpha = va[10] + g * (vb[10] - va[10]) + h * (vc[10] - va[10])
                    alpha *= surfaces.materials[surfaces.material[t], 3]
                    if slot >= 0:
                        for n in range(4):
                            uv[n] = va[3 + n] + g * (vb[3 + n] - va[3 + n]) + h * (vc[3 + n] - va[3 + n])
                        alpha *= look_up(textures, slot, uv, sharp)[3]
                    if alpha < threshold:
                        continue
                depth[U(y), U(x)] = z
    return depth


@njit
def depth_bounds(depth):
    """Smallest and largest depth in and next to each block of cells, two (n, n) float32 arrays."""
    n = depth.shape[0] // BLOCK
    low = np.full((n, n), np.inf, np.float32)
    high = np.full((n, n), -np.inf, np.float32)
    for y in range(n * BLOCK):
        for x in range(n * BLOCK):
            z = depth[y, x]
            low[y // BLOCK, x // BLOCK] = min(low[y // BLOCK, x // BLOCK], z)
            high[y // BLOCK, x // BLOCK] = max(high[y // BLOCK, x // BLOCK], z)
    wide_low, wide_high = low.copy(), high.copy()
    for y in range(n):
        for x in range(n):
            for v in range(max(y - 1, 0), min(y + 2, n)):
                for u in range(max(x - 1, 0), min(x + 2, n)):
                    wide_low[y, x] = min(wide_low[y, x], low[v, u])
                    wide_high[y, x] = max(wide_high[y, x], high[v, u])
    return wide_low, wide_high


@njit
def sky_left(low, high, directions, reach):
    """Share of the sky's light that reaches the ground, (n, n) float32; objects are columns from low to high.

    low, high (n, n): heights above the ground in cells, low infinite where there is nothing. In each direction the
    elevations behind columns are struck from 64 bins of equal cosine-weighted solid angle.
    """
    n = low.shape[0]
    left = np.ones((n, n), np.float32)
    bins = 64.0
    full = nb.uint64(0xFFFFFFFFFFFFFFFF)
    one = nb.uint64(1)
    for y in range(n):
        for x in range(n):
            hidden = 0
            for d in range(directions):
                # Each cell of a 4 x 4 tile looks in other directions; blurring over a tile averages them.
                angle = (d + ((x & 3) * 4 + (y & 3)) / 16.0) * 2.0 * math.pi / directions
                dx, dy = math.cos(angle), math.sin(angle)
                mask = nb.uint64(0)
                r = 0.35
                while r < reach:
                    u, v = math.floor(x + 0.5 + r * dx), math.floor(y + 0.5 + r * dy)
                    if u < 0 or v < 0 or u >= n or v >= n:
                        break
                    bottom = float(low[v, u])
                    if bottom < 1e9:
                        top = max(float(high[v, u]), bottom)
                        inner = max(r - 0.5, 0.0)
                        first = int(bins * bottom * bottom / (bottom * bottom + (r + 0.5) ** 2))
                        last = int(bins * top * top / (top * top + inner * inner + 1e-9) + 0.5)
                        if last > first:
                            upper = full if last >= 64 else (one << nb.uint64(last)) - one
                            mask |= upper & ~((one << nb.uint64(first)) - one)
                    r = r * 1.15 + 0.35
                while mask:
                    mask &= mask - one
                    hidden += 1
            left[y, x] = f4(1.0 - hidden / (bins * directions))
    return left
