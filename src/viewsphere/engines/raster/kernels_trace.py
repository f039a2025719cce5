"""What rays meet first: a tree of boxes around triangles (a bounding volume hierarchy, the surface area heuristic in bins; Wald
2007), for light that is baked once and needs no other package.

Both sides of a triangle are met. All is computed in one order: the same triangles and rays give the same bits.
"""

from __future__ import annotations

import numba as nb
import numpy as np

from viewsphere.kernels.jit import inner, njit

f4 = nb.float32
U = nb.uintp
BINS = 16
LEAF = 4  # triangles in a leaf, at most, unless all have one middle
DEEP = 96
NOTHING = -1


@inner
def _area(box):
    """Half the surface of a box of six numbers, lowest and highest x, y, z."""
    x, y, z = box[3] - box[0], box[4] - box[1], box[5] - box[2]
    return x * y + y * z + z * x if x >= f4(0) else f4(0)


@inner
def _clear(box):
    for k in range(3):
        box[k], box[k + 3] = f4(np.inf), f4(-np.inf)


@inner
def _widen(box, other):
    for k in range(3):
        box[k], box[k + 3] = min(box[k], other[k]), max(box[k + 3], other[k + 3])


@inner
def _bound(boxes, order, first, stop, box, middles):
    """The box of some triangles, and that of twice their boxes' middles."""
    _clear(box)
    _clear(middles)
    for i in range(first, stop):
        own = boxes[order[i]]
        _widen(box, own)
        for k in range(3):
            middle = own[k] + own[k + 3]
            middles[k], middles[k + 3] = min(middles[k], middle), max(middles[k + 3], middle)


@inner
def _bin(own, axis, low, scale):
    return min(int((own[axis] + own[axis + 3] - low) * scale), BINS - 1)


@inner
def _best_cut(boxes, order, first, stop, middles, counts, bins, right):
    """The axis along which the middles lie farthest apart, and the bin before which a cut costs least; -1 for none."""
    axis = 0
    for k in range(1, 3):
        if middles[k + 3] - middles[k] > middles[axis + 3] - middles[axis]:
            axis = k
    low, span = middles[axis], middles[axis + 3] - middles[axis]
    if not span > f4(0):
        return axis, -1, f4(0)
    scale = f4(BINS) / span
    for k in range(BINS):
        counts[k] = 0
        _clear(bins[k])
    for i in range(first, stop):
        own = boxes[order[i]]
        k = _bin(own, axis, low, scale)
        counts[k] += 1
        _widen(bins[k], own)
    after, grown = 0, bins[BINS]
    _clear(grown)
    for k in range(BINS - 1, 0, -1):
        after += counts[k]
        _widen(grown, bins[k])
        right[k] = f4(after) * _area(grown)
    before, best, least = 0, -1, f4(np.inf)
    _clear(grown)
    for k in range(1, BINS):
        before += counts[k - 1]
        _widen(grown, bins[k - 1])
        cost = f4(before) * _area(grown) + right[k]
        if before > 0 and before < stop - first and cost < least:
            best, least = k, cost
    return axis, best, scale


@njit(_nrt=True)
def build(boxes, order, bounds, links):
    """Fill bounds (2 T, 6) float32 and links (2 T, 2) int32 for T boxes (T, 6) of triangles; returns how many nodes there are.

    order (T,) int32, first 0 to T - 1, is sorted by leaves. Of a leaf, links hold its first place in `order` and its count; of
    another node, that of the first of its two children, which lie side by side, and 0.
    """
    waiting, depth, nodes = np.empty((DEEP, 3), np.int64), 1, 1
    counts, bins, right = np.empty(BINS, np.int32), np.empty((BINS + 1, 6), np.float32), np.empty(BINS, np.float32)
    middles = np.empty(6, np.float32)
    waiting[0, 0], waiting[0, 1], waiting[0, 2] = 0, 0, len(order)
    while depth > 0:
        depth -= 1
        node, first, stop = waiting[depth, 0], waiting[depth, 1], waiting[depth, 2]
        _bound(boxes, order, first, stop, bounds[node], middles)
        axis, cut, scale = 0, -1, f4(0)
        if stop - first > LEAF and depth + 2 < DEEP:
            axis, cut, scale = _best_cut(boxes, order, first, stop, middles, counts, bins, right)
        if cut < 0:
            links[node, 0], links[node, 1] = first, stop - first
            continue
        i, j = first, stop - 1
        while i <= j:
            if _bin(boxes[order[i]], axis, middles[axis], scale) < cut:
                i += 1
            else:
                order[i], order[j] = order[j], order[i]
                j -= 1
        links[node, 0], links[node, 1] = nodes, 0
        waiting[depth, 0], waiting[depth, 1], waiting[depth, 2] = nodes + 1, i, stop
        waiting[depth + 1, 0], waiting[depth + 1, 1], waiting[depth + 1, 2] = nodes, first, i
        depth += 2
        nodes += 2
    return nodes


@inner
def _enters(box, o, inverse, limit):
    """How far along a ray the box begins, infinity where it is missed."""
    near, far = f4(0), limit
    for k in range(3):
        a, b = (box[U(k)] - o[k]) * inverse[k], (box[U(k + 3)] - o[k]) * inverse[k]
        near, far = max(near, min(a, b)), min(far, max(a, b))
    return near if near <= far else f4(np.inf)


@inner
def _meets(corner, o, d, limit):
    """How far along a ray it meets a triangle (first corner, two edges); `limit` where it does not (Moeller and Trumbore)."""
    ax, ay, az, bx, by, bz = corner[U(3)], corner[U(4)], corner[U(5)], corner[U(6)], corner[U(7)], corner[U(8)]
    px, py, pz = d[1] * bz - d[2] * by, d[2] * bx - d[0] * bz, d[0] * by - d[1] * bx
    det = ax * px + ay * py + az * pz
    if det == f4(0):
        return limit
    scale = f4(1) / det
    x, y, z = o[0] - corner[U(0)], o[1] - corner[U(1)], o[2] - corner[U(2)]
    u = (x * px + y * py + z * pz) * scale
    if u < f4(0) or u > f4(1):
        return limit
    qx, qy, qz = y * az - z * ay, z * ax - x * az, x * ay - y * ax
    v = (d[0] * qx + d[1] * qy + d[2] * qz) * scale
    t = (bx * qx + by * qy + bz * qz) * scale
    return t if v >= f4(0) and u + v <= f4(1) and t > f4(0) and t < limit else limit


@inner
def nearest(tree, o, d, limit, is_any, stack):
    """The place in the tree of the first triangle that a ray meets before `limit`, -1 for none, and how far along it.

    o, d: tuples; stack (DEEP, 2) float32: scratch; is_any: any triangle will do.
    """
    least, found = limit, NOTHING
    inverse = (f4(1) / d[0], f4(1) / d[1], f4(1) / d[2])
    depth = U(0)
    begin = _enters(tree.bounds[U(0)], o, inverse, least)
    if begin < f4(np.inf):
        stack[0, 0], stack[0, 1], depth = f4(0), begin, U(1)
    while depth > U(0):
        depth -= U(1)
        if stack[depth, U(1)] > least:
            continue
        node = U(nb.int32(stack[depth, U(0)]))
        first, count = tree.links[node, U(0)], tree.links[node, U(1)]
        if count > 0:
            for i in range(U(first), U(first + count)):
                t = _meets(tree.corners[i], o, d, least)
                if t < least:
                    least, found = t, nb.int64(i)
            if is_any and found >= 0:
                return found, least
            continue
        a, b = U(first), U(first + 1)
        near, far = _enters(tree.bounds[a], o, inverse, least), _enters(tree.bounds[b], o, inverse, least)
        if far < near:
            a, b, near, far = b, a, far, near
        if far < f4(np.inf):
            stack[depth, U(0)], stack[depth, U(1)] = f4(b), far
            depth += U(1)
        if near < f4(np.inf):
            stack[depth, U(0)], stack[depth, U(1)] = f4(a), near
            depth += U(1)
    return found, least


@njit(_nrt=True)
def cast(tree, origins, directions, turn, limit, met, far):
    """For each k of K and each origin (N, 3): what is met first in direction `directions[turn, k]` (W, K, 3), as a place in the
    tree, into met (K, N) int32, -1 for nothing before `limit`; and how far away, in lengths of the direction, into far (K, N)
    float32. turn (N,): each origin's own.

    Parallel rays one after another find the same boxes in the cache: origins of one turn are best next to one another.
    """
    stack = np.empty((DEEP, 2), np.float32)
    for k in range(U(directions.shape[1])):
        for i in range(U(origins.shape[0])):
            w = U(turn[i])
            d = directions[w, k, U(0)], directions[w, k, U(1)], directions[w, k, U(2)]
            o = origins[i, U(0)], origins[i, U(1)], origins[i, U(2)]
            found, t = nearest(tree, o, d, limit, False, stack)
            met[k, i], far[k, i] = found, t


@njit(_nrt=True)
def unblocked(tree, origins, ways, clear):
    """Whether nothing lies between each origin (N, 3) and origin + way (N, 3): 1 or 0, into clear (N,) float32."""
    stack = np.empty((DEEP, 2), np.float32)
    for i in range(U(origins.shape[0])):
        o = origins[i, U(0)], origins[i, U(1)], origins[i, U(2)]
        d = ways[i, U(0)], ways[i, U(1)], ways[i, U(2)]
        found, _ = nearest(tree, o, d, f4(0.999), True, stack)
        clear[i] = f4(1) if found < 0 else f4(0)
