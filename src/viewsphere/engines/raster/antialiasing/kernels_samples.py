"""Exact rasterisation of a few chosen pixels with several points each: the computation is bitwise that of truth, at any point
of a pixel.

Point m of chosen pixel k (see `kernels_chosen`) is at (x, y) + `offsets`[:, m]. `nearest` (1/z of the nearest solid surface, 0
if there is none) and `seen` (its triangle) are (K, M). `farthest` (H, W) holds, as a `level`, the 1/z that a surface must
exceed to matter to a pixel, and CLOSED for pixels that are not drawn. `tiles` holds its minimum in each tile. See-through
surfaces are listed from near to far in `inverses` and `listed` (K, M, capacity), with their number at each point in `counts`.
"""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from viewsphere.engines.raster.antialiasing.kernels_chosen import CLOSED, TILE, level
from viewsphere.engines.raster.antialiasing.kernels_four import FOUR, along, covered
from viewsphere.kernels.jit import inner, njit
from viewsphere.truth.kernel_constants import NEARER
from viewsphere.truth.raster.kernels_draw import (
    BEHIND,
    EPSILON,
    NEVER,
    ROUNDED_UP,
    SLIVER,
    crossing_at,
    edges_inside,
    hits_surface,
    plane,
)
from viewsphere.truth.raster.kernels_parallel import covers, depth_at, surface_of
from viewsphere.truth.raster.kernels_rays import ABOVE, ANY_DEPTH, LEAF, NO_BOX, leaf_list, limits, pixel_box, touched
from viewsphere.truth.raster.kernels_rolling import BAND, is_turned_away, project_vertex

U = nb.uintp
TIE = 1e-5  # relative difference of 1/z below which two surfaces count as coincident
NARROW = TILE  # pixels: up to this size, every pixel of a triangle's box is tested
MEDIUM = 64  # pixels: up to this size, every tile of a box is tested, beyond it every row


@inner
def _box(q, i0, i1, i2, reach, width, height):
    """First and last pixel (x0, y0, x1, y1) in which points may be covered; x0 is BEHIND if a corner is behind the camera."""
    c, d = U(2), U(3)
    if min(q[i0, c], q[i1, c], q[i2, c]) <= 0.0:
        return BEHIND, 0, 0, 0
    low, high = reach[0] - EPSILON, reach[1] + EPSILON
    x0, x1, x2 = q[i0, U(0)] * q[i0, d], q[i1, U(0)] * q[i1, d], q[i2, U(0)] * q[i2, d]
    y0, y1, y2 = q[i0, U(1)] * q[i0, d], q[i1, U(1)] * q[i1, d], q[i2, U(1)] * q[i2, d]
    return (
        math.ceil(min(max(min(x0, x1, x2) - high, 0.0), float(width))),
        math.ceil(min(max(min(y0, y1, y2) - high, 0.0), float(height))),
        math.floor(max(min(max(x0, x1, x2) - low, width - 1.0), -1.0)),
        math.floor(max(min(max(y0, y1, y2) - low, height - 1.0), -1.0)),
    )


@njit(_nrt=True)
def around(q, triangles, runs, cutout, left_out, window):
    """Triangles, int64, that may touch a window (x0, y0, x1, y1; in pixels, inclusive), except those in `left_out`. `runs` are
    those of `kernels_edges.with_corners_before`.
    """
    x0, y0, x1, y1 = window
    side = np.empty(q.shape[0], np.uint8)  # one bit for each side of the window that the vertex is beyond
    a, b, c, d = U(0), U(1), U(2), U(3)
    of_vertices, of_triangles = runs
    for k in range(of_vertices.shape[0]):
        for i in range(U(of_vertices[k, 0]), U(of_vertices[k, 1])):
            side[i] = 0
            if q[i, c] > 0.0:
                x, y = q[i, a] * q[i, d], q[i, b] * q[i, d]
                side[i] = (x < x0) | ((x > x1 + 1.0) << 1) | ((y < y0) << 2) | ((y > y1 + 1.0) << 3)
    order = np.empty(triangles.shape[0] + 1, np.int64)
    n = U(0)
    for k in range(of_triangles.shape[0]):
        for t in range(U(of_triangles[k, 0]), U(of_triangles[k, 1])):
            order[n] = t
            beyond = side[U(triangles[t, a])] & side[U(triangles[t, b])] & side[U(triangles[t, c])]
            n += U(((beyond == 0) | (cutout[t] < NEVER)) & (not left_out[t]))
    return order[:n]


@njit(_nrt=True)
def touched_boxes(q, order, triangles, reach, farthest):
    """Pixels inside these triangles' boxes that show a surface behind the triangle's nearest corner, (H, W) uint8."""
    height, width = farthest.shape
    marks = np.zeros((height, width), np.uint8)
    a, b, c, d = U(0), U(1), U(2), U(3)
    for i in range(U(order.shape[0])):
        t = U(order[i])
        i0, i1, i2 = U(triangles[t, a]), U(triangles[t, b]), U(triangles[t, c])
        xa, ya, xb, yb = _box(q, i0, i1, i2, reach, width, height)
        if xa == BEHIND:
            xa, ya, xb, yb = 0, 0, width - 1, height - 1
        most = level(max(q[i0, d], q[i1, d], q[i2, d]) * (ROUNDED_UP + TIE))
        for y in range(ya, yb + 1):
            for x in range(xa, xb + 1):
                marks[U(y), U(x)] |= farthest[U(y), U(x)] < most
    return marks


@njit
def first(grid, y, x):
    """Number of the first chosen pixel at or after this one."""
    k = grid[U(y), U(x)]
    return max(k, ~k)


@njit(_nrt=True)
def draw(q, order, triangles, cutout, alpha_masks, see_through, points, solid, fragments):
    """Draw the triangles in `order` through a pinhole.

    `points` is (grid, pixels, offsets, (lowest, highest offset)), `solid` (nearest, seen, farthest, tiles), `fragments`
    (inverses, listed, counts, q).
    """
    found = np.empty(max(points[0].shape[1], MEDIUM * MEDIUM) + 1, np.uint32)
    rows = (0, points[0].shape[0] - 1)
    for i in range(U(order.shape[0])):
        t = order[i]
        _draw_one(t, q, triangles, rows, cutout, alpha_masks, see_through, points, solid, fragments, found)


@inner(forceinline=True)  # a call would copy all arguments to the stack: half as long again
def _draw_one(t, q, triangles, rows, cutout, alpha_masks, see_through, points, solid, fragments, found):
    """Draw a triangle into these rows, the last one included."""
    grid, _, _, _ = points
    farthest, tiles = solid[2], solid[3][1]
    height, width = grid.shape
    a, b, c, d = U(0), U(1), U(2), U(3)
    ut = U(t)
    i0, i1, i2 = U(triangles[ut, a]), U(triangles[ut, b]), U(triangles[ut, c])
    endless = cutout[ut] < NEVER
    xa, ya, xb, yb = (BEHIND, 0, 0, 0) if endless else _box(q, i0, i1, i2, points[3], width, height)
    crossing = xa == BEHIND
    if not crossing:
        ya, yb = max(ya, rows[0]), min(yb, rows[1])
    if xa > xb or ya > yb or cutout[ut] == NEVER:
        return
    most = level(np.inf if endless else max(q[i0, d], q[i1, d], q[i2, d]) * (ROUNDED_UP + TIE))
    narrow = xb - xa < NARROW and yb - ya < NARROW
    count = U(0)
    if not crossing and _is_hidden(tiles, xa, ya, xb, yb, most):
        return
    if narrow:
        count = _open(farthest, xa, ya, xb, yb, most, found)
        if count == 0:
            return
    q0, q1, q2 = (q[i0, a], q[i0, b], q[i0, c]), (q[i1, a], q[i1, b], q[i1, c]), (q[i2, a], q[i2, b], q[i2, c])
    w0, w1, w2 = q0[2], q1[2], q2[2]
    if crossing:
        xa, ya, xb, yb = 0, rows[0], width - 1, rows[1]
    nx, ny, nz, det = plane(q0, q1, q2)
    if det == 0.0 or (w0 <= 0.0 and w1 <= 0.0 and w2 <= 0.0 and not endless):
        return
    e0, e1, e2 = edges_inside(q0, q1, q2, (nx, ny, nz), det, cutout[ut])
    checked = cutout[ut] >= 0 or see_through[ut] or (not crossing and abs(det) < SLIVER * (w0 * w1 * w2))
    bounds = (0.0, np.inf)
    if checked and not crossing:
        bounds = (1.0 / max(w0, w1, w2), 1.0 / min(w0, w1, w2))
    surface = (t, cutout[ut], see_through[ut], (nx, ny, nz, det), bounds)
    box, edges = (xa, ya, xb, yb), (e0, e1, e2)
    if not narrow:
        _draw_wide(surface, edges, checked, box, most, found, points, alpha_masks, triangles, solid, fragments)
    elif checked:
        _draw_checked(surface, edges, found, count, points, alpha_masks, triangles, solid, fragments)
    else:
        _draw_solid(surface, edges, found, count, points, solid)


@inner
def _draw_wide(surface, edges, checked, box, most, found, points, alpha_masks, triangles, solid, fragments):
    """Draw a triangle tile by tile, or row by row if it is very large."""
    xa, ya, xb, yb = box
    farthest, blocks = solid[2], solid[3][0]
    medium = not checked and xb - xa < MEDIUM and yb - ya < MEDIUM
    scales = (crossing_at(edges[0][0], 1), crossing_at(edges[1][0], 1), crossing_at(edges[2][0], 1))
    for y in range(ya, ya + 1 if medium else yb + 1):
        if medium:
            count = _open_tiles(farthest, blocks, box, edges, False, most, found)
        else:
            span = (xa, xb) if checked else _span(edges, scales, y, xa, xb, points[3])
            count = _open_row(farthest, points, y, span, yb - ya < NARROW, most, found)
        if count == 0:
            continue
        if checked:
            _draw_checked(surface, edges, found, count, points, alpha_masks, triangles, solid, fragments)
        else:
            _draw_solid(surface, edges, found, count, points, solid)


@inner
def _is_hidden(tiles, xa, ya, xb, yb, most):
    """Return whether, by the tiles' minima, no pixel of the box shows anything farther than `most`."""
    for row in range(U(ya // TILE), U(yb // TILE + 1)):
        for column in range(U(xa // TILE), U(xb // TILE + 1)):
            if tiles[row, column] < most:
                return False
    return True


@inner
def _open(farthest, xa, ya, xb, yb, most, found):
    """Pixels of the box that show a surface farther than `most`, as row << 16 | column."""
    count = U(0)
    for y in range(U(ya), U(yb + 1)):
        for x in range(U(xa), U(xb + 1)):
            found[count] = y << U(16) | x
            count += U(farthest[y, x] < most)
    return count


@inner
def _open_tiles(farthest, blocks, box, edges, checked, most, found):
    """The pixels of `_open`, limited to the tiles of the box that the triangle may touch, by the signs of its edges unless it
    is `checked`.
    """
    xa, ya, xb, yb = box
    count = U(0)
    for row in range(ya // TILE, yb // TILE + 1):
        for column in range(xa // TILE, xb // TILE + 1):
            if blocks[U(row), U(column)] >= most:
                continue
            x, y = float(column * TILE), float(row * TILE)
            outside = _is_outside(edges[0], x, y) or _is_outside(edges[1], x, y) or _is_outside(edges[2], x, y)
            if outside and not checked:
                continue
            for v in range(U(max(ya, row * TILE)), U(min(yb, row * TILE + TILE - 1) + 1)):
                for u in range(U(max(xa, column * TILE)), U(min(xb, column * TILE + TILE - 1) + 1)):
                    found[count] = v << U(16) | u
                    count += U(farthest[v, u] < most)
    return count


@inner
def _is_outside(e, x, y):
    """Return whether the whole tile that begins at (x, y) is outside an edge."""
    return max(e[0] * x, e[0] * (x + TILE)) + (max(e[1] * y, e[1] * (y + TILE)) + e[2]) < 0.0


@inner
def _open_row(farthest, points, y, span, thorough, most, found):
    """The pixels of `_open` for a part of a row; for a long part, only chosen pixels, unless `thorough`."""
    grid, pixels, _, _ = points
    left, right = span
    if left > right:
        return U(0)
    if thorough or right - left < NARROW:
        return _open(farthest, left, y, right, y, most, found)
    width, count = grid.shape[1], U(0)
    k, end = U(first(grid, y, left)), y * width + right
    while pixels[k] <= end:
        x = U(pixels[k] - y * width)
        found[count] = U(y) << U(16) | x
        count += U(farthest[U(y), x] < most)
        k += U(1)
    return count


@inner
def _span(edges, scales, y, xa, xb, reach):
    """First and last pixel of a row in which a point may be covered."""
    low, high = float(xa), float(xb)
    lowest, highest = reach
    for e, scale in zip(edges, scales):  # noqa: B905, numba knows no strict
        f = max(e[1] * (y + lowest), e[1] * (y + highest)) + e[2]
        if e[0] > 0.0:
            low = max(low, f * scale - highest - EPSILON)
        elif e[0] < 0.0:
            high = min(high, f * scale - lowest + EPSILON)
        elif f < 0.0:
            high = -1.0
    return (0, -1) if low > high else (math.ceil(low), math.floor(high))


@inner
def _draw_solid(surface, edges, found, count, points, solid):
    """Draw a solid triangle at these pixels: four points are tested at once, single points only if any is covered."""
    grid, _, offsets, _ = points
    nearest, seen, farthest, _ = solid
    t, _, _, (nx, ny, nz, det), _ = surface
    e0, e1, e2 = edges
    inverse = 1.0 / det
    n = (nx * inverse, ny * inverse, nz * inverse)
    m, zero, one = U(nearest.shape[1]), U(0), U(1)
    for j in range(count):
        row, column = U(found[j] >> np.uint32(16)), U(found[j] & np.uint32(0xFFFF))
        x, y = float(column), float(row)
        covered = 0
        for i in range(U(4)):
            px, py = x + offsets[zero, i], y + offsets[one, i]
            covered |= (
                (e0[0] * px + (e0[1] * py + e0[2]) >= 0.0)
                & (e1[0] * px + (e1[1] * py + e1[2]) >= 0.0)
                & (e2[0] * px + (e2[1] * py + e2[2]) >= 0.0)
            )
        if not covered:
            continue
        k = grid[row, column]
        least = CLOSED
        for i in range(m):
            px, py = x + offsets[zero, i], y + offsets[one, i]
            inside = (
                (e0[0] * px + (e0[1] * py + e0[2]) >= 0.0)
                & (e1[0] * px + (e1[1] * py + e1[2]) >= 0.0)
                & (e2[0] * px + (e2[1] * py + e2[2]) >= 0.0)
            )
            inverse = n[0] * px + (n[1] * py + n[2])
            old = nearest[U(k), i]
            if inside & _is_before(inverse, t, old, seen[U(k), i]):
                nearest[U(k), i], seen[U(k), i] = inverse, t
            least = min(least, level(nearest[U(k), i]))
        farthest[row, column] = max(farthest[row, column], least)


@inner
def _is_before(inverse, t, old, seen):
    """Return whether triangle t is visible instead of triangle `seen`. Truth, which draws in order, decides
    only by `NEARER`.
    """
    return (inverse > old * NEARER) | ((t < seen) & (inverse * NEARER >= old))


@inner
def _draw_checked(surface, edges, found, count, points, alpha_masks, triangles, solid, fragments):
    """Draw a cut-out, a sliver or a see-through triangle at these pixels."""
    grid, _, offsets, _ = points
    nearest, _, farthest, _ = solid
    for j in range(count):
        row, column = found[j] >> np.uint32(16), found[j] & np.uint32(0xFFFF)
        k = grid[row, column]
        least = CLOSED
        for i in range(nearest.shape[1]):
            ray = (column + offsets[0, i], row + offsets[1, i], 1.0)
            _cast(surface, edges, ray, (U(k), U(i)), alpha_masks, triangles, solid, fragments)
            least = min(least, level(nearest[U(k), U(i)]))
        farthest[row, column] = max(farthest[row, column], least)


@inner
def _cast(surface, edges, ray, p, alpha_masks, triangles, solid, fragments):
    """Process one point's ray as truth does for cut-outs and slivers; a see-through surface is listed."""
    t, cutout, is_see_through, (nx, ny, nz, det), bounds = surface
    nearest, seen = solid[0], solid[1]
    a, b, c = edges
    x, y, z = ray
    e0, e1, e2 = a[0] * x + (a[1] * y + a[2] * z), b[0] * x + (b[1] * y + b[2] * z), c[0] * x + (c[1] * y + c[2] * z)
    if not ((e0 >= 0.0 and e1 >= 0.0 and e2 >= 0.0) or (e0 <= 0.0 and e1 <= 0.0 and e2 <= 0.0)):
        return
    inverse = min(max((nx * x + (ny * y + nz * z)) / det, bounds[0]), bounds[1])
    if is_see_through:
        if inverse > 0.0 and inverse * (1.0 + TIE) >= nearest[p] and hits_surface(alpha_masks, cutout, e0, e1, e2):
            _insert(t, inverse, p, triangles, fragments)
    elif _is_before(inverse, t, nearest[p], seen[p]) and hits_surface(alpha_masks, cutout, e0, e1, e2):
        nearest[p] = inverse
        seen[p] = t


@inner
def _insert(t, inverse, p, triangles, fragments):
    """List a see-through surface by distance; of coincident surfaces, the last triangle is in front.

    If two coincident triangles share an edge, only one is listed: the point is on that edge, or one triangle is the other's
    back.
    """
    k, m = p
    inverses, listed, counts, q = fragments
    near, here = inverses[k, m], listed[k, m]
    capacity, count = len(near), np.int64(counts[p])
    at = count
    while at > 0 and inverse * (1.0 + TIE) >= near[at - 1]:
        at -= 1
        if inverse <= near[at] * (1.0 + TIE) and _share_edge(q, triangles, t, here[at]):
            return
    if at == capacity:
        return
    for i in range(min(count, capacity - 1), at, -1):
        near[i], here[i] = near[i - 1], here[i - 1]
    near[at], here[at] = inverse, t
    counts[p] = min(count + 1, capacity)


@inner
def _share_edge(q, triangles, s, t):
    """Return whether two corners of triangle s coincide with corners of t."""
    same = 0
    for i in range(3):
        for j in range(3):
            a, b = triangles[s, i], triangles[t, j]
            if q[a, 0] == q[b, 0] and q[a, 1] == q[b, 1] and q[a, 2] == q[b, 2]:
                same += 1
    return same >= 2


@njit
def gather_rays(rays, pixels, side, found):
    """Fill found (K, 3, M) with the rays of the K chosen pixels, `side` x `side` of `rays` (side H, side W, 3) for each."""
    across = U(rays.shape[1]) // U(side)
    for k in range(U(pixels.shape[0] - 1)):
        y, x = U(pixels[k]) // across * U(side), U(pixels[k]) % across * U(side)
        for i in range(U(side * side)):
            for c in range(U(3)):
                found[k, c, i] = rays[y + i // U(side), x + i % U(side), c]


@njit(_nrt=True)
def draw_rays(q, order, triangles, cutout, alpha_masks, see_through, unit, table, points, solid, fragments):
    """The equivalent of `draw` along rays: `table` is (rays, levels, boxes, cells) of `kernels_rays`, with S x S rays per
    pixel.

    `points` is (grid, rays, S, places, inverses): rays are those of `gather_rays`, the last two those of `kernels_rays.place`.
    q is in camera axes. If `unit` is set, the rays have length 1 rather than z = 1.
    """
    _, levels, boxes, cells = table
    grid, _, side, places, inverses = points
    farthest, tiles = solid[2], solid[3]
    leaves, found, least = leaf_list(levels), np.empty(TILE * TILE + 1, np.uint32), _least_levels(farthest, levels, side)
    whole = (0, 0, grid.shape[1] - 1, grid.shape[0] - 1)
    a, b, c = U(0), U(1), U(2)
    for o in range(U(order.shape[0])):
        t = order[o]
        ut = U(t)
        i0, i1, i2 = U(triangles[ut, a]), U(triangles[ut, b]), U(triangles[ut, c])
        endless = cutout[ut] < NEVER
        bounded, box, length = (False, NO_BOX, 1.0) if endless else pixel_box(cells, places[i0], places[i1], places[i2])
        nearest = max(inverses[i0], inverses[i1], inverses[i2]) * ABOVE / length if bounded else np.inf
        box, most = box if bounded else whole, level(nearest)
        if cutout[ut] == NEVER or box[2] < 0 or (bounded and _is_hidden(tiles[0], box[0], box[1], box[2], box[3], most)):
            continue
        narrow, count = box[2] - box[0] < TILE and box[3] - box[1] < TILE, U(0)
        if narrow:
            count = _open(farthest, box[0], box[1], box[2], box[3], most, found)
            if count == 0:
                continue
        q0, q1, q2 = (q[i0, a], q[i0, b], q[i0, c]), (q[i1, a], q[i1, b], q[i1, c]), (q[i2, a], q[i2, b], q[i2, c])
        if not unit and not endless and q0[2] <= 0.0 and q1[2] <= 0.0 and q2[2] <= 0.0:
            continue
        nx, ny, nz, det = plane(q0, q1, q2)
        if det == 0.0:
            continue
        edges = edges_inside(q0, q1, q2, (nx, ny, nz), det, cutout[ut])
        sliver, bounds = (False, ANY_DEPTH) if endless else limits(q0, q1, q2, det, unit)
        surface = (t, cutout[ut], see_through[ut], (nx, ny, nz, det), bounds)
        n = (nx / det, ny / det, nz / det)
        leaf, pixels = LEAF // side, (box[0] * side, box[1] * side, (box[2] + 1) * side, (box[3] + 1) * side)
        for i in range(1 if narrow else touched(edges, n, sliver, levels, boxes, pixels, least, most, leaves)):
            if not narrow:
                x, y = np.int64(leaves[i, 0]) // side, np.int64(leaves[i, 1]) // side
                xa, ya, xb, yb = max(x, box[0]), max(y, box[1]), min(x + leaf - 1, box[2]), min(y + leaf - 1, box[3])
                count = _open(farthest, xa, ya, xb, yb, most, found)
            _cast_all(surface, edges, sliver, found, count, points, alpha_masks, triangles, solid, fragments)


@inner(forceinline=True)  # a call would copy all arguments to the stack: ten times the time
def _cast_all(surface, edges, sliver, found, count, points, alpha_masks, triangles, solid, fragments):
    """Cast the rays of these pixels at a triangle."""
    grid, rays, _, _, _ = points
    nearest, seen, farthest, _ = solid
    t, cutout, is_see_through, (nx, ny, nz, det), _ = surface
    plain = nearest.shape[1] == FOUR and not sliver
    level_plane = nx / det * ABOVE, ny / det * ABOVE, nz / det * ABOVE
    for j in range(count):
        row, column = U(found[j] >> np.uint32(16)), U(found[j] & np.uint32(0xFFFF))
        k, least, which = U(grid[row, column]), CLOSED, np.intp(15)
        if plain:
            which = np.intp(along(edges, level_plane, rays, nearest, k))
            if which == 0:
                continue
        for i in range(U(nearest.shape[1])):
            if which >> i & 1:
                ray = rays[k, U(0), i], rays[k, U(1), i], rays[k, U(2), i]
                if plain and cutout < 0 and not is_see_through:
                    inverse = max((nx * ray[0] + (ny * ray[1] + nz * ray[2])) / det, 0.0)
                    if _is_before(inverse, t, nearest[k, i], seen[k, i]):
                        nearest[k, i], seen[k, i] = inverse, t
                else:
                    _cast(surface, edges, ray, (k, i), alpha_masks, triangles, solid, fragments)
            least = min(least, level(nearest[k, i]))
        farthest[row, column] = max(farthest[row, column], least)


@inner(_nrt=True)
def _least_levels(farthest, levels, side):
    """The minimum of `farthest` in each node of a tree of rays, `side` x `side` of which belong to a pixel: (N,) int32."""
    least = np.full(levels[-1, 0] + 1, CLOSED)
    leaf, columns = U(LEAF // side), U(levels[0, 2])
    for y in range(U(farthest.shape[0])):
        for x in range(U(farthest.shape[1])):
            node = y // leaf * columns + x // leaf
            least[node] = min(least[node], farthest[y, x])
    for n in range(1, len(levels)):
        for j in range(levels[n - 1, 1]):
            for i in range(levels[n - 1, 2]):
                node = U(levels[n, 0] + j // 2 * levels[n, 2] + i // 2)
                least[node] = min(least[node], least[U(levels[n - 1, 0] + j * levels[n - 1, 2] + i)])
    return least


@njit(_nrt=True)
def draw_parallel(q, order, triangles, cutout, alpha_masks, see_through, points, solid, fragments):
    """The equivalent of `draw` along parallel rays, with vertices q of `kernels_parallel`."""
    grid, _, offsets, reach = points
    farthest, tiles = solid[2], solid[3]
    height, width = grid.shape
    found = np.empty(max(width, MEDIUM * MEDIUM) + 1, np.uint32)
    d = U(3)
    for n in range(U(order.shape[0])):
        t = order[n]
        ut = U(t)
        i, j, k = U(triangles[ut, U(0)]), U(triangles[ut, U(1)]), U(triangles[ut, U(2)])
        endless = cutout[ut] < NEVER
        if cutout[ut] == NEVER or (not endless and max(q[i, d], q[j, d], q[k, d]) <= 0.0):
            continue
        xa, ya, xb, yb = 0, 0, width - 1, height - 1
        if not endless:
            us, vs = (q[i, U(0)], q[j, U(0)], q[k, U(0)]), (q[i, U(1)], q[j, U(1)], q[k, U(1)])
            xa, xb = _pixels(min(us), max(us), reach, width)
            ya, yb = _pixels(min(vs), max(vs), reach, height)
        least = min(q[i, d], q[j, d], q[k, d])
        most = level((ROUNDED_UP + TIE) / least if least > 0.0 and not endless else np.inf)
        box = xa, ya, xb, yb
        if xa > xb or ya > yb or (not endless and _is_hidden(tiles[0], xa, ya, xb, yb, most)):
            continue
        narrow, count = xb - xa < TILE and yb - ya < TILE, U(0)
        if narrow:
            count = _open(farthest, xa, ya, xb, yb, most, found)
            if count == 0:
                continue
        area, edges, slope, bounds = surface_of(q, i, j, k, cutout[ut])
        if area == 0.0:
            continue
        checked = cutout[ut] >= 0 or see_through[ut] or (not endless and abs(area) < SLIVER)
        surface = t, cutout[ut], see_through[ut], checked, edges, slope, bounds
        tiled, thorough = xb - xa < MEDIUM and yb - ya < MEDIUM, yb - ya < NARROW
        scales = crossing_at(edges[0][0], 1), crossing_at(edges[1][0], 1), crossing_at(edges[2][0], 1)
        for y in range(ya, ya + 1 if tiled else yb + 1):
            if tiled and not narrow:
                count = _open_tiles(farthest, tiles[0], box, edges, checked, most, found)
            elif not narrow:
                span = (xa, xb) if checked else _span(edges, scales, y, xa, xb, reach)
                count = _open_row(farthest, points, y, span, thorough, most, found)
            _cast_parallel(surface, found, count, grid, offsets, alpha_masks, triangles, solid, fragments)


@inner
def _pixels(low, high, reach, size):
    """First and last of `size` pixels with points between two places."""
    first = math.ceil(min(max(low - (reach[1] + EPSILON), 0.0), float(size)))
    return first, math.floor(max(min(high - (reach[0] - EPSILON), size - 1.0), -1.0))


@inner(forceinline=True)  # a call would copy all arguments to the stack: twice the time
def _cast_parallel(surface, found, count, grid, offsets, alpha_masks, triangles, solid, fragments):
    """Draw a surface at the points of these pixels."""
    t, _, _, checked, edges, slope, bounds = surface
    nearest, seen, farthest, _ = solid
    plain = not checked and nearest.shape[1] == FOUR
    for j in range(count):
        row, column = U(found[j] >> np.uint32(16)), U(found[j] & np.uint32(0xFFFF))
        k, least, which, x, y = U(grid[row, column]), CLOSED, np.intp(15), float(np.int64(column)), float(np.int64(row))
        if plain:
            which = np.intp(covered(edges, slope, bounds, x, y, offsets, nearest, k))
            if which == 0:
                continue
        for i in range(U(nearest.shape[1])):
            if which >> i & 1:
                px, py = x + offsets[U(0), i], y + offsets[U(1), i]
                z = depth_at(slope, bounds, px, py)
                if plain and z > 0.0:
                    inverse = 1.0 / z
                    if _is_before(inverse, t, nearest[k, i], seen[k, i]):
                        nearest[k, i], seen[k, i] = inverse, t
                elif z > 0.0:
                    _cast_checked(surface, px, py, 1.0 / z, (k, i), alpha_masks, triangles, solid, fragments)
            least = min(least, level(nearest[k, i]))
        farthest[row, column] = max(farthest[row, column], least)


@inner
def _cast_checked(surface, px, py, inverse, p, alpha_masks, triangles, solid, fragments):
    """Draw a cut-out, a sliver or a see-through surface at a point, where its 1/z is `inverse`."""
    t, cutout, is_see_through, checked, edges, _, _ = surface
    nearest, seen = solid[0], solid[1]
    inside, e0, e1, e2 = covers(edges, checked, px, py)
    if not inside:
        return
    if is_see_through:
        if inverse * (1.0 + TIE) >= nearest[p] and hits_surface(alpha_masks, cutout, e0, e1, e2):
            _insert(t, inverse, p, triangles, fragments)
    elif _is_before(inverse, t, nearest[p], seen[p]) and hits_surface(alpha_masks, cutout, e0, e1, e2):
        nearest[p], seen[p] = inverse, t


@njit(_nrt=True)
def draw_rolling(
    world, triangles, single, chosen, cutout, alpha_masks, see_through, edge_on, active, ends, points, solid, fragments, q
):
    """The equivalent of `draw` under a rolling shutter, for the triangles in `chosen` (T,); the other arguments are those of
    `kernels_rolling.draw`. q (V, 4), also in `fragments`, holds the vertices of the row that is drawn.
    """
    grid = points[0]
    height, width = grid.shape
    found, stamp = np.empty(max(width, MEDIUM * MEDIUM) + 1, np.uint32), np.full(world[0].shape[0], -1, np.int32)
    for y in range(height):
        if points[1][first(grid, y, 0)] >= (y + 1) * width:
            continue  # no pixel of the row is chosen
        for k in range(ends[y // BAND - 1] if y >= BAND else 0, ends[y // BAND]):
            t, i = U(active[k, 0]), active[k, 1]
            if y < active[k, 2] or y > active[k, 3] or not chosen[t] or (i == world[3].shape[0] and edge_on[y]):
                continue
            if points[1][first(grid, y, active[k, 4])] > y * width + active[k, 5]:
                continue  # no pixel that the triangle may touch is chosen
            corners = U(triangles[t, 0]), U(triangles[t, 1]), U(triangles[t, 2])
            for v in corners:
                if stamp[v] != y:
                    stamp[v] = y
                    project_vertex(world, i, y, v, q)
            if single[t] and is_turned_away(q, corners[0], corners[1], corners[2]):
                continue
            _draw_one(np.int64(t), q, triangles, (y, y), cutout, alpha_masks, see_through, points, solid, fragments, found)
