"""Exact rasterisation along parallel rays: the edge functions of `kernels_draw`, and z linear over the picture.

Vertices are q_i = (u, v, 1, z): pixels, and metres in front of the plane in which the rays begin. A pixel centre p = (x + .5,
y + .5, 1) is covered by a triangle if all three e_i(p) have one sign, and shows it if its z there is above 0 and less than that
of the surface seen so far by more than rounding makes it (`NEARER`).
"""

from __future__ import annotations

import math

import numpy as np

from viewsphere.kernels.jit import inner, njit
from viewsphere.truth.kernel_constants import FOUR, NEARER
from viewsphere.truth.raster.kernels_draw import ENDLESS_1, EPSILON, NEVER, SLIVER, SMALL, hits_surface, row_span
from viewsphere.truth.raster.kernels_row import draw_four_deep

A, B, C, D = np.uintp(0), np.uintp(1), np.uintp(2), np.uintp(3)
NO_EDGE = (0.0, 0.0, 0.0)  # an edge function that holds everywhere


@inner
def _edge_of(q, i, j, sign):
    """Coefficients of det[p, q_i, q_j] in p, times the sign 1 or -1; those of (j, i) are exactly the opposite numbers."""
    e = q[i, B] - q[j, B], q[j, A] - q[i, A], q[i, A] * q[j, B] - q[i, B] * q[j, A]
    return (sign * e[0], sign * e[1], sign * e[2])


@inner
def surface_of(q, i0, i1, i2, cutout):
    """Twice the triangle's area in pixels; its edge functions, not negative inside for either winding; its z = z0 + a (x - u0)
    + b (y - v0) as (a, b, z0, u0, v0); the least and the greatest z.

    An endless triangle has one edge of its own, and no bounds of z.
    """
    u0, v0, z0 = q[i0, A], q[i0, B], q[i0, D]
    ax, ay, az = q[i1, A] - u0, q[i1, B] - v0, q[i1, D] - z0
    bx, by, bz = q[i2, A] - u0, q[i2, B] - v0, q[i2, D] - z0
    area = ax * by - ay * bx
    inverse = 1.0 / area if area != 0.0 else 0.0
    slope = (az * by - bz * ay) * inverse, (bz * ax - az * bx) * inverse, z0, u0, v0
    sign = 1.0 if area >= 0.0 else -1.0
    bounds = min(z0, q[i1, D], q[i2, D]), max(z0, q[i1, D], q[i2, D])
    e0, e1, e2 = _edge_of(q, i1, i2, sign), _edge_of(q, i2, i0, sign), _edge_of(q, i0, i1, sign)
    if cutout < NEVER:
        e0, e1, e2, bounds = NO_EDGE, e1 if cutout == ENDLESS_1 else e2, NO_EDGE, (-np.inf, np.inf)
    return area, (e0, e1, e2), slope, bounds


@inner
def depth_at(slope, bounds, px, py):
    """The z of a triangle at a place in the picture, within the bounds."""
    a, b, z0, u0, v0 = slope
    return min(max(a * (px - u0) + (b * (py - v0) + z0), bounds[0]), bounds[1])


@inner
def covers(edges, checked, px, py):
    """The values of a triangle's edge functions at a place, and whether it is inside; if `checked`, of either sign."""
    a, b, c = edges
    e0, e1, e2 = a[0] * px + (a[1] * py + a[2]), b[0] * px + (b[1] * py + b[2]), c[0] * px + (c[1] * py + c[2])
    inside = e0 >= 0.0 and e1 >= 0.0 and e2 >= 0.0
    return inside or (checked and e0 <= 0.0 and e1 <= 0.0 and e2 <= 0.0), e0, e1, e2


@njit
def draw(q, triangles, span, canvas, cutout, alpha_masks, nearest, seen):
    """Draw triangles into nearest (z, infinite if none) and seen (triangle, -1 if none), both in C order.

    `span` and `canvas` are those of `kernels_draw.draw`.
    """
    height, width = nearest.shape
    first, last, base = span
    samples, x0, y0 = canvas
    for t in range(first, last):
        ut = np.uintp(t)
        i0, i1, i2 = np.uintp(triangles[ut, A] - base), np.uintp(triangles[ut, B] - base), np.uintp(triangles[ut, C] - base)
        endless = cutout[ut] < NEVER
        if cutout[ut] == NEVER or (not endless and max(q[i0, D], q[i1, D], q[i2, D]) <= 0.0):
            continue
        xa, ya, xb, yb = 0, 0, width - 1, height - 1
        if not endless:
            xl, xh = min(q[i0, A], q[i1, A], q[i2, A]) * samples, max(q[i0, A], q[i1, A], q[i2, A]) * samples
            yl, yh = min(q[i0, B], q[i1, B], q[i2, B]) * samples, max(q[i0, B], q[i1, B], q[i2, B]) * samples
            xa, xb = _pixels(xl - (0.5 + x0), xh - (0.5 + x0), width)
            ya, yb = _pixels(yl - (0.5 + y0), yh - (0.5 + y0), height)
        if xa > xb or ya > yb:
            continue
        area, edges, slope, bounds = surface_of(q, i0, i1, i2, cutout[ut])
        if area == 0.0:
            continue
        box = (xa, ya, xb, yb)
        if cutout[ut] >= 0 or (not endless and abs(area) < SLIVER):
            _draw_checked(t, edges, slope, bounds, box, canvas, cutout[ut], alpha_masks, nearest, seen)
        elif xb - xa < SMALL and width >= FOUR:
            _draw_small(t, edges, slope, bounds, box, canvas, nearest, seen)
        else:
            _draw_rows(t, edges, slope, bounds, box, canvas, nearest, seen)


@inner
def _pixels(low, high, size):
    """First and last of `size` samples between two places, measured from the first sample."""
    first = math.ceil(min(max(low - EPSILON, 0.0), float(size)))
    return first, math.floor(min(max(high + EPSILON, -1.0), size - 1.0))


@inner
def _draw_small(t, edges, slope, bounds, box, canvas, nearest, seen):
    """Draw a narrow triangle: test every pixel of its box, and pixels beside the box, which the triangle does not cover."""
    xa, ya, xb, yb = box
    samples, x0, y0 = canvas
    step, width = 1.0 / samples, nearest.shape[1]
    left, right, is_wide = min(xa, width - FOUR), min(xa + FOUR, width - FOUR), xb - xa >= FOUR
    e0, e1, e2 = edges
    a, b, z0, u0, v0 = slope
    e = e0[0], e1[0], e2[0]
    for y in range(ya, yb + 1):
        py = (y + y0 + 0.5) * step
        f = e0[1] * py + e0[2], e1[1] * py + e1[2], e2[1] * py + e2[2]
        row, plane = y * width, (a, u0, b * (py - v0) + z0)
        draw_four_deep(nearest, seen, np.uintp(row + left), t, left + x0 + 0.5, step, e, f, plane, bounds)
        if is_wide:
            draw_four_deep(nearest, seen, np.uintp(row + right), t, right + x0 + 0.5, step, e, f, plane, bounds)


@inner
def _draw_rows(t, edges, slope, bounds, box, canvas, nearest, seen):
    """Draw a wide triangle row by row."""
    samples, x0, y0 = canvas
    step = 1.0 / samples
    a, b, z0, u0, v0 = slope
    for y in range(box[1], box[3] + 1):
        left, right = row_span(edges, y, box, canvas)
        uy, s = np.uintp(y), b * ((y + y0 + 0.5) * step - v0) + z0
        for x in range(left, right + 1):
            z = min(max(a * ((x + x0 + 0.5) * step - u0) + s, bounds[0]), bounds[1])
            ux = np.uintp(x)
            better = (z * NEARER < nearest[uy, ux]) & (z > 0.0)
            nearest[uy, ux] = z if better else nearest[uy, ux]
            seen[uy, ux] = t if better else seen[uy, ux]


@inner
def _draw_checked(t, edges, slope, bounds, box, canvas, cutout, alpha_masks, nearest, seen):
    """Draw a cut-out, or a sliver with uncertain facing: either sign passes the test."""
    samples, x0, y0 = canvas
    step = 1.0 / samples
    for y in range(box[1], box[3] + 1):
        py = (y + y0 + 0.5) * step
        for x in range(box[0], box[2] + 1):
            px = (x + x0 + 0.5) * step
            inside, e0, e1, e2 = covers(edges, True, px, py)
            if not inside:
                continue
            z = depth_at(slope, bounds, px, py)
            if z > 0.0 and z * NEARER < nearest[y, x] and hits_surface(alpha_masks, cutout, e0, e1, e2):
                nearest[y, x] = z
                seen[y, x] = t


@njit
def meet(q, box, triangles, ground, cutout, alpha_masks, size, start, points, nearest, met, number):
    """`kernels_points.meet` along parallel rays: write the first triangle that each sorted point meets into `met`, and its 1/z
    into `nearest`.
    """
    width, height = size
    for t in range(triangles.shape[0]):
        ut = np.uintp(t)
        i, j, k = np.uintp(triangles[ut, A]), np.uintp(triangles[ut, B]), np.uintp(triangles[ut, C])
        endless = cutout[ut] < NEVER
        if cutout[ut] == NEVER or (not endless and max(q[i, D], q[j, D], q[k, D]) <= 0.0):
            continue
        xa, ya, xb, yb = 0, 0, width - 1, height - 1
        if not endless:
            xa, ya = min(box[i, A], box[j, A], box[k, A]), min(box[i, B], box[j, B], box[k, B])
            xb, yb = -min(box[i, C], box[j, C], box[k, C]), -min(box[i, D], box[j, D], box[k, D])
        if xa > xb or ya > yb:
            continue
        area, edges, slope, bounds = surface_of(q, i, j, k, cutout[ut])
        if area == 0.0:
            continue
        own, checked = min(t, ground), cutout[ut] >= 0 or (not endless and abs(area) < SLIVER)
        for y in range(ya, yb + 1):
            for p in range(start[np.uintp(y * width + xa)], start[np.uintp(y * width + xb + 1)]):
                up = np.uintp(p)
                px, py = points[A, up], points[B, up]
                inside, e0, e1, e2 = covers(edges, checked, px, py)
                if not inside or number[up] == own:
                    continue
                z = depth_at(slope, bounds, px, py)
                if z > 0.0 and z * nearest[up] * NEARER < 1.0 and hits_surface(alpha_masks, cutout[ut], e0, e1, e2):
                    nearest[up] = 1.0 / z
                    met[up] = t
