"""The box of triangles seen through a distorted lens, which bends their edges.

An edge is a line in the plane z = 1 (Brown-Conrady) or an arc of the unit sphere (fisheye). If the second derivative of its
picture by length is at most b, a piece of length L stays within b L^2 / 8 of the chord between the pixels of its ends. So most
edges cannot leave the box of the triangles' corners, and the few that can are halved until no piece can.

A lens is (is a fisheye, coefficients, limit, camera matrix, table): limit as in `BentLens`; table as `tabulate` fills it. A
direction's distance from the axis is r/z for Brown-Conrady, an angle for a fisheye.
"""

from __future__ import annotations

import math

import numpy as np

from viewsphere.geometry.lenses.shared.kernels_lens import brown_conrady, radial_fisheye
from viewsphere.kernels.jit import inner, njit

TOLERANCE = 1e-5  # maximum error in pixels by which a box may be too small
LONGEST = 1 << 14  # maximum pieces of an edge: only edges that reach pixels millions away from the image need this many
HALVINGS = 60
A, B, C, D, E, F = np.uintp(0), np.uintp(1), np.uintp(2), np.uintp(3), np.uintp(4), np.uintp(5)
UNSURE = 1.02  # safety factor for the table's bends, since the table holds them only at its knots
INNERMOST = 1e-3  # radians: nearer to the axis, the terms of a fisheye's bend cancel


@inner
def _bend_brown(k, r):
    """Upper bound of a line's bend at this radius: the second derivative of rho(r) e_r along any direction, and 6 |p|."""
    s = r * r
    n = 1.0 + s * (k[0] + s * (k[1] + s * k[4]))
    d = 1.0 + s * (k[5] + s * (k[6] + s * k[7]))
    n1, n2 = k[0] + s * (2.0 * k[1] + s * 3.0 * k[4]), 2.0 * k[1] + s * 6.0 * k[4]
    d1, d2 = k[5] + s * (2.0 * k[6] + s * 3.0 * k[7]), 2.0 * k[6] + s * 6.0 * k[7]
    g = n / d
    g1 = (n1 - g * d1) / d
    g2 = (n2 - 2.0 * g1 * d1 - g * d2) / d
    across = abs(2.0 * r * g1)
    return max(abs(2.0 * r * (3.0 * g1 + 2.0 * s * g2)), across) + across + 6.0 * math.sqrt(k[2] * k[2] + k[3] * k[3])


@inner
def _bend_fisheye(k, angle):
    """Upper bound of a great circle's bend at this angle; infinite straight behind the camera."""
    angle = max(angle, INNERMOST)
    if angle >= math.pi:
        return np.inf
    s = angle * angle
    rho, rho1 = radial_fisheye(k, angle)
    rho2 = angle * (6.0 * k[0] + s * (20.0 * k[1] + s * (42.0 * k[2] + s * 72.0 * k[3])))
    sine, cosine = math.sin(angle), math.cos(angle)
    across = (rho1 * cosine - rho / sine) / sine
    return max(abs(rho2), abs(across)) + abs((rho1 - rho * cosine / sine) / sine)


@inner
def _bend(fisheye, k, off):
    return UNSURE * (_bend_fisheye(k, off) if fisheye else _bend_brown(k, off))


@njit
def tabulate(fisheye, k, limit, table):
    """Fill table (n + 1,) with upper bounds of the bend up to `off`: off / (1 + off) = i / n of its value at the limit."""
    most, last = 0.0, limit / (1.0 + limit)
    for i in range(table.shape[0]):
        share = last * i / (table.shape[0] - 1)
        most = max(most, _bend(fisheye, k, share / (1.0 - share) if i < table.shape[0] - 1 else limit))
        table[i] = most


@inner
def _knot(lens, off):
    """Index of the table's last knot, except the final one, that is not beyond `off`."""
    _, _, limit, _, table = lens
    last = table.shape[0] - 1
    return min(int(off / (1.0 + off) * ((1.0 + limit) / limit) * last), last - 1)


@inner
def _look(lens, x, y, z):
    """A direction scaled to z = 1 or to length 1, its distance from the axis (infinite where the lens has no pixel), and its
    pixel.
    """
    fisheye, k, _, m, _ = lens
    r = math.sqrt(x * x + y * y)
    length = math.sqrt(r * r + z * z)
    scale = 1.0 / length if length > 0.0 else 0.0
    off, dx, dy = np.inf, 0.0, 0.0
    if fisheye:
        x, y, z, r = x * scale, y * scale, z * scale, r * scale
        if r > 0.0 or z > 0.0:
            off = math.atan2(r, z)
            stretch = radial_fisheye(k, off)[0] / r if r > 0.0 else 1.0
            dx, dy = x * stretch, y * stretch
    elif z > 0.0:
        x, y, z = x / z, y / z, 1.0
        off = math.sqrt(x * x + y * y)
        dx, dy = brown_conrady(k, x, y)[:2]
    else:
        x, y, z = x * scale, y * scale, z * scale
    return x, y, z, off, m[0, 0] * dx + m[0, 1] * dy + m[0, 2], m[1, 1] * dy + m[1, 2]


@inner
def _between(lens, a, b, s):
    return _look(lens, a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]), a[2] + s * (b[2] - a[2]))


@inner
def _grown(box, u, v):
    return min(box[0], u), min(box[1], v), max(box[2], u), max(box[3], v)


@inner
def _length(lens, a, b):
    """Squared length of the line or arc between two directions; the length of an arc is bounded by its chord."""
    x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    square = x * x + y * y + z * z
    return square * (1.0 + 0.143 * square) ** 2 if lens[0] else square


@inner
def _farthest(lens, a, b, square):
    """Upper bound of the distance from the axis between two directions; only arcs behind the camera exceed their ends."""
    off = max(a[3], b[3])
    return off + 0.5 * math.sqrt(square) if lens[0] and off > 0.5 * math.pi else off


@inner
def _may_leave(lens, box, a, b, bend, square):
    """Return whether the picture between two directions may leave the box if it bends by at most `bend`."""
    m, out = lens[3], 0.125 * square * bend
    along_u = out * math.sqrt(m[0, 0] * m[0, 0] + m[0, 1] * m[0, 1]) - TOLERANCE
    along_v = out * m[1, 1] - TOLERANCE
    return (
        min(a[4], b[4]) - along_u < box[0]
        or min(a[5], b[5]) - along_v < box[1]
        or max(a[4], b[4]) + along_u > box[2]
        or max(a[5], b[5]) + along_v > box[3]
    )


@inner
def _followed(lens, box, a, b):
    """The box grown by an edge that the lens sees entirely; piece i of 2^level is halved while it may leave the box."""
    level, i = 0, 0
    for _ in range(LONGEST):
        step = 0.5**level
        p, q = _between(lens, a, b, i * step), _between(lens, a, b, (i + 1) * step)
        box = _grown(_grown(box, p[4], p[5]), q[4], q[5])
        square = _length(lens, p, q)
        off = min(_farthest(lens, p, q, square), lens[2])
        bend = max(lens[4][_knot(lens, off)], _bend(lens[0], lens[1], off))
        if _may_leave(lens, box, p, q, bend, square):
            level, i = level + 1, 2 * i
            continue
        i += 1
        while level > 0 and i % 2 == 0:
            level, i = level - 1, i // 2
        if level == 0:
            break
    return box


@inner
def _cut(lens, box, inside, outside):
    """The box grown by the visible part of an edge, from the end that the lens sees to the point where it leaves the lens'
    field.
    """
    low, high = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if _between(lens, inside, outside, middle)[3] <= lens[2]:
            low = middle
        else:
            high = middle
    return _followed(lens, box, inside, _between(lens, inside, outside, low))


@inner
def _turning(lens, a, b):
    """Return the point between two directions where the edge is nearest to the axis or farthest from it.

    Also return whether that point is between the directions.
    """
    aa = a[0] * a[0] + a[1] * a[1] + a[2] * a[2]
    x, y, z = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    along, square = a[0] * x + a[1] * y + a[2] * z, x * x + y * y + z * z
    below = a[2] * square - z * along
    s = (z * aa - a[2] * along) / below if below != 0.0 else -1.0
    return _between(lens, a, b, s), 0.0 < s < 1.0


@inner
def _partly(lens, box, a, b):
    """The box grown by an edge that may leave the lens' field, and whether the lens sees all of the edge."""
    limit = lens[2]
    if (a[3] <= limit) != (b[3] <= limit):
        return _cut(lens, box, a, b) if a[3] <= limit else _cut(lens, box, b, a), False
    turn, is_between = _turning(lens, a, b)
    if is_between and (turn[3] <= limit) != (a[3] <= limit):
        if turn[3] <= limit:
            return _cut(lens, _cut(lens, box, turn, a), turn, b), False
        return _cut(lens, _cut(lens, box, a, turn), b, turn), False
    return (_followed(lens, box, a, b), True) if a[3] <= limit else (box, False)


@inner
def _volume(a, b, c):
    return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])


@inner
def _holds(a, b, c, d):
    """Return whether the ray in direction d hits the triangle a, b, c."""
    whole, x, y, z = _volume(a, b, c), _volume(d, b, c), _volume(a, d, c), _volume(a, b, d)
    return (whole > 0.0 and x >= 0.0 and y >= 0.0 and z >= 0.0) or (whole < 0.0 and x <= 0.0 and y <= 0.0 and z <= 0.0)


@inner
def _corner(points, j):
    i = np.uintp(j)
    return points[i, A], points[i, B], points[i, C], points[i, D], points[i, E], points[i, F]


@inner
def _edges(lens, box, corners):
    """The box grown by a triangle's edges, and whether the lens sees all of them."""
    limit, whole = lens[2], True
    for a, b in ((corners[0], corners[1]), (corners[1], corners[2]), (corners[2], corners[0])):
        square = _length(lens, a, b)
        off = _farthest(lens, a, b, square)
        if off > limit:
            box, seen = _partly(lens, box, a, b)
            whole &= seen
        elif _may_leave(lens, box, a, b, lens[4][_knot(lens, off) + 1], square):
            box = _followed(lens, box, a, b)
    return box, whole


@njit
def look(vertices, is_used, base, r, t, lens, points):
    """Fill points (n, 6) with `_look` of the used vertices from `base` on; return their box, and whether all of them are
    visible.
    """
    box, whole = (np.inf, np.inf, -np.inf, -np.inf), True
    for j in range(points.shape[0]):
        if not is_used[j]:
            continue
        x, y, z = vertices[base + j, 0], vertices[base + j, 1], vertices[base + j, 2]
        p = _look(
            lens,
            r[0, 0] * x + r[0, 1] * y + r[0, 2] * z + t[0],
            r[1, 0] * x + r[1, 1] * y + r[1, 2] * z + t[1],
            r[2, 0] * x + r[2, 1] * y + r[2, 2] * z + t[2],
        )
        for c in range(6):
            points[j, c] = p[c]
        if p[3] <= lens[2]:
            box = _grown(box, p[4], p[5])
        else:
            whole = False
    return box, whole


@inner
def _rimmed(lens, box, a, b, c, rim):
    """The box grown by the directions of a lens' rim that are inside a triangle."""
    for i in range(rim.shape[0]):
        d = rim[i, 0], rim[i, 1], rim[i, 2]
        if _holds(a, b, c, d):
            p = _look(lens, d[0], d[1], d[2])
            box = _grown(box, p[4], p[5])
    return box


@njit
def bent_bounds(vertices, is_used, base, triangles, first, last, r, t, lens, rim, points):
    """Bounds (u0, v0, u1, v1) in pixels of the parts of triangles [first, last) that a lens sees, and whether it sees all of
    them.

    The triangles' corners are vertices [base, base + n), of which some are used; points (n, 6) is scratch. `rim` (M, 3) are the
    directions at the lens' limit where its picture turns back along u or v. The bounds are (inf, inf, -inf, -inf) if nothing is
    visible.
    """
    box, whole = look(vertices, is_used, base, r, t, lens, points)
    for f in range(np.uintp(first), np.uintp(last)):
        a, b = _corner(points, triangles[f, A] - base), _corner(points, triangles[f, B] - base)
        c = _corner(points, triangles[f, C] - base)
        box, is_seen = _edges(lens, box, (a, b, c))
        surrounds = is_seen and min(a[2], b[2], c[2]) < 0.0 and _holds(a, b, c, (0.0, 0.0, -1.0))
        if surrounds or not is_seen:
            whole = False
            box = _rimmed(lens, box, a, b, c, rim)
    return box, whole
