"""Samples of edge pixels through a pinhole, for colour: only triangles that can matter are drawn, at few pixels.

A pixel is numbered (`grid`, -1 elsewhere) if its centre looks different from a neighbour's. While drawing, a pixel is also
numbered if a surface passes between the centres and in front of their surfaces (a thin wire). A triangle can matter in three
cases: a centre at or beside such a pixel shows it; it has a visible corner at or beside such a pixel; or it has a corner
anywhere in front of the surface shown there. `kernels_lines` marks more pixels and triangles beforehand.
"""

from __future__ import annotations

import math

import numba as nb
import numpy as np

from viewsphere.engines.raster.antialiasing.kernels_chosen import ALIKE, LEVEL
from viewsphere.engines.raster.antialiasing.kernels_four import cover, inside, nearer, put_before
from viewsphere.kernels.jit import inner, njit
from viewsphere.kernels.prefetching import AHEAD, prefetch
from viewsphere.truth.raster.kernels_draw import EPSILON, NEVER, crossing_at, edges_inside, hits_surface, plane

f4 = nb.float32
U = nb.uintp
STEEPEST = f4(0.9)  # share of 1/z: how much farther a sample may be than the centres around its pixel
SLACK = f4(0.01)  # relative difference of 1/z up to which two surfaces count as the same
FLUSH = f4(1.001)  # tolerance of 1/z: a vertex in a surface that is already drawn does not count as behind it
NARROW = 8  # pixels: up to this size, every pixel of a triangle's box is tested
CELL = 16  # pixels: width of the cells in a row that index numbered pixels
FEW = 4  # numbered pixels in a row's cells: up to this many, testing each is faster than computing the covered part of the row
THIN = 2.0  # pixels: a triangle this wide is visible at some pixel's centre


@njit
def begin(pixels, total, triangle, depth, grid, limit, starts, bound, nearest, seen, wanted):
    """Number the `total` marked pixels, and also mark in `wanted` (T,) the triangles that the centres around these pixels show.

    Fill starts (H * cells a row + 1,): the first number in each `CELL`, or after it; grid (H, W); limit (H, W): the 1/z that a
    surface must exceed to matter to a pixel; bound (n,): 1/z of the farthest surface that may be visible at each number, 0 if
    there is none; nearest (n, 4) float32 1/z and seen (n, 4) triangles, -1 if none is drawn yet.
    """
    height, width = triangle.shape
    cells, cell = (width + CELL - 1) // CELL, U(0)
    for k in range(U(total)):
        y, x = pixels[k] // width, pixels[k] % width
        while cell <= U(y * cells + x // CELL):
            starts[cell] = k
            cell += U(1)
        least = depth[U(y), U(x)]
        for j in range(U(max(y - 1, 0)), U(min(y + 2, height))):
            for i in range(U(max(x - 1, 0)), U(min(x + 2, width))):
                least = min(least, depth[j, i])
                t = triangle[j, i]
                if (t >= 0) & ((U(x) == i) | (U(y) == j)):
                    wanted[U(t)] = 1
        least *= STEEPEST
        grid[U(y), U(x)], limit[U(y), U(x)], bound[k] = k, least, least
        for i in range(U(4)):
            nearest[k, i], seen[k, i] = least, np.int32(-1)
    starts[cell:] = total


@njit
def spread(pixels, count, limit, around):
    """Lower around (H, W), a copy of limit, next to numbered pixels to the limit of these: small triangles there may reach
    them.
    """
    height, width = limit.shape
    for k in range(U(count)):
        y, x = pixels[k] // width, pixels[k] % width
        least = limit[U(y), U(x)]
        for j in range(U(max(y - 1, 0)), U(min(y + 2, height))):
            for i in range(U(max(x - 1, 0)), U(min(x + 2, width))):
                around[j, i] = min(around[j, i], least)


@njit
def with_corners_before(q, triangles, runs, wanted, limit, near, others):
    """Mark in `others` (T,) unwanted triangles that have a vertex in front of the limit of its pixel; `near` (V,) is scratch.
    `runs` are the runs of vertices and of triangles to test: `truth.raster.visibility.in_picture`.
    """
    height, width = limit.shape
    a, b, c, d = U(0), U(1), U(2), U(3)
    of_vertices, of_triangles = runs
    for k in range(of_vertices.shape[0]):
        for i in range(U(of_vertices[k, 0]), U(of_vertices[k, 1])):
            x, y = q[i, a] * q[i, d], q[i, b] * q[i, d]
            near[i] = 0
            if (q[i, c] > 0.0) & (x > -1.0) & (y > -1.0) & (x < width + 1.0) & (y < height + 1.0):
                column, row = min(max(np.int64(x), 0), width - 1), min(max(np.int64(y), 0), height - 1)
                near[i] = f4(q[i, d]) * FLUSH > limit[U(row), U(column)]
    for k in range(of_triangles.shape[0]):
        for t in range(U(of_triangles[k, 0]), U(of_triangles[k, 1])):
            others[t] = near[U(triangles[t, a])] | near[U(triangles[t, b])] | near[U(triangles[t, c])]
            others[t] &= wanted[t] ^ 1


@njit
def draw(  # noqa: PLR0912, PLR0915, one loop, whose state is not worth handing around
    order, q, triangles, cutout, alpha_masks, room, offsets, triangle, depth, grid, limit, pixels, starts, count, nearest, seen
):
    """Draw these triangles at the four samples (`offsets` (2, 4)) of the `count` numbered pixels.

    `room` is `samples._room`; the other arrays are those of `begin`. For a numbered pixel, limit is raised to 1/z of its
    farthest sample. Returns the final number of numbered pixels. In a town, waiting for vertices took a third of the time, so
    they are prefetched.
    """
    height, width = triangle.shape
    found, covered, inverse = room
    cells = (width + CELL - 1) // CELL
    a, b, c, d = U(0), U(1), U(2), U(3)
    lowest, highest = offsets[a, d], offsets[a, b]  # the outermost samples along either axis
    total = U(order.shape[0])
    for o in range(total):
        t = U(order[min(o + U(AHEAD), total - U(1))])
        prefetch(q, U(4) * U(triangles[t, a]))
        prefetch(q, U(4) * U(triangles[t, b]))
        prefetch(q, U(4) * U(triangles[t, c]))
        t = U(order[o])
        i0, i1, i2 = U(triangles[t, a]), U(triangles[t, b]), U(triangles[t, c])
        q0, q1, q2 = (q[i0, a], q[i0, b], q[i0, c]), (q[i1, a], q[i1, b], q[i1, c]), (q[i2, a], q[i2, b], q[i2, c])
        w0, w1, w2 = q[i0, d], q[i1, d], q[i2, d]
        high, low = max(w0, w1, w2), min(w0, w1, w2)
        if cutout[t] < NEVER:
            high, low = np.inf, 0.0
        before, crossing = f4(high), high == np.inf
        xa, ya, xb, yb = 0, 0, width - 1, height - 1
        if not crossing:
            u0, u1, u2, v0, v1, v2 = q0[0] * w0, q1[0] * w1, q2[0] * w2, q0[1] * w0, q1[1] * w1, q2[1] * w2
            xa = math.ceil(max(min(u0, u1, u2) - (highest + EPSILON), 0.0))
            ya = math.ceil(max(min(v0, v1, v2) - (highest + EPSILON), 0.0))
            xb = math.floor(min(max(u0, u1, u2) - (lowest - EPSILON), width - 1.0))
            yb = math.floor(min(max(v0, v1, v2) - (lowest - EPSILON), height - 1.0))
        elif q0[2] <= 0.0 and q1[2] <= 0.0 and q2[2] <= 0.0 and cutout[t] >= NEVER:
            continue
        if xa > xb or ya > yb or cutout[t] == NEVER:
            continue
        nx, ny, nz, det = plane(q0, q1, q2)
        if det == 0.0:
            continue
        edges = edges_inside(q0, q1, q2, (nx, ny, nz), det, cutout[t])
        scale = 1.0 / det
        level = nx * scale, ny * scale, nz * scale
        narrow = xb - xa < NARROW and yb - ya < NARROW
        # The width is at most twice the area in pixels over the longer side of the box.
        thin = not crossing and abs(det) * w0 * w1 * w2 < THIN * max(xb - xa, yb - ya)
        for y in range(ya, ya + 1 if narrow else yb + 1):
            n, row, cell, left, right = U(0), U(y), y * cells, xa, xb
            if narrow:
                n = cover(edges, level, (low, high), (xa, ya, xb, yb), offsets, limit, room)
            elif thin or starts[cell + xb // CELL + 1] - starts[cell + xa // CELL] > FEW:
                left, right = span(edges, y, xa, xb, lowest, highest)
            if thin and not narrow:
                for x in range(left, right + 1):
                    found[n] = row << U(16) | U(x)
                    n += U(before > limit[row, U(x)])
            elif left <= right and not narrow:
                for k in range(U(starts[cell + left // CELL]), U(starts[cell + right // CELL + 1])):
                    x = U(pixels[k] - y * width)
                    found[n] = row << U(16) | x
                    n += U((x >= U(left)) & (x <= U(right)) & (before > limit[row, x]))
            for j in range(n):
                row, column = U(found[j] >> np.uint32(16)), U(found[j] & np.uint32(0xFFFF))
                x, v = float(np.int32(column)), float(np.int32(row))
                if not narrow:
                    covered[j] = inside(edges, level, (low, high), x, v, offsets, inverse, j)
                k = grid[row, column]
                u = U(k)
                if k < 0:
                    if count == pixels.shape[0]:
                        continue
                    u = U(count)
                    for i in range(U(4)):
                        nearest[u, i], seen[u, i] = depth[row, column], triangle[row, column]
                which = np.intp(covered[j]) & nearer(inverse, j, nearest, u)
                if which != 0 and cutout[t] >= 0:
                    which &= _hits(edges, x, v, offsets, alpha_masks, cutout[t])
                if which == 0:
                    continue
                if k < 0:
                    ahead = f4(0)
                    for i in range(U(4)):
                        ahead = max(ahead, inverse[j, i] if (which >> i) & 1 else f4(0))
                    if ahead <= limit[row, column]:
                        continue
                    grid[row, column], pixels[u] = count, row * U(width) + column
                    count += 1
                limit[row, column] = put_before(which, inverse, j, np.int32(t), nearest, seen, u)
    return count


@inner
def _hits(edges, x, y, offsets, alpha_masks, cutout):
    """The samples of the pixel at (x, y) at which a triangle with a cut-out is surface: one bit for each sample."""
    e0, e1, e2 = edges
    found = 0
    for i in range(U(4)):
        px, py = x + offsets[U(0), i], y + offsets[U(1), i]
        f0, f1, f2 = e0[1] * py + e0[2], e1[1] * py + e1[2], e2[1] * py + e2[2]
        found |= hits_surface(alpha_masks, cutout, e0[0] * px + f0, e1[0] * px + f1, e2[0] * px + f2) << i
    return found


@inner
def span(edges, y, xa, xb, lowest, highest):
    """First and last pixel of a row in which a sample may be covered."""
    low, high = float(xa), float(xb)
    for e in edges:
        f = max(e[1] * (y + lowest), e[1] * (y + highest)) + e[2]
        if e[0] > 0.0:
            low = max(low, f * crossing_at(e[0], 1) - highest - EPSILON)
        elif e[0] < 0.0:
            high = min(high, f * crossing_at(e[0], 1) - lowest + EPSILON)
        elif f < 0.0:
            high = -1.0
    return (0, -1) if low > high else (math.ceil(low), math.floor(high))


@njit
def finish(
    count, pixels, nearest, seen, bound, offsets, triangle, depth, owner, normals, behind, kept, position, shown, inverses
):
    """Pixels whose samples do not all look like the centre: pixels, position, triangle, 1/z, as defined in `samples.Samples`.

    Pixels marked in behind (H * W,), if `behind` is not empty, are also kept. If nothing was drawn at a sample, although all
    centres around show something, the sample shows the surface at its pixel's centre. The last four arrays have room for all
    pixels; returns the number of pixels.
    """
    width = triangle.shape[1]
    a, b, c, d = U(0), U(1), U(2), U(3)
    n = U(0)
    for k in range(U(count)):
        p = pixels[k]
        y, x = U(p // width), U(p % width)
        centre, level = triangle[y, x], depth[y, x]
        is_filled = k < U(bound.shape[0]) and bound[k] > f4(0)
        none = np.int32(-1) if is_filled else centre
        s0, s1, s2, s3 = seen[k, a], seen[k, b], seen[k, c], seen[k, d]
        is_deep = behind.shape[0] != 0 and behind[U(p)] != 0
        is_even = ((s0 == centre) | (s0 == none)) & ((s1 == centre) | (s1 == none))
        is_even &= ((s2 == centre) | (s2 == none)) & ((s3 == centre) | (s3 == none))
        if is_even and not is_deep:
            continue
        differs = is_deep
        u = U(max(centre, np.int32(0)))
        o = owner[u] if centre >= 0 else np.int32(-1)
        for i in range(U(4)):
            t, z, m = seen[k, i], nearest[k, i], U(4) * n + i
            missing = (t < 0) & is_filled
            t, z = centre if missing else t, level if missing else z
            shown[m], inverses[m] = t, z
            if t == centre:
                continue
            s = U(max(t, np.int32(0)))
            bend = normals[u, a] * normals[s, a] + normals[u, b] * normals[s, b] + normals[u, c] * normals[s, c]
            other = owner[s] if t >= 0 else np.int32(-1)
            differs |= (o != other) | (abs(bend) < f4(ALIKE)) | (max(level, z) > min(level, z) * f4(LEVEL))
        if differs:
            kept[n] = p
            for i in range(U(4)):
                m = U(4) * n + i
                position[m, a], position[m, b] = float(np.int32(x)) + offsets[a, i], float(np.int32(y)) + offsets[b, i]
            n += U(1)
    return n
