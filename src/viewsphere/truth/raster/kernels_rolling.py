"""Exact rasterisation under a rolling shutter: each row has a matrix for the camera, and poses for the things that move.

A row's pixels are those of a picture in which all rows have its poses: triangles are transformed for each row that they touch,
and drawn by the functions of `kernels_draw`. Bands of rows select the triangles to test. In a band, each number of the matrix
from a thing's axes to pixels stays within an interval, and so does each vertex (Moore 1966, "Interval Analysis").
"""

from __future__ import annotations

import math

import numpy as np

from viewsphere.kernels.jit import inner, njit
from viewsphere.truth.raster.kernels_draw import BEHIND, NEVER, bound_vertex, draw_one
from viewsphere.truth.raster.kernels_place import there

BAND = 16  # rows: with fewer, vertices are bounded more often; with more, more triangles are tested that no row touches
SLACK = 1e-9  # share of a sum's parts by which an interval is widened: more than the rounding of its products
STEADY = 0.9  # rows that a point may move by from one row to the next to be found by steps, which then converge
STEPS = 40  # of them: 0.9 ** 40 of a picture is less than its rows
NONE, ALL = 2**30, -(2**30)  # the first row of a vertex beyond the sides, and of one that may be beside the camera


@inner
def _row_of(y, first, samples, count):
    """The row of the picture whose poses hold at row y of the canvas; rows outside have those of the first or the last."""
    return min(max((y + first) // samples, 0), count - 1)


@inner
def _matrix_of(poses, slot, moving, m, i, row, out):
    """Fill out (3, 4): from the axes of thing i, or of the ground (the number of things), to pixels at a row."""
    for r in range(3):
        for c in range(4):
            if i == poses.shape[0]:
                out[r, c] = m[row, r, c]
                continue
            p = poses[i] if slot[i] < 0 else moving[slot[i], row]
            out[r, c] = m[row, r, 0] * p[0, c] + m[row, r, 1] * p[1, c] + m[row, r, 2] * p[2, c]
            if c == 3:
                out[r, c] += m[row, r, 3]


@inner
def _bound_matrix(world, i, rows, one, middle, reach):
    """Fill middle and reach (3, 4): bounds of `_matrix_of` for the rows [first, stop) of the picture."""
    _, _, _, poses, slot, moving, m = world
    for row in range(rows[0], rows[1]):
        _matrix_of(poses, slot, moving, m, i, row, one)
        for r in range(3):
            for c in range(4):
                if row == rows[0]:
                    middle[r, c], reach[r, c] = one[r, c], one[r, c]  # the least and the greatest
                else:
                    middle[r, c], reach[r, c] = min(middle[r, c], one[r, c]), max(reach[r, c], one[r, c])
    for r in range(3):
        for c in range(4):
            low, high = middle[r, c], reach[r, c]
            middle[r, c] = (low + high) / 2
            reach[r, c] = (high - low) / 2 + SLACK * max(abs(low), abs(high))


@inner
def _interval(middle, reach, r, x, y, z):
    """The least and the greatest value of a row of the matrix at a point."""
    value = middle[r, 0] * x + middle[r, 1] * y + middle[r, 2] * z + middle[r, 3]
    off = reach[r, 0] * abs(x) + reach[r, 1] * abs(y) + reach[r, 2] * abs(z) + reach[r, 3]
    return value - off, value + off


@inner
def _quotient(low, high, least, most):
    """The bounds of a value in [low, high], divided by one in [least, most], which is positive."""
    return low / (most if low >= 0.0 else least), high / (least if high >= 0.0 else most)


@inner
def _bound_rows(middle, reach, x, y, z, samples, canvas, out, i):
    """Fill out[i] (4,): the first row and column, and the negative last ones, that a vertex may touch in a band, not limited to
    the canvas; ALL if it may be beside the camera, NONE if it has no place.
    """
    least, most = _interval(middle, reach, 2, x, y, z)
    if np.isnan(most):
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = NONE, NONE, NONE, NONE
        return
    if not least > 0.0:
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = ALL, ALL, ALL, ALL
        return
    u0, u1 = _interval(middle, reach, 0, x, y, z)
    v0, v1 = _interval(middle, reach, 1, x, y, z)
    u0, u1 = _quotient(u0, u1, least, most)
    v0, v1 = _quotient(v0, v1, least, most)
    far = 1e8
    out[i, 0] = math.floor(min(max(v0 * samples - canvas[1] - 1.0, -far), far))
    out[i, 1] = math.floor(min(max(u0 * samples - canvas[0] - 1.0, -far), far))
    out[i, 2] = -math.ceil(min(max(v1 * samples - canvas[1] + 1.0, -far), far))
    out[i, 3] = -math.ceil(min(max(u1 * samples - canvas[0] + 1.0, -far), far))


@inner
def _bound_vertex(world, i, v, middle, reach, canvas, out):
    """Fill out[v] with the `_bound_rows` of a vertex of thing i, or of the ground."""
    coordinates, ground, starts, poses = world[0], world[1], world[2], world[3]
    if i == poses.shape[0]:
        g = np.uintp(v - starts[i])
        x, y, z = ground[g, 0], ground[g, 1], ground[g, 2]
    else:
        x, y, z = np.float64(coordinates[v, 0]), np.float64(coordinates[v, 1]), np.float64(coordinates[v, 2])
    _bound_rows(middle, reach, x, y, z, canvas[0], (canvas[1], canvas[2]), out, v)


@inner
def _united(bounds, triangles, t, size, rows):
    """The first and the last row, within `rows` (first and last), and the first and the last column, that a triangle may touch;
    no row if it is beside the canvas.
    """
    i0, i1, i2 = np.uintp(triangles[t, 0]), np.uintp(triangles[t, 1]), np.uintp(triangles[t, 2])
    ya, xa = min(bounds[i0, 0], bounds[i1, 0], bounds[i2, 0]), min(bounds[i0, 1], bounds[i1, 1], bounds[i2, 1])
    yb, xb = -min(bounds[i0, 2], bounds[i1, 2], bounds[i2, 2]), -min(bounds[i0, 3], bounds[i1, 3], bounds[i2, 3])
    if xa >= size[0] or xb < 0:
        return 0, -1, 0, -1
    return max(ya, rows[0]), min(yb, rows[1]), max(xa, 0), min(xb, size[0] - 1)


@inner
def _find_ranges(world, triangles, cutout, span, middle, reach, canvas, size, bounds, ranges, thing):
    """Fill ranges (T, 2), the first and the last row of the canvas that each triangle of a thing may touch, and those of the
    thing (2,); returns the number of their bands. Triangles that labels never see count, too: pictures may show them.
    """
    whole, total = (0, size[1] - 1), 0
    thing[0], thing[1] = size[1], -1
    for v in range(np.uintp(world[2][span[0]]), np.uintp(world[2][span[0] + 1])):
        _bound_vertex(world, span[0], v, middle, reach, canvas, bounds)
    for t in range(span[1], span[2]):
        ya, yb, _, _ = (0, size[1] - 1, 0, 0) if cutout[t] < NEVER else _united(bounds, triangles, t, size, whole)
        if ya <= yb:
            thing[0], thing[1] = min(thing[0], ya), max(thing[1], yb)
            total += yb // BAND - ya // BAND + 1
        ranges[t, 0], ranges[t, 1] = ya, yb if ya <= yb else -1
    return total


@njit(_nrt=True)
def list_active(world, triangles, cutout, spans, canvas, size, ends):
    """The triangles that each band of the canvas's rows may touch, in their order, (n, 6) int32: the triangle, its thing, its
    first row and its last, its first column and its last. Fills ends (bands,), the number of rows up to the end of each band.

    `world` holds coordinates (V, 3), ground (4, 3), starts (N + 2,) of the vertices of things and ground, poses (N, 4, 4) of
    things, slot (N,) int32, -1 or the thing's place in moving (M, H, 4, 4), and m (H, 3, 4), from the world to pixels.
    `spans` (n, 3) are things with their first triangle and the one after the last; `canvas` is the number of samples along a
    pixel's side, and the canvas's first sample (x, y); `size` its width and height.
    """
    count, pictured = world[0].shape[0], world[6].shape[0]
    one, middle, reach = np.empty((3, 4)), np.empty((3, 4)), np.empty((3, 4))
    bounds, stamp, ranges = (
        np.empty((count, 4), np.int32),
        np.full(count, -1, np.int32),
        np.empty((len(triangles), 2), np.int32),
    )
    total, things = 0, np.empty((spans.shape[0], 2), np.int32)  # the rows that each thing may touch
    for k in range(spans.shape[0]):
        _bound_matrix(world, spans[k, 0], (0, pictured), one, middle, reach)
        total += _find_ranges(world, triangles, cutout, spans[k], middle, reach, canvas, size, bounds, ranges, things[k])
    active, n = np.empty((total, 6), np.int32), 0
    for band in range(ends.shape[0]):
        begin, end = band * BAND, min(band * BAND + BAND, size[1])
        rows = _row_of(begin, canvas[2], canvas[0], pictured), _row_of(end - 1, canvas[2], canvas[0], pictured) + 1
        for k in range(spans.shape[0]):
            if things[k, 0] >= end or things[k, 1] < begin:
                continue
            i, first, last = spans[k, 0], spans[k, 1], spans[k, 2]
            _bound_matrix(world, i, rows, one, middle, reach)
            for t in range(first, last):
                if ranges[t, 0] >= end or ranges[t, 1] < begin:
                    continue
                ya, yb, xa, xb = begin, end - 1, 0, size[0] - 1
                if cutout[t] >= NEVER:
                    for c in range(3):
                        v = np.uintp(triangles[t, c])
                        if stamp[v] != band:
                            stamp[v] = band
                            _bound_vertex(world, i, v, middle, reach, canvas, bounds)
                    ya, yb, xa, xb = _united(bounds, triangles, t, size, (begin, end - 1))
                if ya <= yb:
                    active[n, 0], active[n, 1], active[n, 2], active[n, 3] = t, i, ya, yb
                    active[n, 4], active[n, 5] = xa, xb
                    n += 1
        ends[band] = n
    return active[:n]


@inner
def project_vertex(world, i, row, v, q):
    """Fill q[v] as `kernels_place.project` and `kernels_draw.transform` do with the poses of a row."""
    coordinates, ground, starts, poses, slot, moving, all_rows = world
    m = all_rows[row]
    if i == poses.shape[0]:
        g = np.uintp(v - starts[i])
        x, y, z = ground[g, 0], ground[g, 1], ground[g, 2]
    else:
        p = poses[i] if slot[i] < 0 else moving[slot[i], row]
        x, y, z = there(p, coordinates[v, 0], coordinates[v, 1], coordinates[v, 2])
    q[v, 0] = m[0, 0] * x + m[0, 1] * y + m[0, 2] * z + m[0, 3]
    q[v, 1] = m[1, 0] * x + m[1, 1] * y + m[1, 2] * z + m[1, 3]
    w = m[2, 0] * x + m[2, 1] * y + m[2, 2] * z + m[2, 3]
    q[v, 2], q[v, 3] = w, 1.0 / w if w > 0.0 else np.inf


@inner
def is_turned_away(q, i0, i1, i2):
    """Return whether a camera sees the back of a triangle, as `geometry.seen_from` tests it."""
    ax, ay, az = q[i1, 0] - q[i0, 0], q[i1, 1] - q[i0, 1], q[i1, 2] - q[i0, 2]
    bx, by, bz = q[i2, 0] - q[i0, 0], q[i2, 1] - q[i0, 1], q[i2, 2] - q[i0, 2]
    x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    return x * q[i0, 0] + y * q[i0, 1] + z * q[i0, 2] > 0.0


@njit(_nrt=True)
def draw(world, triangles, single, cutout, alpha_masks, edge_on, canvas, active, ends, nearest, seen):
    """Draw the triangles that `list_active` gives into nearest (1/z, 0 if none) and seen (triangle, -1 if none), in C order.

    single (T,) marks single-sided triangles. edge_on (H,) marks the rows whose camera is in the plane of the ground.
    """
    height, width = nearest.shape
    samples, x0, y0 = canvas
    count, rows = len(world[0]), world[6].shape[0]
    q, cell, stamp = np.empty((count, 4)), np.empty((count, 4), np.int32), np.full(count, -1, np.int32)
    for y in range(height):
        row = _row_of(y, y0, samples, rows)
        for k in range(ends[y // BAND - 1] if y >= BAND else 0, ends[y // BAND]):
            if y < active[k, 2] or y > active[k, 3]:
                continue
            t, i = np.uintp(active[k, 0]), active[k, 1]
            is_ground = i == world[3].shape[0]
            if is_ground and edge_on[row]:
                continue
            corners = np.uintp(triangles[t, 0]), np.uintp(triangles[t, 1]), np.uintp(triangles[t, 2])
            for v in corners:
                if stamp[v] != y:
                    stamp[v] = y
                    project_vertex(world, i, row, v, q)
                    bound_vertex(q, v, samples, x0, y0, width, height, cell)
                    if is_ground:
                        cell[v, 0], cell[v, 1], cell[v, 2], cell[v, 3] = BEHIND, BEHIND, BEHIND, BEHIND
            if single[t] and is_turned_away(q, corners[0], corners[1], corners[2]):
                continue
            draw_one(np.int32(t), q, cell, corners, (y, y), canvas, cutout[t], alpha_masks, nearest, seen)


@inner
def _meet_row(m, row, x, y, z, out):
    """Fill out (3,): column and row of a point in the picture of a row's poses, and its w."""
    u = m[row, 0, 0] * x + m[row, 0, 1] * y + m[row, 0, 2] * z + m[row, 0, 3]
    v = m[row, 1, 0] * x + m[row, 1, 1] * y + m[row, 1, 2] * z + m[row, 1, 3]
    w = m[row, 2, 0] * x + m[row, 2, 1] * y + m[row, 2, 2] * z + m[row, 2, 3]
    out[0], out[1], out[2] = u / w, v / w, w


@inner
def _crosses(m, row, x, y, z, one, two):
    """Return whether a point passes a place between the centres of a row and of the next one when that place is exposed; its
    column and row are then interpolated between both, in one.
    """
    _meet_row(m, row, x, y, z, one)
    _meet_row(m, row + 1, x, y, z, two)
    if not (one[2] > 0.0 and two[2] > 0.0):
        return False
    before, after = one[1] - (row + 0.5), two[1] - (row + 1.5)
    if not ((before >= 0.0 and after <= 0.0) or (before <= 0.0 and after >= 0.0)):
        return False
    share = before / (before - after) if before != after else 0.0
    one[0] += share * (two[0] - one[0])
    one[1] = row + 0.5 + share
    return True


@inner
def _is_steady(middle, reach, step, x, y, z):
    """Return whether a point moves by less than a row from each row to the next, so that the picture shows it once."""
    least, _ = _interval(middle, reach, 2, x, y, z)
    if not least > 0.0:
        return False
    low, high = _interval(middle, reach, 1, x, y, z)
    far = max(abs(low), abs(high)) / least
    x, y, z = abs(x), abs(y), abs(z)
    down = step[1, 0] * x + step[1, 1] * y + step[1, 2] * z + step[1, 3]
    away = step[2, 0] * x + step[2, 1] * y + step[2, 2] * z + step[2, 3]
    return down + far * away < STEADY * least


@inner
def _steps_to(m, x, y, z, one, two):
    """Return whether a steady point is found between two rows by steps towards it, in one as by `_crosses`."""
    height = m.shape[0]
    _meet_row(m, height // 2, x, y, z, one)
    for _ in range(STEPS):
        row = min(max(np.int64(math.floor(one[1] - 0.5)), 0), height - 2)
        if _crosses(m, row, x, y, z, one, two):
            return True
        if (row == 0 and one[1] <= 0.5) or (row == height - 2 and two[1] >= height - 0.5):
            return False
    return False


@njit(_nrt=True)
def find_pixels(points, m, out):
    """Fill out (n, 3): column and row at which a rolling shutter shows each point (n, 3) float64, and its w; NaN if it is
    behind the camera.

    m (H, 3, 4) leads from the points' axes to pixels at each row. A point may be shown several times, whenever its row is
    exposed: the time nearest to that of the picture's middle counts. Outside the picture, the poses are those of the first
    or the last row.
    """
    height = m.shape[0]
    one, two = np.empty(3), np.empty(3)
    middle, reach, step = np.empty((3, 4)), np.empty((3, 4)), np.zeros((3, 4))
    for r in range(3):
        for c in range(4):
            low, high = m[:, r, c].min(), m[:, r, c].max()
            middle[r, c], reach[r, c] = (low + high) / 2, (high - low) / 2 + SLACK * max(abs(low), abs(high))
            for row in range(1, height):
                step[r, c] = max(step[r, c], abs(m[row, r, c] - m[row - 1, r, c]))
    for i in range(points.shape[0]):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        out[i, 0], out[i, 1], out[i, 2] = np.nan, np.nan, np.nan
        is_steady = height > 1 and _is_steady(middle, reach, step, x, y, z)
        if is_steady and _steps_to(m, x, y, z, one, two):
            out[i, 0], out[i, 1], out[i, 2] = one[0], one[1], one[2]
            continue
        if not (is_steady and _is_beyond(m, x, y, z, one, two)) and _scan(m, x, y, z, one, two, out[i]):
            continue
        _meet_row(m, 0, x, y, z, one)
        _meet_row(m, height - 1, x, y, z, two)
        above, below = one[2] > 0.0 and one[1] <= 0.5, two[2] > 0.0 and two[1] >= height - 0.5
        if above and not (below and two[1] - height / 2 < height / 2 - one[1]):
            out[i, 0], out[i, 1], out[i, 2] = one[0], one[1], one[2]
        elif below:
            out[i, 0], out[i, 1], out[i, 2] = two[0], two[1], two[2]


@inner
def _scan(m, x, y, z, one, two, out):
    """Return whether a point is shown between two rows; out (3,) is the place nearest to the middle of the picture."""
    height, off = m.shape[0], np.inf
    for away in range(height):
        for side in range(2):
            row = (height - 1) // 2 + away if side else height // 2 - 1 - away
            if row < 0 or row > height - 2 or not _crosses(m, row, x, y, z, one, two):
                continue
            if abs(one[1] - height / 2) < off:
                off = abs(one[1] - height / 2)
                out[0], out[1], out[2] = one[0], one[1], one[2]
        if off < np.inf:
            return True
    return False


@inner
def _is_beyond(m, x, y, z, one, two):
    """Return whether a point is above the centre of the first row, or below that of the last, at the time of that row."""
    _meet_row(m, 0, x, y, z, one)
    _meet_row(m, m.shape[0] - 1, x, y, z, two)
    return one[1] < 0.5 or two[1] > m.shape[0] - 0.5


@njit
def list_runs(seen, run, triangle, row):
    """Number the runs of equal triangles in each row of seen (H, W): fill run (H, W), -1 where nothing is seen, and the
    triangle and row of each run; returns their number.
    """
    count = 0
    for y in range(seen.shape[0]):
        last = -1
        for x in range(seen.shape[1]):
            t = seen[y, x]
            if t < 0:
                run[y, x] = -1
            else:
                if t != last:
                    triangle[count], row[count] = t, y
                    count += 1
                run[y, x] = count - 1
            last = t
    return count


@njit(_nrt=True)
def project_runs(world, triangles, owners, triangle, row, q):
    """Fill q (3 n, 4) with the corners of runs (n,) at their rows, in homogeneous pixels."""
    count = world[0].shape[0]
    one = np.empty((count, 4))
    for k in range(triangle.shape[0]):
        t = triangle[k]
        for c in range(3):
            v = np.uintp(triangles[t, c])
            project_vertex(world, owners[t], row[k], v, one)
            for j in range(4):
                q[3 * k + c, j] = one[v, j]
