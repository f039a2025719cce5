"""Light that arrives at flat, still surfaces, at the nodes of a grid on each: see `lightmaps`."""

from __future__ import annotations

import numba as nb
import numpy as np

from viewsphere.engines.raster.indirect.kernels_emissive import POWER_R, shine_from
from viewsphere.engines.raster.reflections.kernels_trace import DEEP
from viewsphere.engines.raster.shading.kernels_blend import blend
from viewsphere.engines.raster.shading.kernels_block import BLOCK as ROW
from viewsphere.engines.raster.shading.kernels_block import GLOW_R, GX, GY, GZ, MAPPED, NX, NY, NZ, PROBES, PX, PY, PZ
from viewsphere.kernels.jit import inner, njit
from viewsphere.kernels.lanes import FAST, lanewise

f4 = nb.float32
U = nb.uintp
SKY = -1
# Columns of a node: its weight; then, multiplied by it, light along the normal and along both axes, see `see`.
WEIGHT, ALONG, COLUMNS = 0, 1, 12
# Columns of a chart: where a place is along both axes in cells, as factors of x, y, z and 1; the normal; its first node, and
# how many nodes it has along both axes.
ACROSS, UPWARD, NORMAL, FIRST, WIDE, HIGH, CHART = 0, 4, 8, 11, 12, 13, 16
FACING = 0.5  # cosine between the normal of a chart and that of the side seen
LEAST = 0.02  # total weight of four nodes above which they are read: probes are better in enclosed places
STEEP = 0.2  # cosine above which light along the axes is stored
NEAR = 0.5  # cells
INSIDE, SHUT = 0.5, 0.97  # shares of rays that hit an inner side, or anything near, above which a node hardly counts
HARDLY = 1e-3  # weight of nodes without light of their own: above 0, so that weights can be divided by their sum
_blend = blend(COLUMNS)


@njit(_nrt=True)
def pieces(corners, count):
    """Return the piece of each triangle, (T,): the lowest number among the triangles connected to it by common corners (T, 3).

    The corners' numbers are below `count`.
    """
    first, piece = np.full(count, -1), np.arange(corners.shape[0])
    for i in range(corners.shape[0]):
        for k in range(3):
            if first[corners[i, k]] < 0:
                first[corners[i, k]] = i
            a, b = i, first[corners[i, k]]
            while piece[a] != a:
                a = piece[a]
            while piece[b] != b:
                b = piece[b]
            piece[max(a, b)] = min(a, b)
    for i in range(corners.shape[0]):
        piece[i] = piece[piece[i]]
    return piece


@inner
def _on_edge(px, py, ax, ay, bx, by):
    """The point on an edge that is nearest to p."""
    dx, dy = bx - ax, by - ay
    size = dx * dx + dy * dy
    t = min(max(((px - ax) * dx + (py - ay) * dy) / size, 0.0), 1.0) if size > 0 else 0.0
    return ax + t * dx, ay + t * dy


@inner
def _nearest(px, py, t):
    """The point in a triangle (3, 2) that is nearest to p."""
    signs = 0
    for k in range(3):
        a, b = t[k], t[(k + 1) % 3]
        turn = (b[0] - a[0]) * (py - a[1]) - (b[1] - a[1]) * (px - a[0])
        signs += 1 if turn >= 0 else -1
    if abs(signs) == 3:
        return px, py
    best, x, y = np.inf, px, py
    for k in range(3):
        a, b = t[k], t[(k + 1) % 3]
        u, v = _on_edge(px, py, a[0], a[1], b[0], b[1])
        far = (u - px) ** 2 + (v - py) ** 2
        if far < best:
            best, x, y = far, u, v
    return x, y


@inner
def _shrink(t, inset):
    """Move the corners of a triangle (3, 2) towards the centre of its incircle, so that its edges move by `inset`."""
    around = area = x = y = 0.0
    for k in range(3):
        a, b, c = t[k], t[(k + 1) % 3], t[(k + 2) % 3]
        size = np.sqrt((b[0] - c[0]) ** 2 + (b[1] - c[1]) ** 2)  # length of the edge opposite to the corner
        around, x, y = around + size, x + size * a[0], y + size * a[1]
        area += (a[0] * b[1] - b[0] * a[1]) / 2
    part = min(inset * around / max(2 * abs(area), 1e-300), 1.0)
    x, y = x / max(around, 1e-300), y / max(around, 1e-300)
    for k in range(3):
        t[k, 0], t[k, 1] = t[k, 0] + part * (x - t[k, 0]), t[k, 1] + part * (y - t[k, 1])


@njit
def settle(triangles, chart, charts, inset, places, distances):
    """Write the place from which each node's rays start into places (N, 2), in cells.

    The place is the point of the node's chart that is nearest to the node, `inset` from the chart's border. distances (N,),
    initially infinite: the square of the distance to the place.

    triangles (T, 3, 2): corners in cells, which are moved; chart (T,); charts: see `Lightmap`.
    """
    for i in range(triangles.shape[0]):
        t, own = triangles[i], charts[chart[i]]
        wide, high, first = int(own[WIDE]), int(own[HIGH]), int(own[FIRST])
        left, right = min(t[0, 0], t[1, 0], t[2, 0]), max(t[0, 0], t[1, 0], t[2, 0])
        low, up = min(t[0, 1], t[1, 1], t[2, 1]), max(t[0, 1], t[1, 1], t[2, 1])
        _shrink(t, inset)
        for y in range(max(int(low) - 1, 0), min(int(up) + 3, high)):
            for x in range(max(int(left) - 1, 0), min(int(right) + 3, wide)):
                u, v = _nearest(float(x), float(y), t)
                far, at = (u - x) ** 2 + (v - y) ** 2, first + y * wide + x
                if far < distances[at]:
                    distances[at], places[at, 0], places[at, 1] = far, u, v


@njit
def count_in(met, far, directions, turn, normals, cell, is_inside_out, weights):
    """Write the weight of each node into weights (N,): HARDLY for a node within a thing or in a narrow place, otherwise 1.

    met, far (K, N), directions (W, K, 3), turn (N,): see `kernels_trace.cast`; normals (T, 3); cell: its size.
    """
    for i in range(met.shape[1]):
        behind = near = 0
        for k in range(met.shape[0]):
            if met[k, i] < 0:
                continue
            d, n = directions[turn[i], k], normals[met[k, i]]
            behind += 1 if (n[0] * d[0] + n[1] * d[1] + n[2] * d[2] > f4(0)) != is_inside_out else 0
            near += 1 if far[k, i] < f4(NEAR) * cell else 0
        is_lost = behind > INSIDE * met.shape[0] or near > SHUT * met.shape[0]
        weights[i] = f4(HARDLY) if is_lost else f4(1)


@njit(fastmath=FAST)
def see(ids, turn, local, sky, below, nodes):
    """Add the light of the sky (W, K, 3) and the distant ground (3,) to nodes (N, COLUMNS).

    Light along the normal is the radiance of a white matt surface. For a slightly tilted surface, the light along both axes is
    added, times the parts of its normal along them. ids (K, N): patches that cosine-weighted rays hit. local (R, K, 3):
    directions in the chart's axes, for each rotation (turn modulo R).
    """
    turns = U(local.shape[0])
    per = f4(1) / f4(ids.shape[0])
    for k in range(U(ids.shape[0])):
        for i in range(U(ids.shape[1])):
            if ids[k, i] >= 0:
                continue
            which = U(turn[i])
            way = local[which % turns, k]
            r, g, b = below[0], below[1], below[2]
            if ids[k, i] == SKY:
                r, g, b = sky[which, k, U(0)], sky[which, k, U(1)], sky[which, k, U(2)]
            _add(nodes[i], way[0], way[1], way[2], r * per, g * per, b * per)


@njit(fastmath=FAST)
def receive(ids, turn, local, sent, weights, nodes):
    """Add the light of patches that send `sent` (M, 3) to nodes (N, COLUMNS), and multiply all by weights (N,); the others as
    in `see`.
    """
    turns = U(local.shape[0])
    per = f4(1) / f4(ids.shape[0])
    for k in range(U(ids.shape[0])):
        for i in range(U(ids.shape[1])):
            met = ids[k, i]
            if met >= 0:
                way, own = local[U(turn[i]) % turns, k], sent[U(met)]
                _add(nodes[i], way[0], way[1], way[2], own[0] * per, own[1] * per, own[2] * per)
    for i in range(nodes.shape[0]):
        nodes[i, WEIGHT] = weights[i]
        for c in range(ALONG, COLUMNS):
            nodes[i, c] *= weights[i]


@inner(fastmath=FAST)
def _add(node, x, y, z, r, g, b):
    """Add light from this direction, in the chart's axes, to a node: the radiance along the normal, in red, green and blue."""
    steep = f4(1) / max(z, f4(STEEP))
    x, y = x * steep, y * steep
    node[U(ALONG)] += r
    node[U(ALONG + 1)] += g
    node[U(ALONG + 2)] += b
    node[U(ALONG + 3)] += x * r
    node[U(ALONG + 4)] += x * g
    node[U(ALONG + 5)] += x * b
    node[U(ALONG + 6)] += y * r
    node[U(ALONG + 7)] += y * g
    node[U(ALONG + 8)] += y * b


@njit(_nrt=True)
def shine_on(tree, places, turn, axes, turns, points, ids, far, local, froms, emitted, off, nodes):
    """Add to nodes (N, COLUMNS) the light of emissive triangles (see `kernels_emissive`): from every `turns`-th point, and
    along rays that hit nearby emissive triangles. axes (W, 3, 3): rows are both axes and the normal; the others as in `see`.
    """
    stack = np.empty((DEEP, 2), np.float32)
    per = f4(1) / f4(ids.shape[0])
    for i in range(places.shape[0]):
        p, own, w = (places[i, 0], places[i, 1], places[i, 2]), axes[turn[i]], turn[i] % local.shape[0]
        for j in range(w % turns, points.shape[0], turns):
            d, factor = shine_from(tree, points[j], p, off, stack)
            z = d[0] * own[2, 0] + d[1] * own[2, 1] + d[2] * own[2, 2]
            if z <= f4(0) or factor <= f4(0):
                continue
            x = d[0] * own[0, 0] + d[1] * own[0, 1] + d[2] * own[0, 2]
            y = d[0] * own[1, 0] + d[1] * own[1, 1] + d[2] * own[1, 2]
            q = factor * z * f4(1 / np.pi)
            _add(nodes[i], x, y, z, points[j, POWER_R] * q, points[j, POWER_R + 1] * q, points[j, POWER_R + 2] * q)
        for k in range(ids.shape[0]):
            met = ids[k, i]
            if met >= 0 and far[k, i] * far[k, i] <= froms[met]:
                way = local[w, k]
                _add(nodes[i], way[0], way[1], way[2], emitted[met, 0] * per, emitted[met, 1] * per, emitted[met, 2] * per)


@njit
def smooth(charts, nodes, out):
    """Mix each node with its eight neighbours on its chart, into out (N, COLUMNS)."""
    for c in range(charts.shape[0]):
        wide, high, first = int(charts[c, WIDE]), int(charts[c, HIGH]), int(charts[c, FIRST])
        for y in range(high):
            for x in range(wide):
                own = out[first + y * wide + x]
                own[:] = f4(0)
                for v in range(max(y - 1, 0), min(y + 2, high)):
                    for u in range(max(x - 1, 0), min(x + 2, wide)):
                        share = f4(0.25) * (f4(1) if u == x else f4(0.5)) * (f4(1) if v == y else f4(0.5))
                        other = nodes[first + v * wide + u]
                        for k in range(COLUMNS):
                            own[k] += share * other[k]


@lanewise
def forget_map(b):
    """Set MAPPED to 0."""
    b[MAPPED] = 0


@inner(fastmath=FAST)
def read_map(count, lightmap, own, b):
    """Set GLOW, and MAPPED to 1, if the chart of a sample's triangle (`own`) has its light; otherwise set MAPPED to 0."""
    nodes, charts = lightmap.nodes, lightmap.charts
    for i in range(U(count)):
        b[U(MAPPED) + i] = f4(0)
        at = lightmap.chart[U(own[i])] if own[i] >= 0 else nb.int32(-1)
        if at < 0:
            continue
        c = charts[U(at)]
        x, y, z = b[U(PX) + i], b[U(PY) + i], b[U(PZ) + i]
        nx, ny, nz = c[U(NORMAL)], c[U(NORMAL + 1)], c[U(NORMAL + 2)]
        if b[U(GX) + i] * nx + b[U(GY) + i] * ny + b[U(GZ) + i] * nz < f4(FACING):
            continue
        u = c[U(0)] * x + c[U(1)] * y + c[U(2)] * z + c[U(3)]
        v = c[U(4)] * x + c[U(5)] * y + c[U(6)] * z + c[U(7)]
        wide = c[U(WIDE)]
        u, v = min(max(u, f4(0)), wide - f4(1)), min(max(v, f4(0)), c[U(HIGH)] - f4(1))
        left, low = min(f4(int(u)), wide - f4(2)), min(f4(int(v)), c[U(HIGH)] - f4(2))
        u, v = u - left, v - low
        p = U(c[U(FIRST)] + low * wide + left)
        q, both = p + U(wide), u * v
        _blend(nodes, (p, p + U(1), q, q + U(1)), (f4(1) - u - v + both, u - both, v - both, both), b, U(PROBES) + i)
        weight = b[U(PROBES) + i]
        if weight < f4(LEAST):
            continue
        b[U(MAPPED) + i] = f4(1)
        sx, sy, sz = b[U(NX) + i], b[U(NY) + i], b[U(NZ) + i]
        along = (sx * nx + sy * ny + sz * nz) / weight
        # Both axes are of the length of `1 / cells`.
        cells = f4(1) / (weight * np.sqrt(c[U(0)] * c[U(0)] + c[U(1)] * c[U(1)] + c[U(2)] * c[U(2)]))
        across = (sx * c[U(0)] + sy * c[U(1)] + sz * c[U(2)]) * cells
        up = (sx * c[U(4)] + sy * c[U(5)] + sz * c[U(6)]) * cells
        for k in range(U(3)):
            row = U(PROBES) + (k + U(ALONG)) * U(ROW) + i
            value = along * b[row] + across * b[row + U(3 * ROW)] + up * b[row + U(6 * ROW)]
            b[U(GLOW_R) + k * U(ROW) + i] = max(value, f4(0))
