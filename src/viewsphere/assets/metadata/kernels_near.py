"""Distances of points from triangles, which a grid of cells indexes.

A grid is a tuple: corners of the triangles (T, 3, 3), starts of the cells (X * Y * Z + 1,) in the members, triangles by cells;
the grid's lowest corner (3,), the side of a cell, and the numbers of cells (X, Y, Z). It covers all triangles.
"""

import math

from viewsphere.kernels.jit import inner, njit


@njit
def into_cells(corners, low, cell, counts, members, fills):
    """Count in (X, Y, Z) int64 the triangles (T, 3, 3) that may intersect each cell. With `fills`, write their numbers before
    the positions in `counts` instead, which then move to the first of them.
    """
    for t in range(len(corners)):
        _visit(corners, t, low, cell, counts, members, fills)


@inner
def _visit(corners, t, low, cell, counts, members, fills):
    """Count or write a triangle in each cell of its bounding box that its plane intersects."""
    ax, ay, az = corners[t, 0, 0], corners[t, 0, 1], corners[t, 0, 2]
    bx, by, bz = corners[t, 1, 0], corners[t, 1, 1], corners[t, 1, 2]
    cx, cy, cz = corners[t, 2, 0], corners[t, 2, 1], corners[t, 2, 2]
    ux, uy, uz, vx, vy, vz = bx - ax, by - ay, bz - az, cx - ax, cy - ay, cz - az
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    reach = 0.5 * cell * (abs(nx) + abs(ny) + abs(nz)) * (1 + 1e-9)
    i0, i1 = _between(min(ax, bx, cx), max(ax, bx, cx), low[0], cell, counts.shape[0])
    j0, j1 = _between(min(ay, by, cy), max(ay, by, cy), low[1], cell, counts.shape[1])
    k0, k1 = _between(min(az, bz, cz), max(az, bz, cz), low[2], cell, counts.shape[2])
    for i in range(i0, i1):
        dx = (low[0] + (i + 0.5) * cell - ax) * nx
        for j in range(j0, j1):
            dy = dx + (low[1] + (j + 0.5) * cell - ay) * ny
            for k in range(k0, k1):
                if abs(dy + (low[2] + (k + 0.5) * cell - az) * nz) <= reach:
                    if fills:
                        counts[i, j, k] -= 1
                        members[counts[i, j, k]] = t
                    else:
                        counts[i, j, k] += 1


@inner
def _between(low, high, start, cell, count):
    """The first cell of a row that a range overlaps, and the cell after the last."""
    first = max(math.floor((low - start) / cell), 0)
    end = min(math.floor((high - start) / cell) + 1, count)
    return first, end


@njit
def all_near(points, motions, grid, limit, near):
    """Fill `near` with whether each motion (M, 3, 4) moves all points (N, 3) to within `limit` of a triangle."""
    for m in range(len(motions)):
        near[m] = True
        for p in range(len(points)):
            x, y, z = _moved(motions[m], points[p])
            if _nearest(x, y, z, grid, limit, limit)[0] > limit * limit:
                near[m] = False
                break


@njit
def closest(points, motion, grid, limit, found):
    """Fill found (N, 7) for each moved point: the squared distance to the nearest triangle within `limit`, else infinity; the
    nearest point on it; and the triangle's unit normal.
    """
    for p in range(len(points)):
        x, y, z = _moved(motion, points[p])
        found[p, 0], t, found[p, 1], found[p, 2], found[p, 3] = _nearest(x, y, z, grid, limit, 0.0)
        a, b, c = grid[0][t]
        ux, uy, uz, vx, vy, vz = b[0] - a[0], b[1] - a[1], b[2] - a[2], c[0] - a[0], c[1] - a[1], c[2] - a[2]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        length = math.sqrt(nx * nx + ny * ny + nz * nz)
        found[p, 4], found[p, 5], found[p, 6] = nx / length, ny / length, nz / length


@inner
def _moved(m, p):
    x = m[0, 0] * p[0] + m[0, 1] * p[1] + m[0, 2] * p[2] + m[0, 3]
    y = m[1, 0] * p[0] + m[1, 1] * p[1] + m[1, 2] * p[2] + m[1, 3]
    z = m[2, 0] * p[0] + m[2, 1] * p[1] + m[2, 2] * p[2] + m[2, 3]
    return x, y, z


@inner
def _nearest(x, y, z, grid, limit, enough):
    """The squared distance to the nearest triangle within `limit` (infinity without one), its number, and its nearest point.
    The search stops at the first triangle within `enough`.

    The point's own cell comes first, since its nearest triangle bounds the search of the other cells.
    """
    low, cell, (width, depth, height) = grid[3], grid[4], grid[5]
    i, j, k = _place(x, low[0], cell, width), _place(y, low[1], cell, depth), _place(z, low[2], cell, height)
    own = (i * depth + j) * height + k
    best = _in_cell(x, y, z, grid, own, enough, (limit * limit, -1, x, y, z))
    reach = math.sqrt(best[0])
    if best[1] < 0 or reach > enough:
        best = _in_cells(x, y, z, grid, own, reach, enough, best)
    return (math.inf, 0, x, y, z) if best[1] < 0 else best


@inner
def _place(x, start, cell, count):
    """The cell of a row that contains a coordinate, or the nearest cell."""
    return min(max(math.floor((x - start) / cell), 0), count - 1)


@inner
def _in_cells(x, y, z, grid, own, reach, enough, best):
    """The better of `best` and the nearest triangle in the cells within `reach`, except the cell `own`."""
    low, cell, (width, depth, height) = grid[3], grid[4], grid[5]
    i0, i1 = _between(x - reach, x + reach, low[0], cell, width)
    j0, j1 = _between(y - reach, y + reach, low[1], cell, depth)
    k0, k1 = _between(z - reach, z + reach, low[2], cell, height)
    for i in range(i0, i1):
        dx = _gap(x, low[0] + i * cell, cell)
        for j in range(j0, j1):
            dy = dx + _gap(y, low[1] + j * cell, cell)
            if dy > best[0]:
                continue
            for k in range(k0, k1):
                number = (i * depth + j) * height + k
                if number != own and dy + _gap(z, low[2] + k * cell, cell) <= best[0]:
                    best = _in_cell(x, y, z, grid, number, enough, best)
                    if best[1] >= 0 and best[0] <= enough * enough:
                        return best
    return best


@inner
def _gap(x, start, cell):
    """The squared distance of a coordinate from a cell's range."""
    gap = max(start - x, x - start - cell, 0.0)
    return gap * gap


@inner
def _in_cell(x, y, z, grid, number, enough, best):
    """The better of `best` and the nearest triangle of a cell: the squared distance, the triangle, and its nearest point."""
    corners, starts, members = grid[0], grid[1], grid[2]
    for place in range(starts[number], starts[number + 1]):
        t = members[place]
        qx, qy, qz = _on_triangle(corners[t], x, y, z)
        square = (x - qx) * (x - qx) + (y - qy) * (y - qy) + (z - qz) * (z - qz)
        if square < best[0] or (square == best[0] and best[1] < 0):
            best = square, t, qx, qy, qz
            if square <= enough * enough:
                return best
    return best


@njit
def into_field(grid, low, step, limit, field):
    """Write the distances of grid points (X, Y, Z), `step` apart from `low` on, from the nearest triangle; larger ones become
    `limit`.
    """
    for i in range(field.shape[0]):
        for j in range(field.shape[1]):
            for k in range(field.shape[2]):
                square = _nearest(low[0] + i * step, low[1] + j * step, low[2] + k * step, grid, limit, 0.0)[0]
                field[i, j, k] = min(math.sqrt(square), limit)


@njit
def field_misfits(points, motions, field, low, step, most, found):
    """Fill `found` with the sum of squared field distances of the moved points for each motion (M, 3, 4), or infinity if one
    distance exceeds `most`.
    """
    width, depth, height = field.shape
    for m in range(len(motions)):
        total = 0.0
        for p in range(len(points)):
            x, y, z = _moved(motions[m], points[p])
            u, v, w = (x - low[0]) / step, (y - low[1]) / step, (z - low[2]) / step
            i, j, k = math.floor(u), math.floor(v), math.floor(w)
            if min(i, j, k) < 0 or i > width - 2 or j > depth - 2 or k > height - 2:
                total = math.inf
                break
            distance = _between_nodes(field, i, j, k, u - i, v - j, w - k)
            if distance > most:
                total = math.inf
                break
            total += distance * distance
        found[m] = total


@inner
def _between_nodes(field, i, j, k, u, v, w):
    """The trilinear value of a field at (i + u, j + v, k + w)."""
    a = (field[i, j, k] * (1 - w) + field[i, j, k + 1] * w) * (1 - v)
    a += (field[i, j + 1, k] * (1 - w) + field[i, j + 1, k + 1] * w) * v
    b = (field[i + 1, j, k] * (1 - w) + field[i + 1, j, k + 1] * w) * (1 - v)
    b += (field[i + 1, j + 1, k] * (1 - w) + field[i + 1, j + 1, k + 1] * w) * v
    return a * (1 - u) + b * u


@inner
def _on_triangle(corners, x, y, z):
    """The nearest point of a triangle to a point: Ericson, Real-Time Collision Detection, 5.1.5."""
    ax, ay, az = corners[0, 0], corners[0, 1], corners[0, 2]
    ux, uy, uz = corners[1, 0] - ax, corners[1, 1] - ay, corners[1, 2] - az
    vx, vy, vz = corners[2, 0] - ax, corners[2, 1] - ay, corners[2, 2] - az
    px, py, pz = x - ax, y - ay, z - az
    d1, d2 = ux * px + uy * py + uz * pz, vx * px + vy * py + vz * pz
    if d1 <= 0 and d2 <= 0:
        return ax, ay, az
    uu, uv, vv = ux * ux + uy * uy + uz * uz, ux * vx + uy * vy + uz * vz, vx * vx + vy * vy + vz * vz
    d3, d4 = d1 - uu, d2 - uv
    if d3 >= 0 and d4 <= d3:
        return ax + ux, ay + uy, az + uz
    vc = d1 * d4 - d3 * d2
    if vc <= 0 and d1 >= 0 and d3 <= 0:
        s = d1 / (d1 - d3)
        return ax + s * ux, ay + s * uy, az + s * uz
    d5, d6 = d1 - uv, d2 - vv
    if d6 >= 0 and d5 <= d6:
        return ax + vx, ay + vy, az + vz
    vb = d5 * d2 - d1 * d6
    if vb <= 0 and d2 >= 0 and d6 <= 0:
        s = d2 / (d2 - d6)
        return ax + s * vx, ay + s * vy, az + s * vz
    va = d3 * d6 - d5 * d4
    if va <= 0 and d4 - d3 >= 0 and d5 - d6 >= 0:
        s = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return ax + ux + s * (vx - ux), ay + uy + s * (vy - uy), az + uz + s * (vz - uz)
    total = va + vb + vc
    s, r = vb / total, vc / total
    return ax + s * ux + r * vx, ay + s * uy + r * vy, az + s * uz + r * vz
