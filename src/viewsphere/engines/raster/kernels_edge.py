"""From samples to the picture: background sky, edge pixels, averages and the sRGB curve."""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from viewsphere.engines.raster.kernels_texture import FAST
from viewsphere.geometry.jit import njit

f4 = nb.float32
U = nb.uintp


@njit
def seen_samples(triangle, wanted):
    """Indices (int32) of the samples whose triangle is wanted: (T + 1,) bool, the last entry for triangle -1."""
    count = 0
    for i in range(triangle.shape[0]):
        count += wanted[triangle[i]]
    found = np.empty(count, np.int32)
    count = 0
    for i in range(triangle.shape[0]):
        if wanted[triangle[i]]:
            found[count] = i
            count += 1
    return found


@njit
def edge_pixels(triangle, depth, fine_triangle, fine_depth, owner, normals):
    """Pixels whose four quarters do not all show the surface at the centre, flat indices int32.

    owner (T,) int32: equal where neighbouring triangles look alike (same object and material); normals (T, 3).
    """
    height, width = triangle.shape
    found = np.empty(height * width, np.int32)
    count = 0
    for y in range(height):
        for x in range(width):
            t = triangle[y, x]
            edge = False
            for s in range(4):
                v, u = 2 * y + (s >> 1), 2 * x + (s & 1)
                q = fine_triangle[v, u]
                if q == t:
                    continue
                if q < 0 or t < 0 or owner[q] != owner[t]:
                    edge = True
                    break
                bend = abs(normals[q, 0] * normals[t, 0] + normals[q, 1] * normals[t, 1] + normals[q, 2] * normals[t, 2])
                ratio = fine_depth[v, u] / depth[y, x]
                if bend < f4(0.94) or ratio > f4(1.01) or ratio < f4(0.99):
                    edge = True
                    break
            if edge:
                found[count] = y * width + x
                count += 1
    return found[:count].copy()


@njit
def quarters(pixels, width, fine_triangle, fine_depth, background):
    """The four samples of each pixel: index in the fine grid, triangle, inverse depth, the pixel's background."""
    n = pixels.shape[0]
    where = np.empty(4 * n, np.int32)
    triangle = np.empty(4 * n, np.int32)
    depth = np.empty(4 * n, np.float32)
    color = np.empty((4 * n, 3), np.float32)
    for i in range(n):
        y, x = pixels[i] // width, pixels[i] % width
        for s in range(4):
            v, u = 2 * y + (s >> 1), 2 * x + (s & 1)
            where[4 * i + s] = v * 2 * width + u
            triangle[4 * i + s] = fine_triangle[v, u]
            depth[4 * i + s] = fine_depth[v, u]
            for c in range(3):
                color[4 * i + s, c] = background[pixels[i], c]
    return where, triangle, depth, color


@njit
def average_quarters(pixels, samples, color):
    """Replace each pixel's colour by the mean of its four samples (both linear)."""
    for i in range(pixels.shape[0]):
        for c in range(3):
            total = samples[4 * i, c] + samples[4 * i + 1, c] + samples[4 * i + 2, c] + samples[4 * i + 3, c]
            color[pixels[i], c] = total * f4(0.25)


@njit
def encode(color, curve):
    """Linear colours (N, 3) to sRGB bytes through a table over [0, 1]."""
    out = np.empty(color.shape, np.uint8)
    top = f4(curve.shape[0] - 1)
    for i in range(color.shape[0]):
        for c in range(3):
            out[i, c] = curve[U(nb.int32(min(max(color[i, c], f4(0)), f4(1)) * top + f4(0.5)))]
    return out


@njit(fastmath=FAST)
def sky_picture(view, light, knee, count):
    """The sky behind everything, (count, 3) float32 display-linear: a gradient, brighter around the sun.

    Black where the lens has no ray.
    """
    out = np.empty((count, 3), np.float32)
    one, zero = f4(1), f4(0)
    r = view.rotation
    for i in range(count):
        if view.rays.shape[0] > 0:
            a, b, c = view.rays[i, 0], view.rays[i, 1], view.rays[i, 2]
        else:
            row = nb.uint32(i) // view.columns
            column = nb.uint32(i) - row * view.columns
            px, py = f4(column) + f4(0.5), f4(row) + f4(0.5)
            a = view.lens[0, 0] * px + view.lens[0, 1] * py + view.lens[0, 2]
            b = view.lens[1, 0] * px + view.lens[1, 1] * py + view.lens[1, 2]
            c = one
        x = r[0, 0] * a + r[1, 0] * b + r[2, 0] * c
        y = r[0, 1] * a + r[1, 1] * b + r[2, 1] * c
        z = r[0, 2] * a + r[1, 2] * b + r[2, 2] * c
        if math.isnan(z):
            out[i] = zero
            continue
        s = one / f4(math.sqrt(x * x + y * y + z * z))
        up = min(max(z * s, zero), one)
        rest = (one - up) * (one - up) * (one - up)
        toward = max((x * light.sun[0] + y * light.sun[1] + z * light.sun[2]) * s, zero)
        p = toward * toward
        p *= p
        glow = p * f4(0.12) + p * p * p * p * p * p * f4(0.25)
        for k in range(3):
            v = light.zenith[k] + (light.horizon[k] - light.zenith[k]) * rest + glow * light.sun_color[k] * f4(0.32)
            over = max(v - knee, zero) / (one - knee)
            out[i, k] = min(v, knee) + (one - knee) * over / (one + over)
    return out
