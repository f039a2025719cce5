"""The places, in another view, of the points that pixels show. Rigid things need one matrix each, and no vertex is read.

A pixel's point is p / i in front of its camera: p is the pixel (x, y, 1) or its ray, and i = 1/s. So a rigid motion followed by
a projection is q = M (p, i), with one matrix (3, 4) for all points of a thing. If i = 0, the point is a direction, so the same
formula holds for the sky.

All arrays of pixels except `seen` (H, W) are flat, with the components of a pixel beside one another. Compilers vectorise a
loop over pixels only if the distance between its numbers is constant.
"""

from __future__ import annotations

import math

import numpy as np

from viewsphere.kernels.jit import inner, njit
from viewsphere.truth.kernel_constants import GONE, OTHER, RIGID, STILL

A, B, C, D = np.uintp(0), np.uintp(1), np.uintp(2), np.uintp(3)


@inner
def _thing(seen, owners, y, x, sky):
    t = seen[y, x]
    return owners[np.uintp(t)] if t >= 0 else sky


@inner
def _run(seen, owners, y, x, sky):
    """The thing that a pixel shows, and the first column after it that shows another thing."""
    t, stop = seen[y, np.uintp(x)], x + 1
    k = _thing(seen, owners, y, np.uintp(x), sky)
    while stop < seen.shape[1]:
        other = seen[y, np.uintp(stop)]
        if other != t and _thing(seen, owners, y, np.uintp(stop), sky) != k:
            break
        stop += 1
    return np.uintp(k), stop


@njit
def on_pinhole(seen, owners, inverse, rays, kinds, maps, xy, near):
    """Positions xy (H W 2,) in pixels and near (H W,), 1/z, of the points in a pinhole's view. `kinds` and `maps` (n, 3, 4) are
    for the things, then for the ground and for the sky.

    Behind the camera, xy is NaN and near is 0; if there is no point, both are NaN.
    """
    height, width = seen.shape
    sky, table = np.int32(kinds.shape[0] - 1), rays.shape[0] > 0
    for y in range(height):
        uy, row, x = np.uintp(y), y * width, 0
        while x < width:
            k, stop = _run(seen, owners, uy, x, sky)
            if kinds[k] == RIGID and table:
                _row_of_rays(maps[k], rays, inverse, row + x, row + stop, xy, near)
            elif kinds[k] == RIGID:
                _row(maps[k], inverse, y, row, x, stop, xy, near)
            elif kinds[k] == STILL:
                for i in range(x, stop):
                    p = row + i
                    xy[np.uintp(2 * p)], xy[np.uintp(2 * p + 1)], near[np.uintp(p)] = i + 0.5, y + 0.5, inverse[np.uintp(p)]
            elif kinds[k] == GONE:
                _fill(np.nan, 2 * (row + x), 2 * (row + stop), xy)
                _fill(np.nan, row + x, row + stop, near)
            x = stop


@inner
def _fill(value, first, stop, out):
    for p in range(first, stop):
        out[np.uintp(p)] = value


@inner
def _row(m, inverse, y, row, first, stop, xy, near):
    py = y + 0.5
    a0, a1, a2, c0, c1, c2 = m[A, A], m[B, A], m[C, A], m[A, D], m[B, D], m[C, D]
    b0, b1, b2 = m[A, B] * py + m[A, C], m[B, B] * py + m[B, C], m[C, B] * py + m[C, C]
    for i in range(first, stop):
        p, px = row + i, i + 0.5
        s = inverse[np.uintp(p)]
        w = a2 * px + b2 + c2 * s
        r = 1.0 / w if w > 0.0 else np.nan
        xy[np.uintp(2 * p)], xy[np.uintp(2 * p + 1)] = (a0 * px + b0 + c0 * s) * r, (a1 * px + b1 + c1 * s) * r
        near[np.uintp(p)] = s * r if w > 0.0 else 0.0


@inner
def _row_of_rays(m, rays, inverse, first, stop, xy, near):
    for p in range(first, stop):
        s = inverse[np.uintp(p)]
        u, v, w = _moved(m, rays[np.uintp(3 * p)], rays[np.uintp(3 * p + 1)], rays[np.uintp(3 * p + 2)], s)
        r = 1.0 / w if w > 0.0 else np.nan
        xy[np.uintp(2 * p)], xy[np.uintp(2 * p + 1)] = u * r, v * r
        near[np.uintp(p)] = s * r if w > 0.0 else np.nan if math.isnan(w) else 0.0


@inner
def _moved(m, px, py, pz, s):
    u, v, w = _turned(m, px, py, pz)
    return u + m[A, D] * s, v + m[B, D] * s, w + m[C, D] * s


@inner
def _turned(m, px, py, pz):
    return (
        m[A, A] * px + m[A, B] * py + m[A, C] * pz,
        m[B, A] * px + m[B, B] * py + m[B, C] * pz,
        m[C, A] * px + m[C, B] * py + m[C, C] * pz,
    )


@njit
def as_rays(seen, owners, inverse, rays, kinds, maps, unit, out, near):
    """Rays (H W 3,) towards the points in a distorted lens' view, and near (H W,), 1/s: the point is ray / near.

    Rays have length 1 if `unit` is set, otherwise z = 1 (NaN behind the camera). Both results are NaN if there is no point.
    """
    height, width = seen.shape
    sky, table = np.int32(kinds.shape[0] - 1), rays.shape[0] > 0
    for y in range(height):
        for x in range(width):
            k, p = np.uintp(_thing(seen, owners, np.uintp(y), np.uintp(x), sky)), np.uintp(y * width + x)
            if kinds[k] == OTHER:
                continue
            i = np.uintp(3) * p
            s = inverse[p] if kinds[k] != GONE else np.nan
            px, py, pz = (rays[i], rays[i + B], rays[i + C]) if table else (x + 0.5, y + 0.5, 1.0)
            u, v, w = _moved(maps[k], px, py, pz, s)
            if kinds[k] == STILL:
                u, v, w = px, py, pz  # both lenses are equal: the ray is the pixel's own
            length = math.sqrt(u * u + v * v + w * w) if unit else w
            r = 1.0 / length if length > 0.0 else np.nan
            if kinds[k] == STILL:
                r = 1.0
            out[i], out[i + B], out[i + C] = u * r, v * r, w * r
            near[p] = s * r if length > 0.0 else np.nan if math.isnan(w) else 0.0


@njit
def in_axes(seen, owners, inverse, rays, kinds, maps, out):
    """M (p, i) / i (H W 3,) of each pixel, NaN for the sky and if there is no point."""
    height, width = seen.shape
    sky, table = np.int32(kinds.shape[0] - 1), rays.shape[0] > 0
    for y in range(height):
        uy, row, x = np.uintp(y), y * width, 0
        while x < width:
            k, stop = _run(seen, owners, uy, x, sky)
            if kinds[k] == GONE:
                _fill(np.nan, 3 * (row + x), 3 * (row + stop), out)
            elif kinds[k] != OTHER and table:
                _places_of_rays(maps[k], rays, inverse, row + x, row + stop, out)
            elif kinds[k] != OTHER:
                _places(maps[k], inverse, y, row, x, stop, out)
            x = stop


@inner
def _places(m, inverse, y, row, first, stop, out):
    py = y + 0.5
    a0, a1, a2, d0, d1, d2 = m[A, A], m[B, A], m[C, A], m[A, D], m[B, D], m[C, D]
    b0, b1, b2, c0, c1, c2 = m[A, B] * py, m[B, B] * py, m[C, B] * py, m[A, C], m[B, C], m[C, C]
    for i in range(first, stop):
        p, px = row + i, i + 0.5
        near = inverse[np.uintp(p)]
        s = 1.0 / near if near > 0.0 else np.nan
        out[np.uintp(3 * p)] = (a0 * px + b0 + c0) * s + d0
        out[np.uintp(3 * p + 1)] = (a1 * px + b1 + c1) * s + d1
        out[np.uintp(3 * p + 2)] = (a2 * px + b2 + c2) * s + d2


@inner
def _places_of_rays(m, rays, inverse, first, stop, out):
    for p in range(first, stop):
        near = inverse[np.uintp(p)]
        s = 1.0 / near if near > 0.0 else np.nan
        px, py, pz = rays[np.uintp(3 * p)], rays[np.uintp(3 * p + 1)], rays[np.uintp(3 * p + 2)]
        u, v, w = _turned(m, px, py, pz)
        out[np.uintp(3 * p)], out[np.uintp(3 * p + 1)], out[np.uintp(3 * p + 2)] = (
            u * s + m[A, D],
            v * s + m[B, D],
            w * s + m[C, D],
        )


@njit
def flow_on_pinhole(seen, owners, inverse, kinds, maps, out):
    """The flow from pixels of a pinhole to their points in another one, (H W 2,) float32: `on_pinhole` minus the pixels'
    centres.
    """
    height, width = seen.shape
    sky = np.int32(kinds.shape[0] - 1)
    for y in range(height):
        uy, row, x = np.uintp(y), y * width, 0
        while x < width:
            k, stop = _run(seen, owners, uy, x, sky)
            if kinds[k] == RIGID:
                _row_of_flow(maps[k], inverse, y, row, x, stop, out)
            else:
                _fill(np.float32(0.0 if kinds[k] == STILL else np.nan), 2 * (row + x), 2 * (row + stop), out)
            x = stop


@inner
def _row_of_flow(m, inverse, y, row, first, stop, out):
    py = y + 0.5
    a0, a1, a2, c0, c1, c2 = m[A, A], m[B, A], m[C, A], m[A, D], m[B, D], m[C, D]
    b0, b1, b2 = m[A, B] * py + m[A, C], m[B, B] * py + m[B, C], m[C, B] * py + m[C, C]
    for i in range(first, stop):
        p, px = row + i, i + 0.5
        s = inverse[np.uintp(p)]
        w = a2 * px + b2 + c2 * s
        r = 1.0 / w if w > 0.0 else np.nan
        out[np.uintp(2 * p)], out[np.uintp(2 * p + 1)] = (a0 * px + b0 + c0 * s) * r - px, (a1 * px + b1 + c1 * s) * r - py


@njit
def from_centers(xy, width, out):
    """Write the offsets of positions xy (H W 2,) from the centres of their pixels into out (H W 2,) float32.

    `width` is the width of the picture.
    """
    for row in range(0, xy.shape[0] // 2, width):
        py = row // width + 0.5
        for i in range(width):
            p = row + i
            out[np.uintp(2 * p)], out[np.uintp(2 * p + 1)] = xy[np.uintp(2 * p)] - (i + 0.5), xy[np.uintp(2 * p + 1)] - py


@njit
def own_triangles(seen, owners, shift, own):
    """The other view's number of each pixel's triangle, which differs by `shift` for each thing; -1 if there is none."""
    height, width = seen.shape
    for y in range(height):
        for x in range(width):
            uy, ux = np.uintp(y), np.uintp(x)
            t = seen[uy, ux]
            own[uy, ux] = t + shift[np.uintp(owners[np.uintp(t)])] if t >= 0 else np.int32(-1)
