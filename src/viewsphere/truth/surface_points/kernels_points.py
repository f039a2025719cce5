"""The triangle that each point of a picture meets first: a rasteriser whose samples are arbitrary points.

The points are sorted by pixel, so the points of neighbouring pixels in a row form one run; each triangle is tested against the
runs that its box touches. The test is exact for any point, so testing points of extra pixels is harmless. This is known as the
irregular z-buffer (Johnson et al. 2005; Aila and Laine 2004, "Alias-free shadow maps"). Edges and planes are computed by
`kernels_draw`.
"""

from __future__ import annotations

import math

import numpy as np

from viewsphere.kernels.jit import inner, njit
from viewsphere.truth.kernel_constants import FOUR, NEARER
from viewsphere.truth.raster.kernels_draw import (
    BEHIND,
    NEVER,
    ROUNDED_UP,
    SLIVER,
    edge,
    edges_inside,
    hidden,
    hits_surface,
    plane,
)
from viewsphere.truth.raster.kernels_row import meet_four

WIDER = 1e-6  # pixels by which a triangle's box is widened: more than the rounding of its corners and of the edge functions
SMALL = 8  # pixels: up to this width all points of a box are tested, after a first check if its height is no more
A, B, C, D = np.uintp(0), np.uintp(1), np.uintp(2), np.uintp(3)


@njit
def boxes(q, endless, width, height, box):
    """Range of pixels of each vertex, (n, 4) int32: x, y of the first, -x, -y of the last, as in `kernels_draw.cells`, but for
    whole pixels. It is BEHIND if w <= 0, and for the vertices from `endless` on.
    """
    for i in range(q.shape[0]):
        ui = np.uintp(i)
        if i < endless and q[ui, C] > 0.0:
            x, y = q[ui, A] * q[ui, D], q[ui, B] * q[ui, D]
            box[ui, A] = np.int32(min(max(x - WIDER, 0.0), width + 0.0))
            box[ui, B] = np.int32(min(max(y - WIDER, 0.0), height + 0.0))
            box[ui, C] = -np.int32(math.floor(min(max(x + WIDER, -1.0), width - 1.0)))
            box[ui, D] = -np.int32(math.floor(min(max(y + WIDER, -1.0), height - 1.0)))
        else:
            box[ui, A] = box[ui, B] = box[ui, C] = box[ui, D] = BEHIND


@njit
def cover(box, starts, width, height, covered):
    """Fill covered (pixels,) with whether a pixel is in the box of any mesh. Vertices of the meshes begin at `starts`, whose
    last entry is the ground's; `box` is filled by `boxes`.
    """
    covered[:] = False
    for i in range(starts.shape[0] - 1):
        xa, ya, xb, yb = np.int32(width), np.int32(height), np.int32(1), np.int32(1)
        for v in range(starts[i], starts[i + 1]):
            uv = np.uintp(v)
            xa, ya, xb, yb = min(xa, box[uv, A]), min(ya, box[uv, B]), min(xb, box[uv, C]), min(yb, box[uv, D])
        for y in range(max(ya, 0), min(-yb, height - 1) + 1):
            for p in range(y * width + max(xa, 0), y * width + min(-xb, width - 1) + 1):
                covered[np.uintp(p)] = True


@njit
def sort(xy, near, gap, own, cell, covered, ground, clear, start, order, points, nearest, number, far):
    """Sort the points xy (N, 2) by their pixels, `cell` (N,), leaving out those of -1; return the number of remaining points.

    Points whose `own` triangle number is at least `clear` can only be hidden by a mesh. They are left out if no mesh covers
    their pixel: see `cover`.
    Point order[p] is at points[:, p]; its `own` triangle is in number[p], `ground` for all of the ground's. nearest[p] is
    `near` times `gap`, the 1/z to be exceeded. Pixel i has the points [start[i], start[i + 1]), and far[i] is the minimum of
    their `nearest`. start: (pixels + 2,). After the sorted points there are FOUR dummies that meet nothing: `points`, `nearest`
    and `number` have room for them.
    """
    start[:] = 0
    for k in range(cell.shape[0]):
        c = cell[np.uintp(k)]
        if c >= 0 and (covered[np.uintp(c)] or own[np.uintp(k)] < clear):
            start[np.uintp(c + 2)] += 1
        else:
            cell[np.uintp(k)] = -1
    for c in range(far.shape[0] + 1):
        start[np.uintp(c + 1)] += start[np.uintp(c)]
    far[:] = np.inf
    for k in range(cell.shape[0]):
        uk = np.uintp(k)
        if cell[uk] >= 0:
            c = np.uintp(cell[uk])
            p = np.uintp(start[c + B])
            start[c + B] += 1
            order[p], points[A, p], points[B, p] = k, xy[uk, A], xy[uk, B]
            nearest[p], number[p] = near[uk] * gap, min(own[uk], ground)
            far[c] = min(far[c], nearest[p])
    inside = np.int64(start[far.shape[0]])
    for p in range(inside, inside + FOUR):
        up = np.uintp(p)
        points[A, up], points[B, up], nearest[up], number[up] = 0.0, 0.0, np.inf, -1
    return inside


@njit
def meet(q, box, triangles, ground, cutout, alpha_masks, size, start, points, nearest, met, number, far):
    """Write the first triangle that each sorted point meets into `met`, and its 1/z into `nearest`.

    A triangle is met if it is nearer than 1/z = `nearest` by more than a factor NEARER, and is not the point's own triangle
    (`number`); triangles from `ground` on count as one. far: (height, width), as `sort` fills it. `points`, `nearest`, `met`
    and `number` have 3 entries more than there are points.
    """
    width, height = size
    us, vs = points[0], points[1]
    for t in range(triangles.shape[0]):
        ut = np.uintp(t)
        i, j, k = np.uintp(triangles[ut, A]), np.uintp(triangles[ut, B]), np.uintp(triangles[ut, C])
        xa, ya = min(box[i, A], box[j, A], box[k, A]), min(box[i, B], box[j, B], box[k, B])
        xb, yb = -min(box[i, C], box[j, C], box[k, C]), -min(box[i, D], box[j, D], box[k, D])
        if xa > xb or ya > yb or cutout[ut] == NEVER:
            continue
        q0, q1, q2 = (q[i, A], q[i, B], q[i, C]), (q[j, A], q[j, B], q[j, C]), (q[k, A], q[k, B], q[k, C])
        crossing = xa == BEHIND
        if crossing:
            if q0[2] <= 0.0 and q1[2] <= 0.0 and q2[2] <= 0.0 and cutout[ut] >= NEVER:
                continue
            xa, ya, xb, yb = 0, 0, width - 1, height - 1
        area = (xa, ya, xb, yb)
        most = max(q[i, D], q[j, D], q[k, D]) * (ROUNDED_UP / NEARER)
        is_small = xb - xa < SMALL and yb - ya < SMALL and width >= FOUR
        if is_small and not crossing and hidden(far, xa, ya, xb, yb, most):
            continue
        nx, ny, nz, det = plane(q0, q1, q2)
        if det == 0.0:
            continue
        own = min(t, ground)
        w0, w1, w2 = q0[2], q1[2], q2[2]
        if cutout[ut] >= 0 or (not crossing and abs(det) < SLIVER * (w0 * w1 * w2)):
            bounds = (0.0, np.inf) if crossing else (1.0 / max(w0, w1, w2), 1.0 / min(w0, w1, w2))
            _meet_checked(t, own, q0, q1, q2, area, width, bounds, cutout[ut], alpha_masks, start, points, nearest, met, number)
            continue
        e0, e1, e2 = edges_inside(q0, q1, q2, (nx, ny, nz), det, cutout[ut])
        inverse = 1.0 / det
        n = (nx * inverse, ny * inverse, nz * inverse)
        for y in range(ya, yb + 1):
            first, last = _run(e0, e1, e2, y, xa, xb, width, start)
            for p in range(first, last, FOUR):
                meet_four(us, vs, nearest, met, number, p, own, e0, e1, e2, n)


@inner
def _run(e0, e1, e2, y, xa, xb, width, start):
    """The points, from first to before last, in the pixels of a row that a triangle may touch, between columns xa and xb.

    An edge function is greatest at one end of the row's height, because sums and products are monotone in floating point too.
    """
    low, high = float(xa), xb + 1.0
    if xb - xa >= SMALL:
        for e in (e0, e1, e2):
            f = max(e[1] * y, e[1] * (y + 1)) + e[2]
            if e[0] > 0.0:
                low = max(low, -f / e[0] - WIDER)
            elif e[0] < 0.0:
                high = min(high, -f / e[0] + WIDER)
            elif f < 0.0:
                high = -1.0
        if low > high:
            return np.int64(0), np.int64(0)
    first = np.uintp(y * width + int(low))
    last = np.uintp(y * width + min(int(high), xb) + 1)
    return np.int64(start[first]), np.int64(start[last])


@inner
def _meet_checked(t, own, q0, q1, q2, area, width, bounds, cutout, alpha_masks, start, points, nearest, met, number):
    """The `meet` of a cut-out, or of a sliver with uncertain facing: either sign passes the test, and 1/z is clamped to
    `bounds`.
    """
    nx, ny, nz, det = plane(q0, q1, q2)
    a, b, c = edge(q1, q2), edge(q2, q0), edge(q0, q1)
    for y in range(area[1], area[3] + 1):
        for p in range(start[np.uintp(y * width + area[0])], start[np.uintp(y * width + area[2] + 1)]):
            up = np.uintp(p)
            px, py = points[A, up], points[B, up]
            e0, e1, e2 = a[0] * px + (a[1] * py + a[2]), b[0] * px + (b[1] * py + b[2]), c[0] * px + (c[1] * py + c[2])
            if not ((e0 >= 0.0 and e1 >= 0.0 and e2 >= 0.0) or (e0 <= 0.0 and e1 <= 0.0 and e2 <= 0.0)):
                continue
            inverse = min(max((nx * px + (ny * py + nz)) / det, bounds[0]), bounds[1])
            if inverse > nearest[up] * NEARER and number[up] != own and hits_surface(alpha_masks, cutout, e0, e1, e2):
                nearest[up] = inverse
                met[up] = t


@njit
def classify(xy, near, width, height, state, cell):
    """Fill state (N,): 4 if `near` is NaN, otherwise 3 if xy (2 N,) is NaN, 2 outside the picture, 0 inside. Also fill cell
    (N,) int32: the pixel of a point inside, counted row by row, otherwise -1.

    The arrays are flat and the loop has no branches, so that compilers vectorise it.
    """
    for i in range(near.shape[0]):
        x, y = xy[np.uintp(2 * i)], xy[np.uintp(2 * i + 1)]
        nowhere = math.isnan(near[np.uintp(i)])
        inside = (x >= 0.0) & (y >= 0.0) & (x < width) & (y < height) & (not nowhere)
        seen = np.uint8(0) if inside else np.uint8(3) if math.isnan(x) | math.isnan(y) else np.uint8(2)
        state[np.uintp(i)] = np.uint8(4) if nowhere else seen
        cell[np.uintp(i)] = np.int32(y) * np.int32(width) + np.int32(x) if inside else np.int32(-1)


@njit
def hide(met, order, occluded, state):
    """Set state[order[p]] = occluded for each sorted point that met a triangle."""
    for p in range(order.shape[0]):
        up = np.uintp(p)
        if met[up] >= 0:
            state[np.uintp(order[up])] = occluded


@njit
def mark(met, order, triangle):
    """Set triangle[order[p]] = met[p] for each sorted point that met a triangle."""
    for p in range(order.shape[0]):
        up = np.uintp(p)
        if met[up] >= 0:
            triangle[np.uintp(order[up])] = met[up]
