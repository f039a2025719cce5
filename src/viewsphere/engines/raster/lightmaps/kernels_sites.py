"""Light sites on surfaces that are not flat, and the light that they give points of these surfaces: see `vertex_light`."""

from __future__ import annotations

import numba as nb
import numpy as np

from viewsphere.engines.raster.lightmaps.kernels_lightmap import COLUMNS
from viewsphere.engines.raster.lightmaps.kernels_table import found
from viewsphere.kernels.jit import inner, njit
from viewsphere.kernels.lanes import FAST

f4 = nb.float32
U = nb.uintp
LIKE = 0.3  # cosine between the normals of a point and of a site above which the site counts
ASIDE = 0.15  # part of a normal along an axis above which sites that face along this axis are read
THICK = 0.5  # cells between the planes of a point and a site above which the site hardly counts
HARDLY = 1e-3  # minimum weight: above 0, so that weights can be divided by their sum
SHUT = 0.5  # squared distance in cells that a fully open part may be farther away than a fully enclosed one
STRAIGHT = 0.5  # cosine between a vertex' normal and its triangle's above which the triangle is round there


@inner
def _middle(corners, parts, row, k):
    """The middle of part k of a row of a triangle (3, 3) that is cut into `parts` squared parts."""
    per, third = 1.0 / parts, (1 + k % 2) / 3.0
    g, h = (k // 2 + third) * per, (row + third) * per
    x = corners[0, 0] + g * (corners[1, 0] - corners[0, 0]) + h * (corners[2, 0] - corners[0, 0])
    y = corners[0, 1] + g * (corners[1, 1] - corners[0, 1]) + h * (corners[2, 1] - corners[0, 1])
    z = corners[0, 2] + g * (corners[1, 2] - corners[0, 2]) + h * (corners[2, 2] - corners[0, 2])
    return x, y, z


@inner
def _key(x, y, z, side):
    """One number for a cell, whose index may be one below the first, and one of six sides."""
    key = np.uint64(side)
    for at in (x, y, z):
        key = key * np.uint64(1 << 20) + np.uint64(at + 1)
    return key


@inner
def _side(normal):
    axis = 0
    for k in range(3):
        if abs(normal[k]) > abs(normal[axis]):
            axis = k
    return 2 * axis + (1 if normal[axis] > f4(0) else 0)


@inner
def _cell_key(x, y, z, normal, low, cells):
    return _key(int((x - low[0]) * cells), int((y - low[1]) * cells), int((z - low[2]) * cells), _side(normal))


@njit
def group(corners, normals, parts, shares, low, cells, keys, sites, sums):
    """Group parts of triangles into sites: parts in one cell that face along one axis. Return the number of sites, -1 if `sums`
    is too small.

    corners (T, 3, 3), normals (T, 3); parts (T,): each triangle is cut into the square of this number; shares (T,): how open
    each is, 0 to leave it out; low (3,): the corner of the first cell, with `cells` in a length; keys (S,), sites (S,): an
    empty open-addressing table; sums (N, 7), zeros: the total openness of the parts, and, multiplied by it, their mean place
    and mean normal.
    """
    count = 0
    for t in range(parts.shape[0]):
        n = normals[t]
        for row in range(parts[t] if shares[t] > 0.0 else 0):
            for k in range(2 * (parts[t] - row) - 1):
                x, y, z = _middle(corners[t], parts[t], row, k)
                key = _cell_key(x, y, z, n, low, cells)
                at = found(key, keys, sites)
                if sites[at] < 0:
                    if count == sums.shape[0]:
                        return -1
                    keys[at], sites[at] = key, count
                    count += 1
                total = sums[sites[at]]
                total[0] += shares[t]
                total[1] += shares[t] * x
                total[2] += shares[t] * y
                total[3] += shares[t] * z
                for c in range(3):
                    total[4 + c] += shares[t] * n[c]
    return count


@njit
def settle(corners, normals, parts, shares, low, cells, keys, sites, sums, best, places, facing):
    """Write the place and the normal of each site into places, facing (N, 3).

    They are those of the triangle part that is most similar to all parts of the site. best (N,): infinite; the other arrays as
    `group` left them.
    """
    for t in range(parts.shape[0]):
        n = normals[t]
        for row in range(parts[t] if shares[t] > 0.0 else 0):
            for k in range(2 * (parts[t] - row) - 1):
                x, y, z = _middle(corners[t], parts[t], row, k)
                own = sites[found(_cell_key(x, y, z, n, low, cells), keys, sites)]
                total = sums[own]
                per = 1.0 / total[0]
                dx, dy, dz = x - total[1] * per, y - total[2] * per, z - total[3] * per
                turn = 1.0 - (n[0] * total[4] + n[1] * total[5] + n[2] * total[6]) * per
                apart = (dx * dx + dy * dy + dz * dz) * cells * cells + turn + SHUT * (1.0 - shares[t])
                if apart < best[own]:
                    best[own] = apart
                    places[own, 0], places[own, 1], places[own, 2] = x, y, z
                    for c in range(3):
                        facing[own, c] = n[c]


@inner
def _is_round(vertex, normal):
    """Return whether the vertex' normal is used to shade a triangle with this normal."""
    along = vertex[0] * normal[0] + vertex[1] * normal[1] + vertex[2] * normal[2]
    size = vertex[0] * vertex[0] + vertex[1] * vertex[1] + vertex[2] * vertex[2]
    return size > f4(0.5) and size < f4(2) and along > f4(STRAIGHT)


@inner
def _lay_point(at, corners, smooth, normal, g, h, places, facing):
    """Write a point of a triangle into row `at` of places and facing."""
    for c in range(3):
        places[at, c] = corners[0, c] + g * (corners[1, c] - corners[0, c]) + h * (corners[2, c] - corners[0, c])
        facing[at, c] = smooth[0, c] + g * (smooth[1, c] - smooth[0, c]) + h * (smooth[2, c] - smooth[0, c])
    size = facing[at, 0] ** 2 + facing[at, 1] ** 2 + facing[at, 2] ** 2
    for c in range(3):
        facing[at, c] = facing[at, c] / np.sqrt(size) if size > f4(1e-6) else normal[c]


@njit(_nrt=True)
def lay(triangles, corners, smooth, normals, parts, numbers, index, places, facing):
    """Write the points at which triangles store light into places and facing (P, 3); return the number of points.

    A cut triangle has its own points, at all corners of its parts; the others share vertices if they are round there. triangles
    (T, 3): vertices; smooth (T, 3, 3): their normals; numbers (V,): -1; index (I,): the points of each triangle, row by row;
    the others as in `group`.
    """
    count, done, own = 0, 0, np.empty((3, 3), np.float32)
    for t in range(parts.shape[0]):
        for k in range(3):
            own[k] = smooth[t, k] if _is_round(smooth[t, k], normals[t]) else normals[t]
        r = parts[t]
        for row in range(r + 1 if r > 0 else 0):
            for column in range(r + 1 - row):
                vertex, is_shared = triangles[t, 1 if column else 2 if row else 0], False
                if r == 1:
                    k = 1 if column else 2 if row else 0
                    is_shared = _is_round(smooth[t, k], normals[t])
                if is_shared and numbers[vertex] >= 0:
                    index[done] = numbers[vertex]
                else:
                    _lay_point(count, corners[t], own, normals[t], column / r, row / r, places, facing)
                    index[done] = count
                    if is_shared:
                        numbers[vertex] = count
                    count += 1
                done += 1
    return count


@inner(fastmath=FAST)
def _share(dx, dy, dz, n, m, cells):
    """Return the weight of a site with normal m for a point with normal n. Distance along their planes does not count.

    dx, dy, dz: from the point to the site.
    """
    like = n[0] * m[0] + n[1] * m[1] + n[2] * m[2] - f4(LIKE)
    if like <= f4(0):
        return f4(0)
    # Across the planes of both: places on one ball, or another round thing, count as one plane.
    off = (dx * (n[0] + m[0]) + dy * (n[1] + m[1]) + dz * (n[2] + m[2])) * f4(0.5 / THICK) * cells
    return like * like * (max(f4(1) - off * off, f4(0)) + f4(HARDLY))


@inner(fastmath=FAST)
def _add(node, share, own):
    for c in range(U(COLUMNS)):
        own[c] += share * node[c]


@njit(fastmath=FAST)
def spread(places, normals, low, cells, keys, sites, site_places, site_normals, nodes, out):
    """Write the light of points (P, 3) with these normals into out (P, COLUMNS): the mean light of the sites around, from nodes
    (N, COLUMNS), zeros if there are none. low (3,), cells: float32; the others as `settle` left them.
    """
    for i in range(U(places.shape[0])):
        p, n, own, total = places[i], normals[i], out[i], f4(0)
        own[:] = f4(0)
        x, y, z = (p[0] - low[0]) * cells + f4(0.5), (p[1] - low[1]) * cells + f4(0.5), (p[2] - low[2]) * cells + f4(0.5)
        left, front, bottom = int(x), int(y), int(z)  # 1 more than the cell whose middle is before the point
        x, y, z = x - f4(left), y - f4(front), z - f4(bottom)
        for axis in range(3):
            if abs(n[axis]) < f4(ASIDE):
                continue
            side = 2 * axis + (1 if n[axis] > f4(0) else 0)
            for k in range(8):
                right, back, top = k & 1, k >> 1 & 1, k >> 2
                at = sites[found(_key(left - 1 + right, front - 1 + back, bottom - 1 + top, side), keys, sites)]
                if at < 0:
                    continue
                near = (x if right else f4(1) - x) * (y if back else f4(1) - y) * (z if top else f4(1) - z) + f4(HARDLY)
                q = site_places[at]
                share = near * _share(q[0] - p[0], q[1] - p[1], q[2] - p[2], n, site_normals[at], cells)
                total += share
                _add(nodes[at], share, own)
        if total > f4(0):
            for c in range(U(COLUMNS)):
                own[c] /= total
