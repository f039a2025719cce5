"""Exact rasterisation along a table of rays (distorted lenses).

A ray d hits a triangle if all e_i . d have the sign of det, with e_i = X_j x X_k in camera axes. This is the pinhole's test
without the projection, so it also holds for rays that point sideways or back. Two indices select the rays to test. Small
triangles use a cube around the camera. Its faces are cut into cells, each with the pixels whose rays pass it, and a triangle
projected on a face is bounded by its corners. All other triangles use a quadtree over the picture: each node stores the box of
its rays. Products and sums are monotone in floating point too, so an edge function over the box bounds its values over the
rays. Neither index loses a hit. A triangle is skipped if all pixels of its box, or of a leaf, show nearer surfaces.
"""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from viewsphere.kernels.jit import inner, njit
from viewsphere.truth.kernel_constants import FOUR, NEARER
from viewsphere.truth.raster.kernels_draw import NEVER, edges_inside, hidden, hits_surface, plane
from viewsphere.truth.raster.kernels_row import draw_four_along

U = nb.uintp
LEAF = 8  # pixels along a leaf's side
MANY_CELLS = 256  # cells of a box, beyond which searching all rows is faster than reading them; measured on eight zoo models
FEW_PIXELS = 128  # pixels of a box, up to which testing each is faster than searching the tree; measured on eight zoo models
WIDER = 1e-9  # widening of a ray on a face: more than the rounding of a projection
BITS = 12  # bits of a row or a column of cells in a vertex's place
NOWHERE = -1  # place of a vertex that is on none of the faces
CLOSEST = 1e-30  # metres along a face's axis from which on a vertex is on the face
ABOVE = 1.0 + 4e-5  # bounds the rounding of 1/s, also of triangles seen almost edge-on, and how far coincident surfaces differ
OPEN = np.int32(2**31 - 1)  # number above those of all nodes that are to be searched
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
    """A point in the axes of a cube's face (0 to 5: +z, -z, +x, -x, +y, -y): across, up, and the distance along its axis; the
    distance is not positive if the point is behind.
    """
    sign = 1.0 - 2.0 * (face % 2)
    if face < 2:
        return x, y, sign * z
    if face < 4:
        return y, z, sign * x
    return z, x, sign * y


@njit(_nrt=True)
def build_faces(rays, count, size, side):
    """First and last pixel with a ray through each cell of the first `count` faces: (count, size, size, 4) x, y, x, y.

    `side` x `side` rays belong to a pixel. A single face also holds the rays beside it, in the cells of its border.
    """
    height, width = rays.shape[:2]
    cells = np.empty((count, size, size, 4), np.int32)
    cells[..., 0], cells[..., 1], cells[..., 2:] = width, height, -1
    reach = 1.0 + WIDER if count > 1 else np.inf
    for y in range(height):
        for x in range(width):
            for face in range(count):
                across, up, along = _on_face(face, rays[y, x, 0], rays[y, x, 1], rays[y, x, 2])
                if not along > 0.0:
                    continue
                u, v = across / along, up / along
                if not (abs(u) <= reach and abs(v) <= reach):
                    continue
                px, py = x // side, y // side
                for j in range(_cell(v - WIDER, size), _cell(v + WIDER, size) + 1):
                    for i in range(_cell(u - WIDER, size), _cell(u + WIDER, size) + 1):
                        cell = cells[face, j, i]
                        cell[0], cell[1] = min(cell[0], px), min(cell[1], py)
                        cell[2], cell[3] = max(cell[2], px), max(cell[3], py)
    return cells


@inner
def _cell(u, size):
    """The row or column of cells that holds a coordinate on a face; the outermost one for coordinates beyond."""
    return min(np.int64((min(max(u, -1.0), 1.0) + 1.0) * 0.5 * size), size - 1)


@njit
def place(q, cells, places, inverses):
    """Fill places (V,) int32, the cell of each vertex as (face, row, column) in one number, NOWHERE if it is on no face, and
    inverses (V,) float32, one over its distance along the face's axis.

    With six faces, each vertex is on that whose axis it is nearest to.
    """
    count, size = cells.shape[:2]
    for i in range(U(q.shape[0])):
        x, y, z = q[i, U(0)], q[i, U(1)], q[i, U(2)]
        ax, ay, az = abs(x), abs(y), abs(z)
        face = 0
        if count > 1:
            axis, positive = (0, z > 0.0) if az >= ax and az >= ay else (1, x > 0.0) if ax >= ay else (2, y > 0.0)
            face = 2 * axis + (0 if positive else 1)
        across, up, along = _on_face(face, x, y, z)
        places[i] = NOWHERE
        if along > CLOSEST and abs(across) < np.inf and abs(up) < np.inf:
            inverse = 1.0 / along
            places[i] = (face << BITS | _cell(up * inverse, size)) << BITS | _cell(across * inverse, size)
            inverses[i] = inverse


@inner
def pixel_box(cells, p0, p1, p2):
    """Return whether a triangle with these places is on one face and not very large, and if so the box of pixels that may see
    it; and the least length of a ray on its cells whose distance along the face's axis is 1.
    """
    count, size = cells.shape[:2]
    face = p0 >> 2 * BITS
    if (p0 | p1 | p2) < 0 or (p1 >> 2 * BITS) != face or (p2 >> 2 * BITS) != face:
        return False, NO_BOX, 1.0
    mask = (1 << BITS) - 1
    i0, i1, i2 = p0 & mask, p1 & mask, p2 & mask
    j0, j1, j2 = p0 >> BITS & mask, p1 >> BITS & mask, p2 >> BITS & mask
    ia, ja, ib, jb = min(i0, i1, i2), min(j0, j1, j2), max(i0, i1, i2), max(j0, j1, j2)
    if (ib - ia + 1) * (jb - ja + 1) > MANY_CELLS:
        return False, NO_BOX, 1.0
    xa, ya, xb, yb = np.int32(2**30), np.int32(2**30), np.int32(-1), np.int32(-1)
    for j in range(U(ja), U(jb + 1)):
        for i in range(U(ia), U(ib + 1)):
            xa, ya = min(xa, cells[U(face), j, i, U(0)]), min(ya, cells[U(face), j, i, U(1)])
            xb, yb = max(xb, cells[U(face), j, i, U(2)]), max(yb, cells[U(face), j, i, U(3)])
    length = 1.0
    if count > 1:
        u, v = _least(ia, ib, size), _least(ja, jb, size)
        length = math.sqrt(1.0 + u * u + v * v)
    return True, (np.int64(xa), np.int64(ya), np.int64(xb), np.int64(yb)), length


@inner
def _least(first, last, size):
    """The least absolute coordinate of these columns of cells."""
    return max(first * (2.0 / size) - 1.0, 1.0 - (last + 1) * (2.0 / size), 0.0)


@inner
def _top(e):
    """The numbers of a box at which an edge function is highest."""
    return U(3 if e[0] >= 0.0 else 0), U(4 if e[1] >= 0.0 else 1), U(5 if e[2] >= 0.0 else 2)


@inner
def _at(e, boxes, node, corner):
    """An edge function at a corner of a node's box."""
    return e[0] * boxes[node, corner[0]] + (e[1] * boxes[node, corner[1]] + e[2] * boxes[node, corner[2]])


@inner
def _may_hit(edges, tops, sliver, boxes, node):
    """Return whether a ray in the node's box may pass the test of all three edges; for a sliver, of either sign."""
    if boxes[node, U(0)] > boxes[node, U(3)]:
        return False
    (a, b, c), (p, q, r) = edges, tops
    if _at(a, boxes, node, p) >= 0.0 and _at(b, boxes, node, q) >= 0.0 and _at(c, boxes, node, r) >= 0.0:
        return True
    if not sliver:
        return False
    p, q, r = _opposite(p), _opposite(q), _opposite(r)
    return _at(a, boxes, node, p) <= 0.0 and _at(b, boxes, node, q) <= 0.0 and _at(c, boxes, node, r) <= 0.0


@inner
def _level(inverse):
    """A 1/s as a 32-bit integer with the same order if it is positive; negative numbers have negative integers."""
    return np.float32(inverse).view(np.int32)


@inner
def _opposite(corner):
    """The opposite corner of a box."""
    return U(3) - corner[0], U(5) - corner[1], U(7) - corner[2]


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
    (rays, levels, boxes, cells, places, inverses), the last two as `place` gives them, and `origin` is the canvas' first pixel
    (x, y) in it. If `unit` is set, the rays have length 1 rather than z = 1.
    """
    rays, levels, boxes, cells, places, inverses = table
    first, last, base = span
    leaves = leaf_list(levels)
    window = (origin[0], origin[1], origin[0] + nearest.shape[1], origin[1] + nearest.shape[0])
    least = np.zeros(levels[-1, 0] + 1, np.int32)
    whole = (0, 0, nearest.shape[1] - 1, nearest.shape[0] - 1)
    a, b, c = U(0), U(1), U(2)
    for t in range(first, last):
        ut = U(t)
        i0, i1, i2 = U(triangles[ut, a] - base), U(triangles[ut, b] - base), U(triangles[ut, c] - base)
        endless = cutout[ut] < NEVER
        bounded, box, length = (False, NO_BOX, 1.0) if endless else pixel_box(cells, places[i0], places[i1], places[i2])
        most = max(inverses[i0], inverses[i1], inverses[i2]) * ABOVE / length if bounded else np.inf
        box = _within(box, window) if bounded else whole
        if cutout[ut] == NEVER or box[0] > box[2] or box[1] > box[3] or _is_hidden(nearest, box, most):
            continue
        q0, q1, q2 = (q[i0, a], q[i0, b], q[i0, c]), (q[i1, a], q[i1, b], q[i1, c]), (q[i2, a], q[i2, b], q[i2, c])
        if not unit and not endless and q0[2] <= 0.0 and q1[2] <= 0.0 and q2[2] <= 0.0:
            continue
        nx, ny, nz, det = plane(q0, q1, q2)
        if det == 0.0:
            continue
        edges = edges_inside(q0, q1, q2, (nx, ny, nz), det, cutout[ut])
        sliver, bounds = (False, ANY_DEPTH) if endless else limits(q0, q1, q2, det, unit)
        surface = t, cutout[ut], sliver, edges, (nx / det, ny / det, nz / det), bounds
        few = (box[2] - box[0] + 1) * (box[3] - box[1] + 1) <= FEW_PIXELS
        pixels = box[0] + origin[0], box[1] + origin[1], box[2] + origin[0] + 1, box[3] + origin[1] + 1
        # One call of `_draw_box`, so that LLVM inlines it.
        for i in range(1 if few else touched(edges, surface[4], sliver, levels, boxes, pixels, least, OPEN, leaves)):
            part = box
            if not few:
                x, y = np.int64(leaves[i, 0]), np.int64(leaves[i, 1])
                leaf = _within((x, y, x + LEAF - 1, y + LEAF - 1), pixels)
                part = leaf[0] + box[0], leaf[1] + box[1], leaf[2] + box[0], leaf[3] + box[1]
                node = U(y // LEAF * levels[U(0), U(2)] + x // LEAF)
                bound = most if sliver else min(most, _at(surface[4], boxes, node, _top(surface[4])) * ABOVE)
                if _is_hidden(nearest, part, bound):
                    continue
            _draw_box(surface, rays, part, origin, alpha_masks, nearest, seen)


@inner
def _within(box, window):
    """A box of pixels (both ends included) as far as the window reaches, measured from the window's first pixel."""
    x0, y0, x1, y1 = window
    return max(box[0], x0) - x0, max(box[1], y0) - y0, min(box[2] + 1, x1) - 1 - x0, min(box[3] + 1, y1) - 1 - y0


@inner
def _is_hidden(nearest, box, most):
    """Return whether all pixels of a box show a surface nearer than 1/s = most; False for wide boxes, which are not tested."""
    if box[2] - box[0] >= 2 * FOUR or nearest.shape[1] < FOUR:
        return False
    return hidden(nearest, box[0], box[1], box[2], box[3], most)


@njit(_nrt=True)
def leaf_list(levels):
    """An array large enough for `touched` to list all leaves of a tree."""
    return np.empty((levels[0, 1] * levels[0, 2] + 256, 3), np.int32)


@inner
def touched(edges, n, sliver, levels, boxes, window, least, most, leaves):
    """Number of leaves in the window (x0, y0, x1, y1) that the triangle may touch; their first pixels (x, y) in `leaves`.

    A node is left out if its number in `least` is not less than `most`, or than the triangle's greatest 1/s there, n . d.
    Both are a float32 1/s as an integer of the same order.

    The search begins at the four nodes that together hold the window, or at the root. The end of the list is used as the
    stack: with L levels, never more than 3 L + 4 nodes are pending.
    """
    tops, highest = (_top(edges[0]), _top(edges[1]), _top(edges[2])), _top(n)
    size, start = max(window[2] - window[0], window[3] - window[1]), 0
    while start < len(levels) - 1 and LEAF << start < size:
        start += 1
    found, top, waiting = 0, leaves.shape[0], 0
    side = LEAF << start
    for row in range(window[1] // side, (window[3] - 1) // side + 1):
        for column in range(window[0] // side, (window[2] - 1) // side + 1):
            waiting += 1
            at = U(top - waiting)
            leaves[at, U(0)], leaves[at, U(1)], leaves[at, U(2)] = start, row, column
    while waiting > 0:
        at = U(top - waiting)
        level, row, column = np.int64(leaves[at, U(0)]), np.int64(leaves[at, U(1)]), np.int64(leaves[at, U(2)])
        waiting -= 1
        side = LEAF << level
        x, y = column * side, row * side
        if y >= window[3] or y + side <= window[1] or x >= window[2] or x + side <= window[0]:
            continue
        node = U(levels[U(level), U(0)] + row * levels[U(level), U(2)] + column)
        if least[node] >= most or not _may_hit(edges, tops, sliver, boxes, node):
            continue
        if not sliver and least[node] > 0 and least[node] >= _level(_at(n, boxes, node, highest) * ABOVE):
            continue
        if level == 0:
            leaves[U(found), U(0)], leaves[U(found), U(1)] = x, y
            found += 1
            continue
        below = level - 1
        for j in range(2 * row, min(2 * row + 2, levels[U(below), U(1)])):
            for i in range(2 * column, min(2 * column + 2, levels[U(below), U(2)])):
                waiting += 1
                at = U(top - waiting)
                leaves[at, U(0)], leaves[at, U(1)], leaves[at, U(2)] = below, j, i
    return found


@inner
def _draw_box(surface, rays, box, origin, alpha_masks, nearest, seen):
    """Test each ray of a box of the canvas' pixels (both ends included)."""
    t, cutout, sliver, (e0, e1, e2), n, _ = surface
    if cutout >= 0 or sliver or nearest.shape[1] < FOUR:
        _draw_checked(surface, rays, box, origin, alpha_masks, nearest, seen)
        return
    width, across = nearest.shape[1], rays.shape[1]
    for y in range(box[1], box[3] + 1):
        row, ray = y * width, (y + origin[1]) * across + origin[0]
        for x in range(box[0], box[2] + 1, FOUR):
            first = min(x, width - FOUR)  # pixels beside the box are tested as well
            draw_four_along(nearest, seen, U(row + first), rays, U(3 * (ray + first)), t, e0, e1, e2, n)


@inner
def _draw_checked(surface, rays, box, origin, alpha_masks, nearest, seen):
    """Draw a cut-out, or a sliver with uncertain facing, whose 1/s stays within the bounds: either sign passes the test."""
    t, cutout, sliver, (a, b, c), n, bounds = surface
    for j in range(box[1], box[3] + 1):
        for i in range(box[0], box[2] + 1):
            y, x = j + origin[1], i + origin[0]
            dx, dy, dz = rays[y, x, 0], rays[y, x, 1], rays[y, x, 2]
            e0 = a[0] * dx + (a[1] * dy + a[2] * dz)
            e1 = b[0] * dx + (b[1] * dy + b[2] * dz)
            e2 = c[0] * dx + (c[1] * dy + c[2] * dz)
            inside = e0 >= 0.0 and e1 >= 0.0 and e2 >= 0.0
            if inside or (sliver and e0 <= 0.0 and e1 <= 0.0 and e2 <= 0.0):
                inverse = min(max(n[0] * dx + (n[1] * dy + n[2] * dz), bounds[0]), bounds[1])
                if inverse > nearest[j, i] * NEARER and hits_surface(alpha_masks, cutout, e0, e1, e2):
                    nearest[j, i] = inverse
                    seen[j, i] = t
