"""A probe's view in each direction: the light that things send, and the share of sky and ground that they leave visible.

Directions are the nodes of an octahedron unfolded to a square (Cigolle et al. 2014, *A Survey of Efficient Representations for
Independent Unit Vectors*). Values are bilinear between nodes, about as blurred as in a mirror of roughness 0.5. At the square's
rim, two or four nodes represent one direction and have equal values.
"""

from __future__ import annotations

import numba as nb
import numpy as np
from numpy.typing import NDArray

from viewsphere.engines.raster.shading.kernels_blend import blend
from viewsphere.engines.raster.shading.kernels_block import (
    BLOCK,
    IG,
    INSIDE,
    IR,
    KEPT,
    LX,
    LY,
    LZ,
    PROBES,
    T0,
    T1,
    T2,
    T3,
)  # fmt: skip
from viewsphere.kernels.jit import inner, njit
from viewsphere.kernels.lanes import FAST, lanewise, least, most, size, where

f4 = nb.float32
i4 = nb.int32
U = nb.uintp
CORNERS = 8
SIDE = 7  # nodes
NODES = SIDE * SIDE
NODE, LEFT_UP, RIGHT_UP, LEFT, RIGHT = LX, LY, LZ, IR, IG  # scratch: the first of four nodes, and their weights
_blend4 = blend(4)


def _fold() -> NDArray[np.int32]:
    """The node that represents each node's direction, (NODES,) int32."""
    v, u = np.indices((SIDE, SIDE))
    is_corner = np.isin(u, (0, SIDE - 1)) & np.isin(v, (0, SIDE - 1))
    v = np.where(np.isin(u, (0, SIDE - 1)), np.minimum(v, SIDE - 1 - v), v)
    u = np.where(np.isin(v, (0, SIDE - 1)), np.minimum(u, SIDE - 1 - u), u)
    return np.where(is_corner, 0, v * SIDE + u).astype(np.int32).reshape(-1)


FOLD = _fold()


@inner
def add_view(own, fold, x, y, z, red, green, blue, seen):
    """Distribute light from a direction, and the visibility of the far background there, among the nodes around: own (NODES,
    4).
    """
    per = f4(1) / (abs(x) + abs(y) + abs(z))
    u, v = x * per, y * per
    if z < f4(0):
        u, v = (f4(1) - abs(v)) * (f4(1) if u >= f4(0) else f4(-1)), (f4(1) - abs(u)) * (f4(1) if v >= f4(0) else f4(-1))
    u, v = (u + f4(1)) * f4((SIDE - 1) / 2), (v + f4(1)) * f4((SIDE - 1) / 2)
    column, row = min(int(u), SIDE - 2), min(int(v), SIDE - 2)
    right, down = u - f4(column), v - f4(row)
    for k in range(4):
        share = (right if k & 1 else f4(1) - right) * (down if k & 2 else f4(1) - down)
        node = fold[(row + (k >> 1)) * SIDE + column + (k & 1)]
        own[node, 0] += share * red
        own[node, 1] += share * green
        own[node, 2] += share * blue
        own[node, 3] += share * seen


@njit
def send_views(ids, turn, own, directions, patch_is_ground, sent, fold, views):
    """Write the probes' views along rays into views (N, NODES, 4): the patches' light, and 1 if the ray reaches the sky or the
    ground.

    Patches send `sent` (M, 3). Each node that `fold` (NODES,) names holds the sum over all rays. Other arguments as in
    `kernels_probes.send`.
    """
    views[:] = f4(0)
    for k in range(ids.shape[0]):
        for i in range(ids.shape[1]):
            met, d = ids[k, i], directions[turn[i], k]
            if met < 0 or patch_is_ground[met]:
                add_view(views[own[i]], fold, d[0], d[1], d[2], f4(0), f4(0), f4(0), f4(1))
            else:
                add_view(views[own[i]], fold, d[0], d[1], d[2], sent[met, 0], sent[met, 1], sent[met, 2], f4(0))


@njit(_nrt=True)
def spread_views(turn, own, directions, fold, views):
    """Divide sums over rays into means, and copy each direction's value to all of its nodes."""
    counts = np.zeros((directions.shape[0], NODES, 4), np.float32)
    for w in range(directions.shape[0]):
        for k in range(directions.shape[1]):
            add_view(counts[w], fold, directions[w, k, 0], directions[w, k, 1], directions[w, k, 2], f4(0), f4(0), f4(0), f4(1))
    for i in range(own.shape[0]):
        view = views[own[i]]
        for n in range(NODES):
            if fold[n] == n:
                per = f4(1) / max(counts[turn[i], n, 3], f4(1e-3))
                for c in range(4):
                    view[n, c] *= per
        for n in range(NODES):
            for c in range(4):
                view[n, c] = view[fold[n], c]


@lanewise
def _place(b):
    """NODE to RIGHT: the first of the four nodes around the direction T0 to T2, and the weights of all."""
    x, y, z = b.get(T0, T1, T2)
    s = 1 / (size(x) + size(y) + size(z) + 1e-20)
    x, y = x * s, y * s
    u, v, is_down = 1 - size(y), 1 - size(x), z < 0
    u, v = (where(is_down, where(a >= 0, folded, -folded), a) for a, folded in ((x, u), (y, v)))
    # NaN counts as 0.
    u, v = (least(most((a + 1) * ((SIDE - 1) / 2), 0), SIDE - 1) for a in (u, v))
    column, row = (least(a, SIDE - 2).whole().real() for a in (u, v))
    right, down = u - column, v - row
    both = right * down
    b[NODE] = row * SIDE + column
    b.put((LEFT_UP, RIGHT_UP, LEFT, RIGHT), (1 - right - down + both, right - both, down - both, both))


@inner
def _around(first):
    """Rows of four nodes."""
    return first, first + U(1), first + U(SIDE), first + U(SIDE + 1)


@inner
def _shared(weight, own):
    return weight * own[0], weight * own[1], weight * own[2], weight * own[3]


@inner(fastmath=FAST)
def near_light(count, views, columns, layer, b):
    """Rows PROBES on: light that things send from the direction T0 to T2, and the share of the background that they leave
    visible.

    views (cells * NODES, 4); columns, layer: probes in one; rows KEPT on: the eight probes around, see `kernels_bounce`.
    """
    _place(count, b)
    nodes, across, up = U(NODES), columns * U(NODES), layer * U(NODES)
    for i in range(U(count)):
        p = U(i4(b[U(KEPT + CORNERS * BLOCK) + i])) * nodes + U(i4(b[U(NODE) + i]))
        own = b[U(LEFT_UP) + i], b[U(RIGHT_UP) + i], b[U(LEFT) + i], b[U(RIGHT) + i]
        k, step = U(KEPT) + i, U(BLOCK)
        q = p + up
        rows = _around(p) + _around(p + nodes) + _around(p + across) + _around(p + across + nodes)
        above = _around(q) + _around(q + nodes) + _around(q + across) + _around(q + across + nodes)
        shares = _shared(b[k], own) + _shared(b[k + step], own) + _shared(b[k + U(2) * step], own)
        others = _shared(b[k + U(3) * step], own) + _shared(b[k + U(4) * step], own) + _shared(b[k + U(5) * step], own)
        last = _shared(b[k + U(6) * step], own) + _shared(b[k + U(7) * step], own)
        _blend4(views, rows + above, shares + others + last, b, U(PROBES) + i)


@lanewise
def add_near_light(b):
    """Update T3 to T5, light from afar: multiply it by the share that things leave visible, and add their own light."""
    inside, seen = b[INSIDE], b[PROBES, 3 * BLOCK]
    for k in range(0, 3 * BLOCK, BLOCK):
        b[T3 + k] = b[T3 + k] * (1 + (seen - 1) * inside) + b[PROBES, k] * inside
