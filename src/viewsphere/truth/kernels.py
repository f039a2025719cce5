"""Exact rasterisation through a pinhole: homogeneous edge functions in float64, no clipping, no snapping, no fastmath.

With q_i = K (R X_i + t) not divided by w, a pixel centre p = (x + .5, y + .5, 1) is covered by a triangle where all three
e_i(p) = det[p, q_j, q_k] have one sign and 1/z = n.p / n.q_0 > 0, n = (q_1 - q_0) x (q_2 - q_0) = e_0 + e_1 + e_2: exactly the
ray's intersection (Olano and Greer 1997, "Triangle scan conversion using 2D homogeneous coordinates"). Two triangles that share
an edge evaluate the same products with opposite signs, so no pixel centre falls between them.
"""

from __future__ import annotations

import math

import numpy as np

from viewsphere.geometry.jit import njit

EPSILON = 1e-5  # pixels a bounding box is widened by: more than the edge functions' rounding
BEHIND = -(1 << 30)
SLIVER = 1e-5  # twice the area in pixels below which the sign of a triangle's area is not trusted
SMALL = 8


@njit
def transform(vertices, start, stop, k, rotation, translation, homogeneous):
    """K (R X + t) of vertices [start, stop) into homogeneous (n, 3); no BLAS, whose rounding depends on the processor."""
    m = np.empty((3, 4))
    for r in range(3):
        for c in range(3):
            m[r, c] = k[r, 0] * rotation[0, c] + k[r, 1] * rotation[1, c] + k[r, 2] * rotation[2, c]
        m[r, 3] = k[r, 0] * translation[0] + k[r, 1] * translation[1] + k[r, 2] * translation[2]
    for i in range(start, stop):
        x, y, z = vertices[i, 0], vertices[i, 1], vertices[i, 2]
        homogeneous[i - start, 0] = m[0, 0] * x + m[0, 1] * y + m[0, 2] * z + m[0, 3]
        homogeneous[i - start, 1] = m[1, 0] * x + m[1, 1] * y + m[1, 2] * z + m[1, 3]
        homogeneous[i - start, 2] = m[2, 0] * x + m[2, 1] * y + m[2, 2] * z + m[2, 3]


@njit
def cells(q, samples, x0, y0, width, height, cell):
    """First and last pixel of each vertex's own bounding box, (n, 4) int32: x, y of the first, -x, -y of the last.

    Clamped so that the least over three vertices is the triangle's box in the canvas, empty if outside; BEHIND where w <= 0.
    """
    for i in range(q.shape[0]):
        w = q[i, 2]
        if w > 0.0:
            x = q[i, 0] / w * samples - (0.5 + x0)
            y = q[i, 1] / w * samples - (0.5 + y0)
            cell[i, 0] = math.ceil(min(max(x - EPSILON, 0.0), float(width)))
            cell[i, 1] = math.ceil(min(max(y - EPSILON, 0.0), float(height)))
            cell[i, 2] = -math.floor(min(max(x + EPSILON, -1.0), width - 1.0))
            cell[i, 3] = -math.floor(min(max(y + EPSILON, -1.0), height - 1.0))
        else:
            for k in range(4):
                cell[i, k] = BEHIND


@njit
def is_surface(texels, layout, levels, corners, material, row, b0, b1, b2):
    """Whether the point with these barycentrics of cut-out triangle `row` is surface; see `Cutouts`."""
    c = corners[row]
    m = layout[material[row]]
    i = _texel(b0 * c[0, 0] + b1 * c[1, 0] + b2 * c[2, 0], m[1], m[3])
    j = _texel(b0 * c[0, 1] + b1 * c[1, 1] + b2 * c[2, 1], m[2], m[4])
    alpha = texels[m[0] + j * m[1] + i] / 255.0 * (b0 * c[0, 2] + b1 * c[1, 2] + b2 * c[2, 2])
    return alpha * levels[material[row], 0] >= levels[material[row], 1]


@njit
def _texel(u, size, wrap):
    if wrap == 1:
        u = min(max(u, 0.0), 1.0)
    else:
        period = 1.0 if wrap == 0 else 2.0
        u -= period * math.floor(u / period)
        if u > 1.0:
            u = 2.0 - u
    return min(np.int64(u * size), size - 1)


@njit
def _draw_checked(t, q0, q1, q2, box, samples, x0, y0, bounds, cutout, texels, layout, levels, corners, material, nearest, seen):
    """Draw one triangle pixel by pixel: for cut-outs, and for slivers whose facing is uncertain."""
    xa, ya, xb, yb = box
    nx, ny, nz, det = _plane(q0, q1, q2)
    for y in range(ya, yb + 1):
        py = (y + y0 + 0.5) / samples
        for x in range(xa, xb + 1):
            px = (x + x0 + 0.5) / samples
            e0 = _edge(q1, q2, px, py)
            e1 = _edge(q2, q0, px, py)
            e2 = _edge(q0, q1, px, py)
            if not ((e0 >= 0.0 and e1 >= 0.0 and e2 >= 0.0) or (e0 <= 0.0 and e1 <= 0.0 and e2 <= 0.0)):
                continue
            inverse = min(max((nx * px + (ny * py + nz)) / det, bounds[0]), bounds[1])
            if inverse > nearest[y, x]:
                total = e0 + e1 + e2
                if cutout >= 0 and (
                    total == 0.0
                    or not is_surface(texels, layout, levels, corners, material, cutout, e0 / total, e1 / total, e2 / total)
                ):
                    continue
                nearest[y, x] = inverse
                seen[y, x] = t


@njit
def _edge(a, b, px, py):
    return (a[1] * b[2] - a[2] * b[1]) * px + ((a[2] * b[0] - a[0] * b[2]) * py + (a[0] * b[1] - a[1] * b[0]))


@njit
def _plane(q0, q1, q2):
    """Normal of the triangle in homogeneous space and its product with q0, from differences: exact to the triangle's size."""
    ax, ay, az = q1[0] - q0[0], q1[1] - q0[1], q1[2] - q0[2]
    bx, by, bz = q2[0] - q0[0], q2[1] - q0[1], q2[2] - q0[2]
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    return nx, ny, nz, nx * q0[0] + ny * q0[1] + nz * q0[2]


@njit
def draw(q, cell, triangles, first, last, base, samples, x0, y0, cutout, texels, layout, levels, corners, material, nearest, seen):
    """Draw triangles [first, last) into nearest (1/z, 0 where none) and seen (triangle, -1 where none).

    `base` is the vertex q[0] stands for; (x0, y0) the canvas' first sample in samples of the image, `samples` a pixel.
    """
    height, width = nearest.shape
    u0, u1, u2, u3 = np.uintp(0), np.uintp(1), np.uintp(2), np.uintp(3)
    step = 1.0 / samples
    for t in range(first, last):
        ut = np.uintp(t)
        i0 = np.uintp(triangles[ut, u0] - base)
        i1 = np.uintp(triangles[ut, u1] - base)
        i2 = np.uintp(triangles[ut, u2] - base)
        xa = min(cell[i0, u0], cell[i1, u0], cell[i2, u0])
        ya = min(cell[i0, u1], cell[i1, u1], cell[i2, u1])
        xb = -min(cell[i0, u2], cell[i1, u2], cell[i2, u2])
        yb = -min(cell[i0, u3], cell[i1, u3], cell[i2, u3])
        if xa > xb or ya > yb or cutout[ut] == -2:
            continue
        w0, w1, w2 = q[i0, u2], q[i1, u2], q[i2, u2]
        crossing = xa == BEHIND
        if crossing:
            if w0 <= 0.0 and w1 <= 0.0 and w2 <= 0.0:
                continue
            xa, ya, xb, yb = 0, 0, width - 1, height - 1
        x_0, x_1, x_2 = q[i0, u0], q[i1, u0], q[i2, u0]
        y_0, y_1, y_2 = q[i0, u1], q[i1, u1], q[i2, u1]
        nx, ny, nz, det = _plane((x_0, y_0, w0), (x_1, y_1, w1), (x_2, y_2, w2))
        if det == 0.0:
            continue
        sliver = not crossing and abs(det) < SLIVER * (w0 * w1 * w2)
        if sliver or cutout[ut] >= 0:
            bounds = (0.0, np.inf) if crossing else (1.0 / max(w0, w1, w2), 1.0 / min(w0, w1, w2))
            _draw_checked(
                t, (x_0, y_0, w0), (x_1, y_1, w1), (x_2, y_2, w2), (xa, ya, xb, yb), samples, x0, y0, bounds,
                cutout[ut], texels, layout, levels, corners, material, nearest, seen,
            )  # fmt: skip
            continue
        a0, b0, c0 = y_1 * w2 - w1 * y_2, w1 * x_2 - x_1 * w2, x_1 * y_2 - y_1 * x_2
        a1, b1, c1 = y_2 * w0 - w2 * y_0, w2 * x_0 - x_2 * w0, x_2 * y_0 - y_2 * x_0
        a2, b2, c2 = y_0 * w1 - w0 * y_1, w0 * x_1 - x_0 * w1, x_0 * y_1 - y_0 * x_1
        if det < 0.0:
            a0, b0, c0 = -a0, -b0, -c0
            a1, b1, c1 = -a1, -b1, -c1
            a2, b2, c2 = -a2, -b2, -c2
        inverse_det = 1.0 / det
        nx, ny, nz = nx * inverse_det, ny * inverse_det, nz * inverse_det
        for y in range(ya, yb + 1):
            py = (y + y0 + 0.5) * step
            f0, f1, f2, s = b0 * py + c0, b1 * py + c1, b2 * py + c2, ny * py + nz
            l, r = xa, xb
            if xb - xa >= SMALL:
                # each edge's crossing of this row narrows the span; a pixel is left on each side for the exact test below
                low, high = float(xa), float(xb)
                if a0 > 0.0:
                    low = max(low, -f0 / a0 * samples - (x0 + 1.5))
                elif a0 < 0.0:
                    high = min(high, -f0 / a0 * samples - (x0 - 0.5))
                if a1 > 0.0:
                    low = max(low, -f1 / a1 * samples - (x0 + 1.5))
                elif a1 < 0.0:
                    high = min(high, -f1 / a1 * samples - (x0 - 0.5))
                if a2 > 0.0:
                    low = max(low, -f2 / a2 * samples - (x0 + 1.5))
                elif a2 < 0.0:
                    high = min(high, -f2 / a2 * samples - (x0 - 0.5))
                if low > high:
                    continue
                l, r = math.ceil(low), math.floor(high)
                while l <= r:
                    px = (l + x0 + 0.5) * step
                    if a0 * px + f0 >= 0.0 and a1 * px + f1 >= 0.0 and a2 * px + f2 >= 0.0:
                        break
                    l += 1
                while l <= r:
                    px = (r + x0 + 0.5) * step
                    if a0 * px + f0 >= 0.0 and a1 * px + f1 >= 0.0 and a2 * px + f2 >= 0.0:
                        break
                    r -= 1
                uy = np.uintp(y)
                for x in range(l, r + 1):
                    inverse = nx * ((x + x0 + 0.5) * step) + s
                    ux = np.uintp(x)
                    better = inverse > nearest[uy, ux]
                    nearest[uy, ux] = inverse if better else nearest[uy, ux]
                    seen[uy, ux] = t if better else seen[uy, ux]
            else:
                uy = np.uintp(y)
                for x in range(xa, xb + 1):
                    px = (x + x0 + 0.5) * step
                    if a0 * px + f0 >= 0.0 and a1 * px + f1 >= 0.0 and a2 * px + f2 >= 0.0:
                        inverse = nx * px + s
                        ux = np.uintp(x)
                        if inverse > nearest[uy, ux]:
                            nearest[uy, ux] = inverse
                            seen[uy, ux] = np.int32(t)
