"""Exact rasterisation along a table of rays (distorted lenses).

A ray d hits a triangle if all e_i . d have the sign of det, with e_i = X_j x X_k in camera axes. This is the pinhole's test
without the projection, so it also holds for rays that point sideways or back. Two indices select the rays to test. Small
triangles use a cube around the camera. Its faces are cut into cells, each with the pixels whose rays pass it, and a triangle
projected on a face is bounded by its corners. All other triangles use a quadtree over the picture: each node stores the box of
its rays. Products and sums are monotone in floating point too, so an edge function over the box bounds its values over the
rays. Neither index loses a hit.
"""

from __future__ import annotations

import math

import numpy as np

from viewsphere.kernels.jit import inner, njit
from viewsphere.truth.kernel_constants import NEARER
from viewsphere.truth.raster.kernels_draw import NEVER, edges_inside, hits_surface, plane

LEAF = 8  # pixels along a leaf's side
MANY_CELLS, MANY_PIXELS = 64, 1024  # limits on the cells and pixels of a triangle's box, beyond which the tree is faster
WIDER = 1e-9  # widening of a triangle's box on a face: more than the rounding of a projection
SLIVER = 1e-12  # limit of det, as a share of the product of the corners' distances, below which its sign is not trusted
ORIGIN = (0.0, 0.0, 0.0)
NO_BOX = (0, 0, -1, -1)
ANY_DEPTH = (0.0, np.inf)  # default bounds of 1/s


@njit(_nrt=True)
def tree_levels(height, width):
    """Index of the first node, rows and columns of each level, leaves first: (L, 3) int64."""
    rows, columns = (height + LEAF - 1) // LEAF, (width + LEAF - 1) // LEAF
    levels = np.zeros((64, 3), np.int64)
    count, start = 0, 0
    while True:
        levels[count] = (start, rows, columns)
        start += rows * columns
        count += 1
        if rows == 1 and columns == 1:
            return levels[:count].copy()
        rows, columns = (rows + 1) // 2, (columns + 1) // 2


@njit(_nrt=True)
def build_tree(rays, levels):
    """Box of each node's rays, (N, 6) float64: lowest x, y, z, highest x, y, z; lowest > highest if a node has no rays."""
    height, width = rays.shape[:2]
    boxes = np.empty((levels[-1, 0] + 1, 6))
    boxes[:, :3] = np.inf
    boxes[:, 3:] = -np.inf
    for y in range(height):
        for x in range(width):
            box = boxes[y // LEAF * levels[0, 2] + x // LEAF]
            for k in range(3):
                if rays[y, x, k] == rays[y, x, k]:
                    box[k] = min(box[k], rays[y, x, k])
                    box[k + 3] = max(box[k + 3], rays[y, x, k])
    for level in range(1, len(levels)):
        below, columns_below = levels[level - 1, 0], levels[level - 1, 2]
        for j in range(levels[level - 1, 1]):
            for i in range(columns_below):
                child = boxes[below + j * columns_below + i]
                box = boxes[levels[level, 0] + j // 2 * levels[level, 2] + i // 2]
                for k in range(3):
                    box[k] = min(box[k], child[k])
                    box[k + 3] = max(box[k + 3], child[k + 3])
    return boxes


@inner
def _on_face(face, x, y, z):
    """The projection on a cube's face (0 to 5: +z, -z, +x, -x, +y, -y) and the distance along its axis; not positive if
    behind.
    """
    sign = 1.0 - 2.0 * (face % 2)
    if face < 2:
        return x / (sign * z), y / (sign * z), sign * z
    if face < 4:
        return y / (sign * x), z / (sign * x), sign * x
    return z / (sign * y), x / (sign * y), sign * y


@njit(_nrt=True)
def build_faces(rays, count, size):
    """First and last pixel whose ray passes each cell of the first `count` faces: (count, size, size, 4) x, y, x, y."""
    height, width = rays.shape[:2]
    cells = np.empty((count, size, size, 4), np.int32)
    cells[..., 0], cells[..., 1], cells[..., 2:] = width, height, -1
    for y in range(height):
        for x in range(width):
            for face in range(count):
                u, v, along = _on_face(face, rays[y, x, 0], rays[y, x, 1], rays[y, x, 2])
                if along > 0.0 and abs(u) <= 1.0 and abs(v) <= 1.0:
                    cell = cells[face, _cell(v, size), _cell(u, size)]
                    cell[0], cell[1] = min(cell[0], x), min(cell[1], y)
                    cell[2], cell[3] = max(cell[2], x), max(cell[3], y)
    return cells


@inner
def _cell(u, size):
    return min(np.int64((u + 1.0) * 0.5 * size), size - 1)


@njit
def pixel_box(cells, q0, q1, q2):
    """Return whether the triangle is small and on one face, and if so the box of pixels that may see it."""
    count, size = cells.shape[:2]
    ax, ay, az = abs(q0[0]), abs(q0[1]), abs(q0[2])
    axis = 0 if az >= ax and az >= ay else 1 if ax >= ay else 2
    face = 2 * axis + (1 if (q0[2], q0[0], q0[1])[axis] < 0.0 else 0)
    if face >= count:
        return False, NO_BOX
    u0, v0, a0 = _on_face(face, q0[0], q0[1], q0[2])
    u1, v1, a1 = _on_face(face, q1[0], q1[1], q1[2])
    u2, v2, a2 = _on_face(face, q2[0], q2[1], q2[2])
    if not (a0 > 0.0 and a1 > 0.0 and a2 > 0.0):
        return False, NO_BOX
    ua, va = min(u0, u1, u2) - WIDER, min(v0, v1, v2) - WIDER
    ub, vb = max(u0, u1, u2) + WIDER, max(v0, v1, v2) + WIDER
    if not (ua >= -1.0 and va >= -1.0 and ub <= 1.0 and vb <= 1.0):
        return False, NO_BOX
    ia, ja, ib, jb = _cell(ua, size), _cell(va, size), _cell(ub, size), _cell(vb, size)
    if (ib - ia + 1) * (jb - ja + 1) > MANY_CELLS:
        return False, NO_BOX
    xa, ya, xb, yb = np.int32(2**30), np.int32(2**30), np.int32(-1), np.int32(-1)
    for j in range(ja, jb + 1):
        for i in range(ia, ib + 1):
            cell = cells[face, j, i]
            xa, ya, xb, yb = min(xa, cell[0]), min(ya, cell[1]), max(xb, cell[2]), max(yb, cell[3])
    return (xb - xa + 1) * (yb - ya + 1) <= MANY_PIXELS or xb < 0, (xa, ya, xb, yb)


@inner
def _highest(e, box):
    return max(e[0] * box[0], e[0] * box[3]) + (max(e[1] * box[1], e[1] * box[4]) + max(e[2] * box[2], e[2] * box[5]))


@inner
def _lowest(e, box):
    return min(e[0] * box[0], e[0] * box[3]) + (min(e[1] * box[1], e[1] * box[4]) + min(e[2] * box[2], e[2] * box[5]))


@inner
def _may_hit(e0, e1, e2, sliver, box):
    """Return whether a ray in the box may pass the test of all three edges; for a sliver, also with the opposite sign."""
    if box[0] > box[3]:
        return False
    if _highest(e0, box) >= 0.0 and _highest(e1, box) >= 0.0 and _highest(e2, box) >= 0.0:
        return True
    return sliver and _lowest(e0, box) <= 0.0 and _lowest(e1, box) <= 0.0 and _lowest(e2, box) <= 0.0


@inner
def _bounds(q0, q1, q2, unit):
    """Least and greatest 1/s on a triangle."""
    if unit:
        farthest = max(_distance(q0, ORIGIN), _distance(q1, ORIGIN), _distance(q2, ORIGIN))
        nearest = farthest - max(_distance(q0, q1), _distance(q1, q2), _distance(q2, q0))
        return 1.0 / farthest, 1.0 / nearest if nearest > 0.0 else np.inf
    if q0[2] > 0.0 and q1[2] > 0.0 and q2[2] > 0.0:
        return 1.0 / max(q0[2], q1[2], q2[2]), 1.0 / min(q0[2], q1[2], q2[2])
    return 0.0, np.inf


@njit
def limits(q0, q1, q2, det, unit):
    """Return whether the triangle's facing is uncertain, and the bounds that 1/s must stay within."""
    sizes = _distance(q0, ORIGIN) * _distance(q1, ORIGIN) * _distance(q2, ORIGIN)
    sliver = abs(det) < SLIVER * sizes
    return sliver, _bounds(q0, q1, q2, unit) if sliver else ANY_DEPTH


@inner
def _distance(a, b):
    x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    return math.sqrt(x * x + y * y + z * z)


@njit(_nrt=True)
def draw(q, triangles, span, table, origin, unit, cutout, alpha_masks, nearest, seen):
    """Draw triangles into nearest (1/s, 0 if none) and seen (triangle, -1 if none).

    `span` is the first triangle, the one after the last, and the number of the vertex in q[0]; q is in camera axes. `table` is
    (rays, levels, boxes, cells), and `origin` is the canvas' first pixel (x, y) in it. If `unit` is set, the rays have length 1
    rather than z = 1.
    """
    rays, levels, boxes, cells = table
    first, last, base = span
    leaves = leaf_list(levels)
    window = (origin[0], origin[1], origin[0] + nearest.shape[1], origin[1] + nearest.shape[0])
    for t in range(first, last):
        i0, i1, i2 = triangles[t, 0] - base, triangles[t, 1] - base, triangles[t, 2] - base
        q0, q1, q2 = (q[i0, 0], q[i0, 1], q[i0, 2]), (q[i1, 0], q[i1, 1], q[i1, 2]), (q[i2, 0], q[i2, 1], q[i2, 2])
        endless = cutout[t] < NEVER
        if cutout[t] == NEVER or (not unit and not endless and q0[2] <= 0.0 and q1[2] <= 0.0 and q2[2] <= 0.0):
            continue
        small, box = (False, NO_BOX) if endless else pixel_box(cells, q0, q1, q2)
        if small and box[2] < 0:
            continue
        nx, ny, nz, det = plane(q0, q1, q2)
        if det == 0.0:
            continue
        e0, e1, e2 = edges_inside(q0, q1, q2, (nx, ny, nz), det, cutout[t])
        sliver, bounds = (False, ANY_DEPTH) if endless else limits(q0, q1, q2, det, unit)
        n = (nx / det, ny / det, nz / det)
        if small:
            _draw_box(t, e0, e1, e2, n, sliver, bounds, rays, box, origin, cutout[t], alpha_masks, nearest, seen)
            continue
        for i in range(touched(e0, e1, e2, sliver, levels, boxes, window, leaves)):
            x, y = leaves[i, 0], leaves[i, 1]
            box = (x, y, x + LEAF - 1, y + LEAF - 1)
            _draw_box(t, e0, e1, e2, n, sliver, bounds, rays, box, origin, cutout[t], alpha_masks, nearest, seen)


@njit(_nrt=True)
def leaf_list(levels):
    """An array large enough for `touched` to list all leaves of a tree."""
    return np.empty((levels[0, 1] * levels[0, 2] + 256, 3), np.int32)


@njit
def touched(e0, e1, e2, sliver, levels, boxes, window, leaves):
    """Number of leaves in the window (x0, y0, x1, y1) that the triangle may touch; their first pixels (x, y) in `leaves`.

    The end of the list is used as the stack: a tree of L levels never has more than 3 L + 1 pending nodes.
    """
    found, top = 0, leaves.shape[0]
    leaves[top - 1] = (len(levels) - 1, 0, 0)
    waiting = 1
    while waiting > 0:
        level, row, column = leaves[top - waiting]
        waiting -= 1
        side = LEAF << level
        x, y = column * side, row * side
        if y >= window[3] or y + side <= window[1] or x >= window[2] or x + side <= window[0]:
            continue
        if not _may_hit(e0, e1, e2, sliver, boxes[levels[level, 0] + row * levels[level, 2] + column]):
            continue
        if level == 0:
            leaves[found, 0], leaves[found, 1] = x, y
            found += 1
            continue
        below = level - 1
        for j in range(2 * row, min(2 * row + 2, levels[below, 1])):
            for i in range(2 * column, min(2 * column + 2, levels[below, 2])):
                waiting += 1
                leaves[top - waiting, 0], leaves[top - waiting, 1], leaves[top - waiting, 2] = below, j, i
    return found


@inner
def _draw_box(t, a, b, c, n, sliver, bounds, rays, box, origin, cutout, alpha_masks, nearest, seen):
    """Test each ray of a box of pixels (both ends included), as far as the canvas reaches."""
    height, width = nearest.shape
    x0, y0 = origin
    for y in range(max(box[1], y0), min(box[3] + 1, y0 + height)):
        for x in range(max(box[0], x0), min(box[2] + 1, x0 + width)):
            dx, dy, dz = rays[y, x, 0], rays[y, x, 1], rays[y, x, 2]
            e0 = a[0] * dx + (a[1] * dy + a[2] * dz)
            e1 = b[0] * dx + (b[1] * dy + b[2] * dz)
            e2 = c[0] * dx + (c[1] * dy + c[2] * dz)
            inside = e0 >= 0.0 and e1 >= 0.0 and e2 >= 0.0
            if inside or (sliver and e0 <= 0.0 and e1 <= 0.0 and e2 <= 0.0):
                inverse = min(max(n[0] * dx + (n[1] * dy + n[2] * dz), bounds[0]), bounds[1])
                i, j = x - x0, y - y0
                if inverse > nearest[j, i] * NEARER and hits_surface(alpha_masks, cutout, e0, e1, e2):
                    nearest[j, i] = inverse
                    seen[j, i] = t
