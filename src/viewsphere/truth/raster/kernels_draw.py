"""Exact rasterisation through a pinhole: homogeneous edge functions in float64, no clipping, no snapping, no fastmath.

With q_i = K (R X_i + t) not divided by w, a pixel centre p = (x + .5, y + .5, 1) is covered by a triangle if all three e_i(p) =
det[p, q_j, q_k] have one sign and 1/z = n.p / n.q_0 > 0, n = (q_1 - q_0) x (q_2 - q_0) = e_0 + e_1 + e_2: exactly the ray's
intersection (Olano and Greer 1997, "Triangle scan conversion using 2D homogeneous coordinates"). Two triangles that share an
edge evaluate the same products with opposite signs, so no pixel centre falls between them. Triangles are drawn in order, and a
later one replaces an earlier one only if its 1/z is greater by more than rounding makes it (`NEARER`).
"""

from __future__ import annotations

import math

import numpy as np

from viewsphere.kernels.jit import inner, njit
from viewsphere.truth.kernel_constants import FOUR, NEARER
from viewsphere.truth.raster.kernels_row import draw_four, shows_farther

EPSILON = 1e-5  # pixels by which a bounding box is widened: more than the rounding error of the edge functions
BEHIND = -(1 << 30)
ROUNDED_UP = 1.0 + 1e-9  # bounds the rounding of 1/z between a triangle's corners
SLIVER = 1e-5  # twice the area in pixels below which the sign of a triangle's area is not trusted
SMALL = 2 * FOUR  # pixels: up to this width testing every pixel is faster than computing spans
NEVER, CLAMP, MIRROR = -2, 1, 2  # as in alpha_masks.py; values below NEVER mark endless triangles
ENDLESS_1 = -3  # only the edge opposite corner 1 of an endless triangle counts; otherwise the edge opposite corner 2
HORIZON = 1e-10  # share of 1/z's coefficients: a point nearer than this to a plane's horizon may be beyond it by rounding


@njit
def transform(vertices, start, stop, m, homogeneous):
    """(n, 4): (u, v, w) = m (x, y, z, 1) of vertices [start, stop), and 1/w. No BLAS: its rounding depends on the processor."""
    for i in range(start, stop):
        x, y, z = vertices[i, 0], vertices[i, 1], vertices[i, 2]
        homogeneous[i - start, 0] = m[0, 0] * x + m[0, 1] * y + m[0, 2] * z + m[0, 3]
        homogeneous[i - start, 1] = m[1, 0] * x + m[1, 1] * y + m[1, 2] * z + m[1, 3]
        w = m[2, 0] * x + m[2, 1] * y + m[2, 2] * z + m[2, 3]
        homogeneous[i - start, 2], homogeneous[i - start, 3] = w, 1.0 / w if w > 0.0 else np.inf


@njit
def cells(q, samples, x0, y0, width, height, cell):
    """Range of pixels of each vertex's own bounding box, (n, 4) int32: x, y of the first pixel, -x, -y of the last.

    The numbers are clamped so that their minimum over three vertices is the triangle's box in the canvas, which is empty if the
    triangle is outside. They are BEHIND if w <= 0.
    """
    for i in range(q.shape[0]):
        bound_vertex(q, i, samples, x0, y0, width, height, cell)


@inner
def bound_vertex(q, i, samples, x0, y0, width, height, cell):
    """Fill the row of `cells` for one vertex."""
    w = q[i, 2]
    if w > 0.0:
        x = q[i, 0] * q[i, 3] * samples - (0.5 + x0)
        y = q[i, 1] * q[i, 3] * samples - (0.5 + y0)
        cell[i, 0] = math.ceil(min(max(x - EPSILON, 0.0), float(width)))
        cell[i, 1] = math.ceil(min(max(y - EPSILON, 0.0), float(height)))
        cell[i, 2] = -math.floor(min(max(x + EPSILON, -1.0), width - 1.0))
        cell[i, 3] = -math.floor(min(max(y + EPSILON, -1.0), height - 1.0))
    else:
        for k in range(4):
            cell[i, k] = BEHIND


@inner
def _is_surface(alpha_masks, row, b0, b1, b2):
    """Return whether the point with these barycentrics of cut-out triangle `row` is surface; see `alpha_masks.AlphaMasks`."""
    texels, layout, levels, material, corners = alpha_masks
    c = corners[row]
    m = layout[material[row]]
    i = _texel(b0 * c[0, 0] + b1 * c[1, 0] + b2 * c[2, 0], m[1], m[3])
    j = _texel(b0 * c[0, 1] + b1 * c[1, 1] + b2 * c[2, 1], m[2], m[4])
    alpha = texels[m[0] + j * m[1] + i] / 255.0 * (b0 * c[0, 2] + b1 * c[1, 2] + b2 * c[2, 2])
    return alpha * levels[material[row], 0] >= levels[material[row], 1]


@inner
def _texel(u, size, wrap):
    """Index of the texel nearest to the coordinate u; wrap as in `mesh.WRAPS`."""
    if wrap == CLAMP:
        u = min(max(u, 0.0), 1.0)
    else:
        period = 2.0 if wrap == MIRROR else 1.0
        u -= period * math.floor(u / period)
        if u > 1.0:
            u = 2.0 - u
    return min(np.int64(u * size), size - 1)


@inner
def edge(a, b):
    """Coefficients of det[p, a, b] in p; the coefficients of edge(b, a) are exactly the opposite numbers."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inner
def plane(q0, q1, q2):
    """Normal of the triangle and its product with q0, from differences: exact to the triangle's size."""
    ax, ay, az = q1[0] - q0[0], q1[1] - q0[1], q1[2] - q0[2]
    bx, by, bz = q2[0] - q0[0], q2[1] - q0[1], q2[2] - q0[2]
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    return nx, ny, nz, nx * q0[0] + ny * q0[1] + nz * q0[2]


@inner
def _turned(e, sign):
    """Three coefficients, or their opposites for the sign -1."""
    return e[0] * sign, e[1] * sign, e[2] * sign


@inner
def edges_inside(q0, q1, q2, normal, det, cutout):
    """Coefficients of a triangle's edges that are not negative inside, for either winding; `plane` gives normal and det.

    An endless triangle has one edge of its own, and the horizon of its plane, where 1/z = normal.p / det becomes 0.
    """
    sign = -1.0 if det < 0.0 else 1.0  # exact; processors mispredict a branch half of the time
    e0, e1, e2 = _turned(edge(q1, q2), sign), _turned(edge(q2, q0), sign), _turned(edge(q0, q1), sign)
    if cutout >= NEVER:
        return e0, e1, e2
    x, y, z = normal[0] / det, normal[1] / det, normal[2] / det
    horizon = x, y, z - HORIZON * (abs(x) + abs(y) + abs(z))
    return horizon, e1 if cutout == ENDLESS_1 else e2, horizon


@inner
def _inside(a, b, c, px, f0, f1, f2):
    return a[0] * px + f0 >= 0.0 and b[0] * px + f1 >= 0.0 and c[0] * px + f2 >= 0.0


@njit
def draw(q, cell, triangles, span, canvas, cutout, alpha_masks, nearest, seen):
    """Draw triangles into nearest (1/z, 0 if none) and seen (triangle, -1 if none), both in C order.

    `span` is the first triangle, the one after the last, and the number of the vertex in q[0]. `canvas` is the number of
    samples along a pixel's side and the canvas' first sample (x, y). `cell` is BEHIND for the vertices of endless triangles.
    """
    first, last, base = span
    a, b, c = np.uintp(0), np.uintp(1), np.uintp(2)
    rows = (0, nearest.shape[0] - 1)
    for t in range(first, last):
        ut = np.uintp(t)
        i0, i1, i2 = np.uintp(triangles[ut, a] - base), np.uintp(triangles[ut, b] - base), np.uintp(triangles[ut, c] - base)
        draw_one(t, q, cell, (i0, i1, i2), rows, canvas, cutout[ut], alpha_masks, nearest, seen)


@inner
def draw_one(t, q, cell, corners, rows, canvas, cut, alpha_masks, nearest, seen):
    """Draw triangle t, whose `corners` are rows of q and cell, into these rows of the canvas, the last one included."""
    width = nearest.shape[1]
    a, b, c, d = np.uintp(0), np.uintp(1), np.uintp(2), np.uintp(3)
    i0, i1, i2 = corners
    xa, ya = min(cell[i0, a], cell[i1, a], cell[i2, a]), min(cell[i0, b], cell[i1, b], cell[i2, b])
    xb, yb = -min(cell[i0, c], cell[i1, c], cell[i2, c]), -min(cell[i0, d], cell[i1, d], cell[i2, d])
    crossing = xa == BEHIND
    if not crossing:
        ya, yb = max(ya, rows[0]), min(yb, rows[1])
    if xa > xb or ya > yb or cut == NEVER:
        return
    most = max(q[i0, d], q[i1, d], q[i2, d]) * (ROUNDED_UP / NEARER)
    is_small = xb - xa < SMALL and width >= FOUR
    if is_small and hidden(nearest, xa, ya, xb, yb, most):
        return
    q0, q1, q2 = (q[i0, a], q[i0, b], q[i0, c]), (q[i1, a], q[i1, b], q[i1, c]), (q[i2, a], q[i2, b], q[i2, c])
    if crossing:
        if q0[2] <= 0.0 and q1[2] <= 0.0 and q2[2] <= 0.0 and cut >= NEVER:
            return
        xa, ya, xb, yb = 0, rows[0], width - 1, rows[1]
    nx, ny, nz, det = plane(q0, q1, q2)
    if det == 0.0:
        return
    box = (xa, ya, xb, yb)
    w0, w1, w2 = q0[2], q1[2], q2[2]
    if cut >= 0 or (not crossing and abs(det) < SLIVER * (w0 * w1 * w2)):
        bounds = (0.0, np.inf) if crossing else (1.0 / max(w0, w1, w2), 1.0 / min(w0, w1, w2))
        _draw_checked(t, q0, q1, q2, box, canvas, bounds, cut, alpha_masks, nearest, seen)
        return
    e0, e1, e2 = edges_inside(q0, q1, q2, (nx, ny, nz), det, cut)
    inverse = 1.0 / det
    n = (nx * inverse, ny * inverse, nz * inverse)
    if is_small:
        _draw_small(t, e0, e1, e2, n, box, canvas, nearest, seen)
    else:
        _draw_rows(t, e0, e1, e2, n, box, canvas, nearest, seen)


@inner
def hidden(nearest, xa, ya, xb, yb, most):
    """Return whether all pixels of a narrow box, and the pixels drawn together with them, show a surface nearer than 1/z =
    most.
    """
    width = nearest.shape[1]
    left, right, is_wide = _fours(xa, xb, width)
    for y in range(ya, yb + 1):
        if shows_farther(nearest, np.uintp(y * width + left), most):
            return False
        if is_wide and shows_farther(nearest, np.uintp(y * width + right), most):
            return False
    return True


@inner
def _fours(xa, xb, width):
    """First pixels of the groups of four that hold a narrow box's columns, and whether the second group is needed."""
    return min(xa, width - FOUR), min(xa + FOUR, width - FOUR), xb - xa >= FOUR


@inner
def _draw_small(t, e0, e1, e2, n, box, canvas, nearest, seen):
    """Draw a narrow triangle: test every pixel of its box, and pixels beside the box, which the triangle does not cover."""
    xa, ya, xb, yb = box
    samples, x0, y0 = canvas
    step, width = 1.0 / samples, nearest.shape[1]
    left, right, is_wide = _fours(xa, xb, width)
    e = e0[0], e1[0], e2[0]
    for y in range(ya, yb + 1):
        py = (y + y0 + 0.5) * step
        f = e0[1] * py + e0[2], e1[1] * py + e1[2], e2[1] * py + e2[2]
        row, s = y * width, n[1] * py + n[2]
        draw_four(nearest, seen, np.uintp(row + left), t, left + x0 + 0.5, step, e, f, n[0], s)
        if is_wide:
            draw_four(nearest, seen, np.uintp(row + right), t, right + x0 + 0.5, step, e, f, n[0], s)


@inner
def _draw_rows(t, e0, e1, e2, n, box, canvas, nearest, seen):
    """Draw a wide triangle row by row."""
    samples, x0, y0 = canvas
    step = 1.0 / samples
    for y in range(box[1], box[3] + 1):
        left, right = row_span((e0, e1, e2), y, box, canvas)
        uy, s = np.uintp(y), n[1] * ((y + y0 + 0.5) * step) + n[2]
        for x in range(left, right + 1):
            inverse = n[0] * ((x + x0 + 0.5) * step) + s
            ux = np.uintp(x)
            better = inverse > nearest[uy, ux] * NEARER
            nearest[uy, ux] = inverse if better else nearest[uy, ux]
            seen[uy, ux] = t if better else seen[uy, ux]


@inner
def row_span(edges, y, box, canvas):
    """First and last sample of a triangle in a row of its box, the last before the first if there is none. They are computed,
    then settled by the exact test.

    The crossing -f / e uses the same f as the test, so its error is a few roundings of f: far less than EPSILON.
    """
    e0, e1, e2 = edges
    samples, x0, y0 = canvas
    step, first = 1.0 / samples, x0 + 0.5
    py = (y + y0 + 0.5) * step
    f0, f1, f2 = e0[1] * py + e0[2], e1[1] * py + e1[2], e2[1] * py + e2[2]
    low, high = float(box[0]), float(box[2])
    for e, f in ((e0[0], f0), (e1[0], f1), (e2[0], f2)):
        cross = f * crossing_at(e, samples) - first
        if e > 0.0:
            low = max(low, cross - EPSILON)
        elif e < 0.0:
            high = min(high, cross + EPSILON)
        elif f < 0.0:
            high = -1.0
    if low > high:
        return 0, -1
    left, right = math.ceil(low), math.floor(high)
    while left <= right and not _inside(e0, e1, e2, (left + x0 + 0.5) * step, f0, f1, f2):
        left += 1
    while left <= right and not _inside(e0, e1, e2, (right + x0 + 0.5) * step, f0, f1, f2):
        right -= 1
    return left, right


@inner
def crossing_at(e, samples):
    """The factor that maps f to the sample at which e x + f is 0; 0 for an edge along the row."""
    return -samples / e if e != 0.0 else 0.0


@inner
def _draw_checked(t, q0, q1, q2, box, canvas, bounds, cutout, alpha_masks, nearest, seen):
    """Draw a cut-out, or a sliver with uncertain facing: either sign passes the test, and 1/z is clamped to the corners'
    `bounds`.
    """
    xa, ya, xb, yb = box
    samples, x0, y0 = canvas
    step = 1.0 / samples
    nx, ny, nz, det = plane(q0, q1, q2)
    a, b, c = edge(q1, q2), edge(q2, q0), edge(q0, q1)
    for y in range(ya, yb + 1):
        py = (y + y0 + 0.5) * step
        for x in range(xa, xb + 1):
            px = (x + x0 + 0.5) * step
            e0, e1, e2 = a[0] * px + (a[1] * py + a[2]), b[0] * px + (b[1] * py + b[2]), c[0] * px + (c[1] * py + c[2])
            if not ((e0 >= 0.0 and e1 >= 0.0 and e2 >= 0.0) or (e0 <= 0.0 and e1 <= 0.0 and e2 <= 0.0)):
                continue
            inverse = min(max((nx * px + (ny * py + nz)) / det, bounds[0]), bounds[1])
            if inverse > nearest[y, x] * NEARER and hits_surface(alpha_masks, cutout, e0, e1, e2):
                nearest[y, x] = inverse
                seen[y, x] = t


@inner
def hits_surface(alpha_masks, cutout, e0, e1, e2):
    """Return whether the triangle is surface at these values of its edge functions: everywhere without a cut-out."""
    total = e0 + e1 + e2
    return cutout < 0 or (total != 0.0 and _is_surface(alpha_masks, cutout, e0 / total, e1 / total, e2 / total))
