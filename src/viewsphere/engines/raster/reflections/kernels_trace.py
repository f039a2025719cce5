"""The first hits of rays, found in a tree of boxes around triangles, for light that is baked once. It needs no other package.

The tree is a bounding volume hierarchy by the surface area heuristic in bins (Wald 2007). Eight boxes are tested at once (Wald,
Benthin and Boulos 2008).

Rays hit both sides of a triangle. The order of computation is fixed: the same triangles and rays give the same bits.
"""

from __future__ import annotations

import numba as nb
import numpy as np
from llvmlite import ir
from numba.core import cgutils
from numba.extending import intrinsic

from viewsphere.kernels.jit import inner, njit
from viewsphere.kernels.lanes import Strict, cross, dot, least, load, most, spread, store

f4 = nb.float32
U = nb.uintp
BINS = 16
WIDE = 8  # maximum children of a node and triangles of a leaf: one vector
STEEP = 32  # down to this level, parts are cut at the lowest cost
DEEP = 2 * STEEP * WIDE
ROUNDED = 1.0000005  # farther than the end of a box may be by rounding: a box that is missed so would let rays through a wall
NOTHING = -1


@inner
def _area(box):
    """Half the surface area of a box of six numbers, lowest and highest x, y, z."""
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
    """The box of some triangles, and the box of the doubled middles of their boxes."""
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
    """The axis along which the middles are farthest apart, and the bin before which a cut has the lowest cost; -1 for none."""
    axis = 0
    for k in range(1, 3):
        if middles[k + 3] - middles[k] > middles[axis + 3] - middles[axis]:
            axis = k
    low, span = middles[axis], middles[axis + 3] - middles[axis]
    if not span > f4(1e-30):
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


@inner
def _halves(boxes, order, first, stop, level, middles, counts, bins, right):
    """Sort the triangles from `first` to `stop` into two parts, cut at the lowest cost; return the start of the second part.

    Deep down, parts are halves, so that no tree is deeper than 2 * STEEP.
    """
    axis, cut, scale = 0, -1, f4(0)
    if level < STEEP:
        axis, cut, scale = _best_cut(boxes, order, first, stop, middles, counts, bins, right)
    if cut < 0:
        return (first + stop) // 2
    i, j = first, stop - 1
    while i <= j:
        if _bin(boxes[order[i]], axis, middles[axis], scale) < cut:
            i += 1
        else:
            order[i], order[j] = order[j], order[i]
            j -= 1
    return i


@njit(_nrt=True)
def build(boxes, order, bounds, links):
    """Fill bounds (2 T, 6) float32 and links (2 T, 2) int32 for T boxes (T, 6) of triangles; return the number of nodes.

    order (T,) int32, initially 0 to T - 1, is sorted by leaves. For a leaf, links holds its first place in `order` and its
    count. For another node, it holds the first of its two adjacent children, and 0.
    """
    waiting, depth, nodes = np.empty((2 * STEEP + 1, 4), np.int64), 1, 1
    counts, bins, right = np.empty(BINS, np.int32), np.empty((BINS + 1, 6), np.float32), np.empty(BINS, np.float32)
    middles = np.empty(6, np.float32)
    waiting[0, 0], waiting[0, 1], waiting[0, 2], waiting[0, 3] = 0, 0, len(order), 0
    while depth > 0:
        depth -= 1
        node, first, stop, level = waiting[depth, 0], waiting[depth, 1], waiting[depth, 2], waiting[depth, 3]
        _bound(boxes, order, first, stop, bounds[node], middles)
        if stop - first <= WIDE:
            links[node, 0], links[node, 1] = first, stop - first
            continue
        cut = _halves(boxes, order, first, stop, level, middles, counts, bins, right)
        links[node, 0], links[node, 1] = nodes, 0
        for k in range(2):
            own = waiting[depth + k]
            own[0], own[1], own[2], own[3] = nodes + 1 - k, first if k else cut, cut if k else stop, level + 1
        depth += 2
        nodes += 2
    return nodes


@inner
def _gather(bounds, links, node, group):
    """Fill group (WIDE,) with the nodes that replace `node`: the largest of them is replaced by its children while there is
    room. Return their number.
    """
    group[0], count = node, 1
    while count < WIDE:
        widest, largest = -1, f4(-1)
        for k in range(count):
            if links[group[k], 1] == 0 and _area(bounds[group[k]]) > largest:
                widest, largest = k, _area(bounds[group[k]])
        if widest < 0:
            break
        first = links[group[widest], 0]
        group[widest], group[count] = first, first + 1
        count += 1
    return count


@njit(_nrt=True)
def widen(bounds, links, order, corners, tree):
    """Fill a `tracing.Tree` with the result of `build`; corners (T, 9): those of all triangles. Return the number of nodes."""
    waiting, depth, nodes, leaves = np.empty((DEEP, 2), np.int64), 1, 1, 0
    group = np.empty(WIDE, np.int64)
    waiting[0, 0], waiting[0, 1] = 0, 0
    while depth > 0:
        depth -= 1
        node = waiting[depth, 1]
        count = _gather(bounds, links, waiting[depth, 0], group)
        for k in range(WIDE):
            tree.links[node, k] = -1
            for row in range(6):
                tree.bounds[node, row * WIDE + k] = bounds[group[k], row] if k < count else f4(np.inf)
            if k >= count:
                continue
            first, within = links[group[k], 0], links[group[k], 1]
            if within == 0:
                tree.links[node, k] = nodes
                waiting[depth, 0], waiting[depth, 1] = group[k], nodes
                depth += 1
                nodes += 1
                continue
            tree.links[node, k] = -1 - leaves
            for i in range(WIDE):
                triangle = order[first + min(i, within - 1)]
                tree.order[leaves * WIDE + i] = triangle
                for row in range(9):
                    tree.corners[leaves, row * WIDE + i] = corners[triangle, row] if i < within else f4(0)
            leaves += 1
    return nodes


def _mask(flags):
    """Flags of lanes packed as the bits of an unsigned number."""
    builder = flags.builder
    return builder.zext(builder.bitcast(flags.value, ir.IntType(WIDE)), ir.IntType(64))


def _rows(context, builder, signature, arguments, count):
    """The item of the first argument, an array, at the index of the second one: `count` rows of WIDE numbers."""
    data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
    first = builder.mul(arguments[1], arguments[1].type(count * WIDE))
    return [_strict(load(builder, data, builder.add(first, first.type(row * WIDE)), WIDE)) for row in range(count)]


def _strict(lanes):
    """Exact comparison of lanes: a ray that passed between two triangles of a closed surface would leak light
    from behind it.
    """
    return Strict(lanes.builder, lanes.value)


def _spread(builder, numbers):
    return [_strict(spread(builder, number, WIDE)) for number in cgutils.unpack_tuple(builder, numbers)]


@intrinsic
def _enters(typing, bounds, node, o, inverse, limit, stack):
    """Return the children of a node that a ray enters before `limit`, as bits.

    The distances along the ray go to the first places of the stack.
    """

    def code(context, builder, signature, arguments):
        box = _rows(context, builder, signature, arguments, 6)
        start, turned = _spread(builder, arguments[2]), _spread(builder, arguments[3])
        far = _strict(spread(builder, arguments[4], WIDE))
        near = far.all(0.0)
        for k in range(3):
            a, b = (box[k] - start[k]) * turned[k], (box[k + 3] - start[k]) * turned[k]
            # In this order NaN, where the ray lies in a plane of the box, changes neither `near` nor `far`.
            near, far = most(least(b, a), near), least(most(a, b), far)
        store(context.make_array(signature.args[5])(context, builder, arguments[5]).data, arguments[1].type(0), near)
        return _mask((near <= far * ROUNDED) & (near < np.inf))

    return nb.uint64(bounds, nb.uintp, o, inverse, nb.float32, stack), code


@intrinsic
def _meets(typing, corners, leaf, o, d, limit, stack):
    """Return the triangles of a leaf that a ray meets before `limit`, as bits (Moeller and Trumbore).

    A leaf's triangle is its first corner and two edges. The distances along the ray go to the first places of the stack.
    """

    def code(context, builder, signature, arguments):
        rows = _rows(context, builder, signature, arguments, 9)
        start, way = _spread(builder, arguments[2]), _spread(builder, arguments[3])
        corner, a, b = rows[:3], rows[3:6], rows[6:]
        p = cross(way, b)
        scale = 1 / dot(a, p)
        s = [start[k] - corner[k] for k in range(3)]
        q = cross(s, a)
        # Infinite numbers, from rays in the triangle's plane, pass no comparison.
        u, v, t = dot(s, p) * scale, dot(way, q) * scale, dot(b, q) * scale
        store(context.make_array(signature.args[5])(context, builder, arguments[5]).data, arguments[1].type(0), t)
        return _mask((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & (t < spread(builder, arguments[4], WIDE)))

    return nb.uint64(corners, nb.uintp, o, d, nb.float32, stack), code


@intrinsic
def _first(typing, bits):
    """The place of the lowest bit that is set."""

    def code(context, builder, signature, arguments):
        return builder.cttz(arguments[0], ir.IntType(1)(1))

    return nb.uintp(nb.uint64), code


@inner
def _over(d):
    """1 / d, infinity if d is 0."""
    return f4(1) / d if abs(d) > f4(1.2e-38) else f4(np.inf)


@inner
def nearest(tree, o, d, limit, is_any, stack):
    """The place in the tree's leaves of the first triangle that a ray hits before `limit`, -1 for none, and its distance.

    o, d: tuples; stack (DEEP, 2) float32: scratch; is_any: return any hit, not only the first.
    """
    shortest, found = limit, NOTHING
    inverse = _over(d[0]), _over(d[1]), _over(d[2])
    bottom = U(WIDE // 2)
    stack[bottom, U(0)], stack[bottom, U(1)], depth = f4(0), f4(0), bottom + U(1)
    while depth > bottom:
        depth -= U(1)
        if stack[depth, U(1)] >= shortest:
            continue
        link = nb.int32(stack[depth, U(0)])
        if link < 0:
            leaf = U(-1 - link)
            bits = _meets(tree.corners, leaf, o, d, shortest, stack)
            while bits:
                k = _first(bits)
                t = stack[k >> U(1), k & U(1)]
                if t < shortest:
                    shortest, found = t, nb.int64(leaf * U(WIDE) + k)
                bits &= bits - nb.uint64(1)
            if is_any and found >= 0:
                return found, shortest
            continue
        bits = _enters(tree.bounds, U(link), o, inverse, shortest, stack)
        top = depth
        while bits:
            k = _first(bits)
            t, i = stack[k >> U(1), k & U(1)], depth
            while i > top and stack[i - U(1), U(1)] < t:
                stack[i, U(0)], stack[i, U(1)] = stack[i - U(1), U(0)], stack[i - U(1), U(1)]
                i -= U(1)
            stack[i, U(0)], stack[i, U(1)] = f4(tree.links[U(link), k]), t
            depth += U(1)
            bits &= bits - nb.uint64(1)
    return found, shortest


@inner
def triangle(tree, place):
    """The first corner and both edges of the triangle at a place in the tree's leaves."""
    row, k = tree.corners[U(place) // U(WIDE)], U(place) % U(WIDE)
    a, b, c, w = k + U(3 * WIDE), k + U(6 * WIDE), U(WIDE), U(2 * WIDE)
    return (row[k], row[k + c], row[k + w]), (row[a], row[a + c], row[a + w]), (row[b], row[b + c], row[b + w])


@njit(_nrt=True)
def cast(tree, origins, directions, turn, limit, met, far):
    """Find the first hit from each origin (N, 3) in each direction `directions[turn, k]` (W, K, 3), k of K. // Its place in the
    tree goes into met (K, N) int32, -1 for nothing before `limit`; its distance, in lengths of the direction, into far (K, N)
    float32. turn (N,): each origin's own.

    Consecutive parallel rays find the same boxes in the cache, so origins with the same turn should be adjacent.
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
    """Write into clear (N,) float32 whether nothing is between each origin (N, 3) and origin + way (N, 3): 1 or 0."""
    stack = np.empty((DEEP, 2), np.float32)
    for i in range(U(origins.shape[0])):
        o = origins[i, U(0)], origins[i, U(1)], origins[i, U(2)]
        d = ways[i, U(0)], ways[i, U(1)], ways[i, U(2)]
        found, _ = nearest(tree, o, d, f4(0.999), True, stack)
        clear[i] = f4(1) if found < 0 else f4(0)
