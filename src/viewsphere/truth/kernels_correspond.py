"""Where the points that pixels show are in another view: of what is rigid one matrix a thing, no vertex is read.

A pixel's point is p / i in front of its camera: p the pixel (x, y, 1) or its ray, i = 1/s; so a rigid motion, and a projection
after it, is q = M (p, i) with one matrix (3, 4) for all points of a thing. i = 0 is a direction: so the sky's formula is the
same.
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
    """The thing that a pixel shows, and the first column after it that shows another one."""
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
    """Pixels xy (H, W, 2) and near (H, W), 1/z, of the points in a pinhole's view; `kinds` and `maps` (n, 3, 4) of the things,
    then of the ground and of the sky.

    Behind the camera xy is NaN and near 0; both are NaN where there is no point.
    """
    height, width = seen.shape
    sky, table = np.int32(kinds.shape[0] - 1), rays.shape[0] > 0
    for y in range(height):
        uy, x = np.uintp(y), 0
        while x < width:
            k, stop = _run(seen, owners, uy, x, sky)
            if kinds[k] == RIGID and table:
                _row_of_rays(maps[k], rays, inverse, uy, x, stop, xy, near)
            elif kinds[k] == RIGID:
                _row(maps[k], inverse, uy, x, stop, xy, near)
            elif kinds[k] == STILL:
                for i in range(x, stop):
                    ui = np.uintp(i)
                    xy[uy, ui, A], xy[uy, ui, B], near[uy, ui] = i + 0.5, y + 0.5, inverse[uy, ui]
            elif kinds[k] == GONE:
                for i in range(x, stop):
                    ui = np.uintp(i)
                    xy[uy, ui, A] = xy[uy, ui, B] = near[uy, ui] = np.nan
            x = stop


@inner
def _row(m, inverse, y, first, stop, xy, near):
    py = y + 0.5
    a0, a1, a2, c0, c1, c2 = m[A, A], m[B, A], m[C, A], m[A, D], m[B, D], m[C, D]
    b0, b1, b2 = m[A, B] * py + m[A, C], m[B, B] * py + m[B, C], m[C, B] * py + m[C, C]
    for i in range(first, stop):
        ui, px = np.uintp(i), i + 0.5
        s = inverse[y, ui]
        w = a2 * px + b2 + c2 * s
        r = 1.0 / w if w > 0.0 else np.nan
        xy[y, ui, A], xy[y, ui, B] = (a0 * px + b0 + c0 * s) * r, (a1 * px + b1 + c1 * s) * r
        near[y, ui] = s * r if w > 0.0 else 0.0


@inner
def _row_of_rays(m, rays, inverse, y, first, stop, xy, near):
    for i in range(first, stop):
        ui = np.uintp(i)
        s = inverse[y, ui]
        u, v, w = _moved(m, rays[y, ui, A], rays[y, ui, B], rays[y, ui, C], s)
        r = 1.0 / w if w > 0.0 else np.nan
        xy[y, ui, A], xy[y, ui, B] = u * r, v * r
        near[y, ui] = s * r if w > 0.0 else np.nan if math.isnan(w) else 0.0


@inner
def _moved(m, px, py, pz, s):
    return (
        m[A, A] * px + m[A, B] * py + m[A, C] * pz + m[A, D] * s,
        m[B, A] * px + m[B, B] * py + m[B, C] * pz + m[B, D] * s,
        m[C, A] * px + m[C, B] * py + m[C, C] * pz + m[C, D] * s,
    )


@njit
def as_rays(seen, owners, inverse, rays, kinds, maps, unit, out, near):
    """Rays (H, W, 3) towards the points in a distorted lens' view, and near (H, W), 1/s: the point is ray / near.

    Rays are of length 1 with `unit`, else z = 1, NaN behind the camera; both are NaN where there is no point.
    """
    height, width = seen.shape
    sky, table = np.int32(kinds.shape[0] - 1), rays.shape[0] > 0
    for y in range(height):
        for x in range(width):
            uy, ux = np.uintp(y), np.uintp(x)
            k = np.uintp(_thing(seen, owners, uy, ux, sky))
            if kinds[k] == OTHER:
                continue
            s = inverse[uy, ux] if kinds[k] != GONE else np.nan
            px, py, pz = (rays[uy, ux, A], rays[uy, ux, B], rays[uy, ux, C]) if table else (x + 0.5, y + 0.5, 1.0)
            u, v, w = _moved(maps[k], px, py, pz, s)
            if kinds[k] == STILL:
                u, v, w = px, py, pz  # both lenses are one: the ray is the pixel's own
            length = math.sqrt(u * u + v * v + w * w) if unit else w
            r = 1.0 / length if length > 0.0 else np.nan
            if kinds[k] == STILL:
                r = 1.0
            out[uy, ux, A], out[uy, ux, B], out[uy, ux, C] = u * r, v * r, w * r
            near[uy, ux] = s * r if length > 0.0 else np.nan if math.isnan(w) else 0.0


@njit
def in_axes(seen, owners, inverse, rays, kinds, maps, out):
    """M (p, i) / i (H, W, 3) of each pixel, NaN where there is no point, and of the sky."""
    height, width = seen.shape
    sky, table = np.int32(kinds.shape[0] - 1), rays.shape[0] > 0
    for y in range(height):
        uy, x = np.uintp(y), 0
        while x < width:
            k, stop = _run(seen, owners, uy, x, sky)
            if kinds[k] == OTHER:
                x = stop
                continue
            if kinds[k] == GONE:
                for i in range(x, stop):
                    ui = np.uintp(i)
                    out[uy, ui, A] = out[uy, ui, B] = out[uy, ui, C] = np.nan
            elif table:
                for i in range(x, stop):
                    ui = np.uintp(i)
                    s = 1.0 / inverse[uy, ui] if inverse[uy, ui] > 0.0 else np.nan
                    _place(maps[k], rays[uy, ui, A], rays[uy, ui, B], rays[uy, ui, C], s, out, uy, ui)
            else:
                for i in range(x, stop):
                    ui = np.uintp(i)
                    s = 1.0 / inverse[uy, ui] if inverse[uy, ui] > 0.0 else np.nan
                    _place(maps[k], i + 0.5, y + 0.5, 1.0, s, out, uy, ui)
            x = stop


@inner
def _place(m, px, py, pz, s, out, y, x):
    out[y, x, A] = (m[A, A] * px + m[A, B] * py + m[A, C] * pz) * s + m[A, D]
    out[y, x, B] = (m[B, A] * px + m[B, B] * py + m[B, C] * pz) * s + m[B, D]
    out[y, x, C] = (m[C, A] * px + m[C, B] * py + m[C, C] * pz) * s + m[C, D]


@njit
def flow_on_pinhole(seen, owners, inverse, kinds, maps, out):
    """From pixels of a pinhole to their points in another one, (H, W, 2) float32: `on_pinhole` less the pixels' centres."""
    height, width = seen.shape
    sky = np.int32(kinds.shape[0] - 1)
    for y in range(height):
        uy, x = np.uintp(y), 0
        while x < width:
            k, stop = _run(seen, owners, uy, x, sky)
            if kinds[k] == RIGID:
                _row_of_flow(maps[k], inverse, uy, x, stop, out)
            else:
                nothing = np.float32(0.0 if kinds[k] == STILL else np.nan)
                for i in range(x, stop):
                    ui = np.uintp(i)
                    out[uy, ui, A] = out[uy, ui, B] = nothing
            x = stop


@inner
def _row_of_flow(m, inverse, y, first, stop, out):
    py = y + 0.5
    a0, a1, a2, c0, c1, c2 = m[A, A], m[B, A], m[C, A], m[A, D], m[B, D], m[C, D]
    b0, b1, b2 = m[A, B] * py + m[A, C], m[B, B] * py + m[B, C], m[C, B] * py + m[C, C]
    for i in range(first, stop):
        ui, px = np.uintp(i), i + 0.5
        s = inverse[y, ui]
        w = a2 * px + b2 + c2 * s
        r = 1.0 / w if w > 0.0 else np.nan
        out[y, ui, A], out[y, ui, B] = (a0 * px + b0 + c0 * s) * r - px, (a1 * px + b1 + c1 * s) * r - py


@njit
def from_centers(xy, out):
    """How far positions xy (H, W, 2) are from the centres of their pixels, (H, W, 2) float32."""
    for y in range(xy.shape[0]):
        for x in range(xy.shape[1]):
            uy, ux = np.uintp(y), np.uintp(x)
            out[uy, ux, A], out[uy, ux, B] = xy[uy, ux, A] - (x + 0.5), xy[uy, ux, B] - (y + 0.5)


@njit
def own_triangles(seen, owners, shift, ground, own):
    """The other view's number of each pixel's triangle: `shift` further on by thing, at most `ground`; -1 where none is."""
    height, width = seen.shape
    for y in range(height):
        for x in range(width):
            uy, ux = np.uintp(y), np.uintp(x)
            t = seen[uy, ux]
            own[uy, ux] = min(t + shift[np.uintp(owners[np.uintp(t)])], ground) if t >= 0 else np.int32(-1)
