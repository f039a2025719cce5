"""Kernels of voxels. Points are in units of cells; cell (i, j, k) starts at the point (i, j, k)."""

from __future__ import annotations

import math

from viewsphere.kernels.jit import inner, njit

SLACK = 1e-9
"""Rounding error, in cells, of the place where a plane crosses a column."""


@inner
def _separated(p, q, r, reach):
    """Return whether the range of three values is disjoint from the interval [-reach, reach]."""
    return min(p, q, r) > reach or max(p, q, r) < -reach


@inner
def _edge_apart(s, t, au, av, bu, bv, cu, cv):
    """Return whether an edge (s, t) separates a triangle from the square around 0, as seen along an axis."""
    return _separated(s * av - t * au, s * bv - t * bu, s * cv - t * cu, 0.5 * (abs(s) + abs(t)))


@inner
def _edges_apart(au, av, bu, bv, cu, cv):
    """Return whether any edge of a triangle separates it from the square around 0, as seen along an axis."""
    return (
        _edge_apart(bu - au, bv - av, au, av, bu, bv, cu, cv)
        or _edge_apart(cu - bu, cv - bv, au, av, bu, bv, cu, cv)
        or _edge_apart(au - cu, av - cv, au, av, bu, bv, cu, cv)
    )


@inner
def _extent(points, triangles, t, axis):
    """Return the begin and the end of a triangle along an axis."""
    p, q, r = points[triangles[t, 0], axis], points[triangles[t, 1], axis], points[triangles[t, 2], axis]
    return min(p, q, r), max(p, q, r)


@inner
def _cells(low, high, count):
    """The cells, in a grid with this many, that an extent overlaps."""
    return range(math.floor(max(low, 0.0)), math.floor(min(high, count - 1.0)) + 1)


@inner
def _normal_of(points, triangles, t, u, v):
    """The component of a triangle's normal along the axis after u and v, scaled by twice the triangle's area."""
    i, j, k = triangles[t, 0], triangles[t, 1], triangles[t, 2]
    p, q = points[j, u] - points[i, u], points[j, v] - points[i, v]
    r, s = points[k, u] - points[i, u], points[k, v] - points[i, v]
    return p * s - q * r


@inner
def _columns(points, triangles, t, w, owner, filled, value):
    """`touch` for one triangle, in columns along axis w."""
    u, v = (w + 1) % 3, (w + 2) % 3
    a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
    low_u, high_u = _extent(points, triangles, t, u)
    low_v, high_v = _extent(points, triangles, t, v)
    low_w, high_w = _extent(points, triangles, t, w)
    if high_w < 0.0 or low_w >= owner.shape[w]:
        return
    nu, nv = _normal_of(points, triangles, t, v, w), _normal_of(points, triangles, t, w, u)
    nw = _normal_of(points, triangles, t, u, v)
    for i in _cells(low_u, high_u, owner.shape[u]):
        x = i + 0.5
        au, bu, cu = points[a, u] - x, points[b, u] - x, points[c, u] - x
        for j in _cells(low_v, high_v, owner.shape[v]):
            y = j + 0.5
            av, bv, cv = points[a, v] - y, points[b, v] - y, points[c, v] - y
            if _edges_apart(au, av, bu, bv, cu, cv):
                continue
            first, last = low_w, high_w
            if nw != 0.0:
                middle = points[a, w] + (au * nu + av * nv) / nw
                reach = 0.5 * (abs(nu) + abs(nv)) / abs(nw) + SLACK * (1.0 + abs(middle))
                first, last = max(first, middle - reach), min(last, middle + reach)
            for k in _cells(first, last, owner.shape[w]):
                z = k + 0.5
                aw, bw, cw = points[a, w] - z, points[b, w] - z, points[c, w] - z
                if _edges_apart(av, aw, bv, bw, cv, cw) or _edges_apart(aw, au, bw, bu, cw, cu):
                    continue
                cell = (i, j, k) if w == 2 else ((k, i, j) if w == 0 else (j, k, i))
                if owner[cell] < 0:
                    owner[cell] = t
                    filled[cell] = value


@njit
def touch(points, triangles, rows, owner, filled, value):
    """Assign each unowned (-1) cell of `owner` (X, Y, Z) to the first triangle of these rows that overlaps it, and write the
    value to `filled`.

    The test is exact except for rounding: separating axes (Akenine-Moller 2001) for the cells in the columns that the
    triangle's projection meets. The columns are along the axis that the triangle faces most. The plane and the box of the
    triangle bound each column.
    """
    for t in rows:
        x = abs(_normal_of(points, triangles, t, 1, 2))
        y = abs(_normal_of(points, triangles, t, 2, 0))
        z = abs(_normal_of(points, triangles, t, 0, 1))
        w = 2 if z >= x and z >= y else (1 if y >= x else 0)
        _columns(points, triangles, t, w, owner, filled, value)


@inner
def _turns(px, py, qx, qy, x, y):
    """1 if the edge from p to q passes right of a point upwards, -1 if downwards, otherwise 0. Two triangles that share an edge
    always get opposite values, because both compute the same expression.
    """
    if (py > y) == (qy > y):
        return 0
    if py < qy:
        beyond = (x - px) * (qy - py) < (y - py) * (qx - px)
        return 1 if beyond else 0
    beyond = (x - qx) * (py - qy) < (y - qy) * (px - qx)
    return -1 if beyond else 0


@inner
def _around(points, triangles, t, u, v, x, y):
    """Return the winding number of a triangle's edges around a point of the plane of axes u and v: 1, -1 or 0."""
    i, j, k = triangles[t, 0], triangles[t, 1], triangles[t, 2]
    return (
        _turns(points[i, u], points[i, v], points[j, u], points[j, v], x, y)
        + _turns(points[j, u], points[j, v], points[k, u], points[k, v], x, y)
        + _turns(points[k, u], points[k, v], points[i, u], points[i, v], x, y)
    )


@inner
def _crossing(points, triangles, t, u, v, w, x, y):
    """Return the coordinate where a line along axis w crosses a triangle whose projection contains the line's point.

    x, y: the line's point in the plane of axes u and v.
    """
    i, j, k = triangles[t, 0], triangles[t, 1], triangles[t, 2]
    pu, pv, pw = points[j, u] - points[i, u], points[j, v] - points[i, v], points[j, w] - points[i, w]
    qu, qv, qw = points[k, u] - points[i, u], points[k, v] - points[i, v], points[k, w] - points[i, w]
    area = pu * qv - pv * qu
    low, high = min(0.0, pw, qw), max(0.0, pw, qw)
    if area == 0.0:
        return points[i, w] + low
    s, r = x - points[i, u], y - points[i, v]
    height = ((s * qv - r * qu) * pw + (pu * r - pv * s) * qw) / area
    return points[i, w] + min(max(height, low), high)


@inner
def _span(points, triangles, t, axis, count):
    """The cells [first, stop) along an axis whose centres may be inside a triangle's extent."""
    p, q, r = points[triangles[t, 0], axis], points[triangles[t, 1], axis], points[triangles[t, 2], axis]
    first, stop = max(math.ceil(min(p, q, r) - 0.5), 0.0), min(math.floor(max(p, q, r) - 0.5) + 1.0, float(count))
    return int(min(first, float(count))), int(max(stop, 0.0))


@njit
def wind(points, triangles, rows, winding):
    """Add the winding of triangles' edges around each line along the last axis to `winding` (X, Y, Z) int32.

    The lines go through the cells' centres. Each value is added at the first cell of the line whose centre is behind the
    crossing of a triangle of these rows.
    """
    for t in rows:
        x0, x1 = _span(points, triangles, t, 0, winding.shape[0])
        y0, y1 = _span(points, triangles, t, 1, winding.shape[1])
        for i in range(x0, x1):
            for j in range(y0, y1):
                n = _around(points, triangles, t, 0, 1, i + 0.5, j + 0.5)
                if n != 0:
                    at = math.floor(_crossing(points, triangles, t, 0, 1, 2, i + 0.5, j + 0.5) + 0.5)
                    if at < winding.shape[2]:
                        winding[i, j, int(max(at, 0.0))] += n


@njit
def fill(winding, first, triangle, owner, filled, value):
    """Assign to a triangle the unowned cells whose centres a closed surface encloses, and write the value to `filled`.

    `winding` is the result of `wind` for a part of the grid, which begins at the cell `first`.
    """
    for i in range(winding.shape[0]):
        for j in range(winding.shape[1]):
            total = 0
            for k in range(winding.shape[2]):
                total += winding[i, j, k]
                x, y, z = first[0] + i, first[1] + j, first[2] + k
                if total != 0 and owner[x, y, z] < 0:
                    owner[x, y, z] = triangle
                    filled[x, y, z] = value


@njit
def heights(points, triangles, rows, lowest, highest):
    """Write the first and the last place where lines along the middle axis cross triangles of these rows: (X, Z), in cells. The
    lines go through the cells' centres.
    """
    for t in rows:
        x0, x1 = _span(points, triangles, t, 0, lowest.shape[0])
        z0, z1 = _span(points, triangles, t, 2, lowest.shape[1])
        for i in range(x0, x1):
            for k in range(z0, z1):
                if _around(points, triangles, t, 0, 2, i + 0.5, k + 0.5) != 0:
                    at = _crossing(points, triangles, t, 0, 2, 1, i + 0.5, k + 0.5)
                    lowest[i, k], highest[i, k] = min(lowest[i, k], at), max(highest[i, k], at)


@njit
def seen(pixels, depth, inverse_depth, codes, out):
    """Write the visibility of points (N,) at these pixels (N, 2), NaN for none.

    codes (3,) are the codes of points outside the picture (H, W), of points nearer than the surface in their pixel, and of all
    others.
    """
    height, width = inverse_depth.shape
    for n in range(out.shape[0]):
        x, y = pixels[n, 0], pixels[n, 1]
        if not (x >= 0.0 and y >= 0.0 and x < width and y < height):
            out[n] = codes[0]
        else:
            out[n] = codes[1] if depth[n] * inverse_depth[int(y), int(x)] < 1.0 else codes[2]


@njit
def starts(owner, table, filled, state, indoors, out):
    """Write to `out` (N,) the first cell of each run of cells that are equal in all of these flat arrays, and return the number
    of runs, which may exceed N.

    The entries of `owner` are rows of `table` (T, 2), -1 for none.
    """
    count = 0
    for n in range(owner.shape[0]):
        same = n > 0 and filled[n] == filled[n - 1] and state[n] == state[n - 1] and indoors[n] == indoors[n - 1]
        if same and owner[n] != owner[n - 1]:
            a, b = owner[n], owner[n - 1]
            same = a >= 0 and b >= 0 and table[a, 0] == table[b, 0] and table[a, 1] == table[b, 1]
        if not same:
            if count < out.shape[0]:
                out[count] = n
            count += 1
    return count


@njit
def join(parent, triangles):
    """Join the corners of each triangle: `parent` (V,) leads from each vertex to the first vertex of its piece."""
    for t in range(triangles.shape[0]):
        root = triangles[t, 0]
        while parent[root] != root:
            root = parent[root]
        for i in range(1, 3):
            other = triangles[t, i]
            while parent[other] != other:
                other = parent[other]
            if other < root:
                parent[root] = other
                root = other
            else:
                parent[other] = root
        for i in range(3):
            parent[triangles[t, i]] = root
    for v in range(parent.shape[0]):
        root = v
        while parent[root] != root:
            root = parent[root]
        parent[v] = root
