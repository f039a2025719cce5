"""The share of each light that arrives at a block's samples: distance, cone, and shadows that soften with distance.

Most samples are either in front of everything near them in the shadow map, or behind it. Planes that enclose each cell of the
map decide between the two. Only the other samples search the map for blockers.

Area lights: the light vector of a polygon (Lambert 1760).
"""

# ruff: isort: skip_file
from __future__ import annotations

import math

import numba as nb

from viewsphere.engines.raster.shading.kernels_block import (
    BLOCK, GX, GY, GZ, IB, IG, IR, LX, LY, LZ, NX, NY, NZ, PIXEL, PROBES, PX, PY, PZ, SHARE, T0, U0, U1, V0, V1, WIDTH,
)  # fmt: skip
from viewsphere.kernels.lanes import clamp, cross, dot, lanewise, least, most, root, size, where
from viewsphere.engines.raster.shadows.kernels_soft_shadows import (
    DU, DV, FACING, NEAR, Q_, RADIUS, SOFT, STATE, U_, V_, power, search, span,
)  # fmt: skip
from viewsphere.engines.raster.shadows.kernels_shadow import (
    ACROSS, BIAS_FAR, BIAS_NEAR, BOUNDS_AT, CELLS, DOWN, HIGH, LOW, MIDDLE, NEAREST, READ, SHARPEST, STEP, TEXELS,
)  # fmt: skip
from viewsphere.kernels.lanes import FAST
from viewsphere.kernels.jit import inner, njit

f4 = nb.float32
U = nb.uintp
DISTANT, POINT, SPOT, AREA = 0, 1, 2, 3
# Rows in use while a view is evaluated, in addition to those of `kernels_soft_shadows`.
CELL, OFF_U, OFF_V, DOWN_, OWN = U0, V0, U1, V1, PROBES
LOW_, HIGH_, ACROSS_ = CELL, OFF_U, OFF_V
BLUNTEST = 16.0  # texels: maximum half width of a filter that follows from a pixel's size
GRAZING = 0.02  # a plane's slope in a map is limited to the slope for a light this far above the plane (sine)


def _seen(row, first, x, y, z):
    """A row of a view's matrix times a point."""
    return row.one(first) * x + row.one(first + 1) * y + row.one(first + 2) * z + row.one(first + 3)


@inner
def _count_on(count, b):
    """Return the number of samples with light left that are on a view's map."""
    found = 0
    for i in range(count):
        found += 1 if b[STATE + i] == f4(-1) else 0
    return found


@lanewise
def _see(row, b):
    """Write the places of the samples in a view, in texels from its middle: U, V.

    Also write SOFT, one over the distance along the view's axis, and STATE.
    """
    x, y, z = b.get(PX, PY, PZ)
    w = _seen(row, 12, x, y, z)
    inverse = 1 / most(w, 1e-6)
    u, v = _seen(row, 0, x, y, z) * inverse, _seen(row, 4, x, y, z) * inverse
    on = (most(size(u), size(v)) <= row.one(READ)) & (w > 1e-6) & (b[FACING] > 0)
    b.put((U_, V_, SOFT), (u, v, inverse))
    b[STATE] = where(on, -1, -2)


@lanewise
def _project(row, b):
    """U and V in texels, Q, its slopes, Q minus the bias, the minimum filter and the first RADIUS."""
    normal, inverse, on = b.get(GX, GY, GZ), b[SOFT], b[STATE].equals(-1)
    texels, middle = row.one(TEXELS), row.one(MIDDLE)
    q = where(on, _seen(row, 8, *b.get(PX, PY, PZ)) * inverse, 0)
    slope = 1 / (texels * texels * most(b[FACING], 1e-6))
    du, dv = (dot(tuple(row.one(first + k) for k in range(3)), normal) * slope for first in (0, 4))
    softest = least(most(b[PIXEL] * texels * inverse * 0.5, row.one(SHARPEST)), BLUNTEST)
    b.put((U_, V_), (where(on, b[U_], 0) + middle, where(on, b[V_], 0) + middle))
    b.put((Q_, DU, DV, SOFT), (q, du, dv, softest))
    b[NEAR] = q - row.one(BIAS_FAR) - row.one(BIAS_NEAR) * size(q) - 0.6 * (size(du) + size(dv))
    b[RADIUS] = least(most(span(row, b) * (q - row.one(NEAREST)), 0) + softest, middle)


@lanewise
def _find_cells(side, b):
    """CELL: the cell that contains everything within RADIUS of each sample; OFF_U, OFF_V: the sample's place relative to the
    cell's middle.
    """
    u, v, radius = b.get(U_, V_, RADIUS)
    # The power of two that is at most the radius: a cell's step is four times that power.
    level = least(most(power(radius), 1), side)
    step, last = level * STEP, side / level - 1
    x, y = (least(most((place - radius - 0.5) / step, 0).whole().real(), last) for place in (u, v))
    b[CELL] = (2 * side) * (y + 1) - (2 * side) / level + x
    b.put((OFF_U, OFF_V), (u - (x + 1) * step, v - (y + 1) * step))


@inner(fastmath=FAST)
def _read_cells(count, at, bounds, b):
    """The two planes of each sample's cell, evaluated at the sample, and their slopes, which replace CELL, OFF_U, OFF_V."""
    for i in range(U(count)):
        k = at + U(nb.int32(b[U(CELL) + i]))
        across, down = bounds[k, U(ACROSS)], bounds[k, U(DOWN)]
        on = across * b[U(OFF_U) + i] + down * b[U(OFF_V) + i]
        b[U(LOW_) + i], b[U(HIGH_) + i] = bounds[k, U(LOW)] + on, bounds[k, U(HIGH)] + on
        b[U(ACROSS_) + i], b[U(DOWN_) + i] = across, down


@lanewise
def _judge(row, b):
    """STATE of samples in front of all texels within RADIUS (1) or behind all of them (0); a smaller RADIUS for the others."""
    near, radius, across, down, low = b.get(NEAR, RADIUS, ACROSS_, DOWN_, LOW_)
    tilt = (size(across - b[DU]) + size(down - b[DV])) * (radius + 0.5)
    b[STATE] = where(near + tilt <= low, 1, where(near - tilt > b[HIGH_], 0, -1))
    gap = most(b[Q_] - low + (size(across) + size(down)) * radius, 0)
    b[RADIUS] = least(span(row, b) * gap + b[SOFT], radius)


@inner
def _gather_on(count, b):
    """Move the samples on the map to the front of the block; OWN stores the original place of each."""
    left = U(0)
    for i in range(U(count)):
        if b[U(STATE) + i] == f4(-1):
            b[U(OWN) + left] = f4(i)
            left = _move(i, left, b)


@inner
def _all_on(count, b):
    """The equivalent of `_gather_on` if all samples are on the map."""
    for i in range(count):
        b[OWN + i] = f4(i)


@inner
def _settle(count, b):
    """Store decided results in SHARE and FACING, and move the undecided samples to the front; return their number."""
    left = U(0)
    for i in range(U(count)):
        state, own = b[U(STATE) + i], U(nb.int32(b[U(OWN) + i]))
        if state >= f4(0):
            b[U(SHARE) + own] *= state
            b[U(FACING) + own] = f4(0)
        else:
            b[U(OWN) + left] = b[U(OWN) + i]
            left = _move(i, left, b)
    return left


@inner
def _move(i, to, b):
    """Move all data of a sample on the map to row position `to`; return the position after it."""
    for row in range(U(U_), U(SOFT + 1), U(BLOCK)):
        b[row + to] = b[row + i]
    b[U(RADIUS) + to] = b[U(RADIUS) + i]
    return to + U(1)


@lanewise
def _from_area(place, axis, right, up, radius, b):
    """Direction and size (into T0) of the irradiance of a rectangle of unit strength."""
    way = tuple(place.one(k) - b[row] for k, row in enumerate((PX, PY, PZ)))
    right, up, axis = (tuple(v.one(k) for k in range(3)) for v in (right, up, axis))
    across, along = dot(right, right), dot(up, up)
    squared = dot(way, way) + 1e-12
    inverse = 1 / root(squared)
    straight = tuple(w * inverse for w in way)
    front = most(-dot(straight, axis), 0)
    wide = root(across + along) * inverse
    close = clamp(wide * 10 - 0.5)  # 0 below a twentieth, 1 from 0.15
    corners = [
        _unit(tuple(w + r * x + u * y for w, x, y in zip(way, right, up, strict=True)))
        for r, u in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]
    edges = [_edge(corners[k], corners[(k + 1) % 4]) for k in range(4)]
    scale = 0.125 / most(root(across * along), 1e-12)
    light = tuple((a + b + c + d) * scale for a, b, c, d in zip(*edges, strict=True))
    turn = where(dot(light, straight) < 0, -1, 1)
    # In the rectangle's own plane, rounding errors would decide between full light and none.
    turn = where(front > wide * 1e-3, turn * close, 0)
    far = front / most(squared, radius * radius * 0.01) * (1 - close)
    light = tuple(p * turn + s * far for p, s in zip(light, straight, strict=True))
    strength = root(dot(light, light))
    per = 1 / most(strength, 1e-20)
    for row, s, p in zip((LX, LY, LZ), straight, light, strict=True):
        b[row] = where(strength <= 1e-20, s, p * per)
    b[T0] = strength
    b[WIDTH] = least(radius * inverse, 0.5 * math.pi)


def _unit(way):
    per = 1 / root(dot(way, way) + 1e-12)
    return tuple(w * per for w in way)


def _edge(a, b):
    """The contribution of one edge to a polygon's light vector: the arc's length about the plane through both unit vectors."""
    c = dot(a, b)
    y = least(size(c), 1)
    # Arc cosine: Abramowitz and Stegun 4.4.45.
    arc = root(1 - y) * (1.5707288 + y * (-0.2121144 + y * (0.0742610 + y * -0.0187293)))
    arc = where(c >= 0, arc, math.pi - arc)
    s = where(y < 0.999999, arc / root(most(1 - y * y, 1e-12)), 1)
    return tuple(part * s for part in cross(a, b))


@lanewise
def _from_place(place, axis, cone, radius, b):
    """Direction and size (into T0) of the irradiance of a point or spot of unit strength."""
    way = tuple(place.one(k) - b[row] for k, row in enumerate((PX, PY, PZ)))
    squared = dot(way, way) + 1e-12
    inverse = 1 / root(squared)
    straight = tuple(w * inverse for w in way)
    inside = clamp((-dot(straight, tuple(axis.one(k) for k in range(3))) - cone.one(0)) * cone.one(1))
    b.put((LX, LY, LZ), straight)
    b[T0] = inside * inside * (3 - 2 * inside) / most(squared, radius * radius)
    b[WIDTH] = least(radius * inverse, 0.5 * math.pi)


@lanewise
def _from_afar(place, radius, b):
    """Direction and size (into T0) of the irradiance of a distant light of unit strength."""
    for k, row in enumerate((LX, LY, LZ)):
        b[row] = place.one(k)
    b[T0], b[WIDTH] = 1.0, radius


@lanewise
def _turn(place, near, b):
    """Fill SHARE, before any shadow, with the share of the light that the surface's tilt leaves; fill FACING of samples that
    have light.

    near: 1 for a light at a place, 0 for a distant one. The views look from a rectangle's middle, but most of a rectangle's
    light may come from another part of it.
    """
    way, normal = b.get(LX, LY, LZ), b.get(GX, GY, GZ)
    share = clamp(1.6 + 4 * dot(normal, way))
    share = where((dot(b.get(NX, NY, NZ), way) > 0) & (b[T0] > 0), share, 0)
    b[SHARE] = share
    way = tuple(place.one(k) - b[row] * near for k, row in enumerate((PX, PY, PZ)))
    facing = most(dot(normal, way), GRAZING * root(dot(way, way)))
    b[FACING] = where(share > 0, facing, 0)


@lanewise
def _shine(color, b):
    for k, row in enumerate((IR, IG, IB)):
        b[row] = color.one(k) * b[T0]


@inner(fastmath=FAST)
def look(count, form, grid, depth, bounds, k, b):
    """Multiply SHARE by the share of its light that view k (uintp) of these `Views` lets through, for samples on its map.

    FACING holds the cosine between the surface and the light, times the distance to a light at a place. The view sets FACING to
    0 for decided samples, and changes nothing if FACING is not above 0. (GX, GY, GZ) may be zero if there is no surface.
    """
    row, places = form[k], grid[k]
    _see(count, row, b)
    left = _count_on(count, b)
    if left == 0:
        return
    _project(count, row, b)
    if left < count:
        _gather_on(count, b)
    else:
        _all_on(count, b)
    for _ in range(3):
        if left > 0:
            _find_cells(left, f4(places[CELLS]), b)
            _read_cells(left, U(places[BOUNDS_AT]), bounds, b)
            _judge(left, row, b)
            left = nb.intp(_settle(left, b))
    if left > 0:
        search(left, row, places, depth, b)
        _settle(left, b)


@njit(fastmath=FAST)
def arrive(count, lights, k, b):
    """Fill LX..LZ, IR..IB, SHARE and WIDTH of a block for light k.

    The irradiance is that of a plane facing the light, without shadows; SHARE is the share that shadows leave. With smooth
    normals, a facet that faces away slightly is lit like its neighbours: from afar, bumps have no lit or dark sides.
    """
    k = U(k)
    kind, place, radius = lights.kind[k], lights.place[k], lights.radius[k]
    if kind == DISTANT:
        _from_afar(count, place, radius, b)
    elif kind == AREA:
        _from_area(count, place, lights.axis[k], lights.right[k], lights.up[k], radius, b)
    else:
        _from_place(count, place, lights.axis[k], lights.cone[k], radius, b)
    _turn(count, place, f4(0) if kind == DISTANT else f4(1), b)
    first, stop, views = lights.first[k], lights.first[k + U(1)], lights.views
    # For each sample the first view that it is on.
    for which in range(first, stop):
        look(count, views.form, views.grid, views.depth, views.bounds, U(which), b)
    _shine(count, lights.color[k], b)
