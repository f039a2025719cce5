"""Light that things reflect onto one another, looked up for the samples of a block in a volume of probes and a map of the
ground.

A probe stores the irradiance for every direction, as spherical harmonics up to degree 2 (Ramamoorthi and Hanrahan 2001), and
its view in each direction, for mirrors (`kernels_views`). A sample reads the eight probes around it slightly off its surface:
only those that are in front of the surface and see it. Two planes for each of the eight cells around a probe bound the part of
the cell that the probe sees; they come from the rays it was baked with. Without them, light of a lit room would leak through
its walls (cf. Majercik, Guertin, Nowrouzezahrai and McGuire 2019, who store depths).
"""

from __future__ import annotations

import numba as nb
from numba.extending import intrinsic

from viewsphere.engines.raster.indirect.kernels_views import CORNERS
from viewsphere.engines.raster.lightmaps.kernels_lightmap import forget_map, read_map
from viewsphere.engines.raster.lightmaps.kernels_vertex_light import read_vertices
from viewsphere.engines.raster.shading.kernels_blend import blend
from viewsphere.engines.raster.shading.kernels_block import (
    AO,
    BLOCK,
    GLOW_B,
    GLOW_G,
    GLOW_R,
    GX,
    GY,
    GZ,
    INSIDE,
    KEPT,
    LEAN_B,
    LEAN_G,
    LEAN_R,
    LX,
    LY,
    LZ,
    MAPPED,
    NX,
    NY,
    NZ,
    OPEN,
    PROBES,
    PX,
    PY,
    PZ,
    T0,
    T1,
    T2,
    T3,
    T4,
    T5,
    T6,
    T7,
    VX,
    VY,
    VZ,
)  # fmt: skip
from viewsphere.kernels.jit import inner
from viewsphere.kernels.lanes import FAST, clamp, dot, lanewise, least, load, most, root, scatter, spread, where

f4 = nb.float32
i4 = nb.int32
U = nb.uintp

FRAME = 7  # columns of Bounces.frame
COLUMNS = 28  # columns of Bounces.light: irradiance / pi in nine terms of red, green and blue; the last is unused
SCREENS = 2
BEHIND = 0.02  # minimum weight of a probe behind the surface
# Minimum weights of a probe that does not see the surface: for most probes, for one within a thing, for one under the open sky.
HIDDEN, BURIED, OUTDOORS = 2e-3, 2e-5, 2e-7
SHARP = 20.0  # one over the depth behind a screen, in cells, at which a probe no longer counts
SLACK = -0.02  # cells behind a screen that still count in full; negative, so that probes within a wall never count
LEANING = 0.45  # how far the lobe of a rough surface leans from its normal (0) towards the mirrored ray (1)
OFF = 0.1  # cells off the surface from which a sample looks at the screens
PLACE, FIRST_X, FIRST_Y, FIRST_Z = LX, LY, LZ, GLOW_R  # scratch; the cell's first corner
_blend4, _blend28 = blend(4), blend(COLUMNS)
WEIGHTS = (T0, T1, T2, T3, T4, T5, T6, T7)


def _within(most_of):
    return (most_of[0] > 0) & (most_of[1] > 0) & (most_of[2] > 0)


@lanewise
def _place(frame, columns, rows, layers, b):
    """PLACE: the first of the eight probes around; T0 to T7: their weights by distance and by their position in front of the
    surface.

    FIRST_X to FIRST_Z: the point, in cells from the first probe, from which the sample tests the screens. INSIDE: how far
    inside the volumes the sample reads, 0..1. If the sample is within both volumes, the inner one is used.
    """
    # Halfway between both normals: bumps hardly move it, and facets of a round thing stay invisible.
    normal = tuple((n + g) * 0.5 for n, g in zip(b.get(NX, NY, NZ), b.get(GX, GY, GZ), strict=True))
    position, shape = b.get(PX, PY, PZ), (columns, rows, layers)
    own, outer = ([(p - frame.one(at + k)) * frame.one(at + 3) for k, p in enumerate(position)] for at in (0, FRAME))
    place = [at + n * frame.one(4) for at, n in zip(own, normal, strict=True)]
    is_near = _within([least(at, points - 1 - at) for at, points in zip(place, shape, strict=True)])
    own = [where(is_near, at, around) for at, around in zip(own, outer, strict=True)]
    push, fade, start = (where(is_near, frame.one(k), frame.one(FRAME + k)) for k in (4, 5, 6))
    place = [at + n * push for at, n in zip(own, normal, strict=True)]
    most_of = [least(at, points - 1 - at) for at, points in zip(place, shape, strict=True)]
    b[INSIDE] = clamp(least(least(most_of[0], most_of[1]), most_of[2]) * fade)
    is_within = _within(most_of)
    # NaN is placed at the first point.
    place = [where(is_within, at, 0) for at in place]
    first = [at.whole().real() for at in place]
    part = [at - low for at, low in zip(place, first, strict=True)]
    b[PLACE] = start + (first[2] * rows + first[1]) * columns + first[0]
    looks = [where(is_within, at - low + n * OFF, 0) for at, low, n in zip(own, first, normal, strict=True)]
    b.put((FIRST_X, FIRST_Y, FIRST_Z), looks)
    off = dot([low - at for low, at in zip(first, own, strict=True)], normal)
    shares = []
    for k in range(CORNERS):
        share, before = None, off
        for axis in range(3):
            is_next = k >> axis & 1
            near_by = part[axis] if is_next else 1 - part[axis]
            share = near_by if share is None else share * near_by
            before = before + normal[axis] if is_next else before
        shares.append((share + 1e-4) * least(most(before * 2, BEHIND), 1))
    b.put(WEIGHTS, shares)


@intrinsic
def _look(typing, screens, cell, x, y, z, b, at):
    """Store the share of a place that each corner of its cell sees in eight rows of b.

    x, y, z: the place, in cells from the cell's first corner.
    """

    def code(context, builder, signature, arguments):
        table, target = (context.make_array(signature.args[n])(context, builder, arguments[n]).data for n in (0, 5))
        row = builder.mul(arguments[1], arguments[1].type((4 * SCREENS + 1) * CORNERS))
        planes = [load(builder, table, builder.add(row, row.type(k * CORNERS)), CORNERS) for k in range(4 * SCREENS + 1)]
        place = [spread(builder, value, CORNERS) for value in arguments[2:5]]
        before = least(dot(planes[:3], place) + planes[3], dot(planes[4:7], place) + planes[7])
        seen = least(most((before + SLACK) * SHARP + 1, planes[8]), 1)
        scatter(target, arguments[6], {k: k * BLOCK for k in range(CORNERS)}, seen)
        return context.get_dummy_value()

    return nb.void(screens, nb.uintp, nb.float32, nb.float32, nb.float32, b, nb.uintp), code


@inner(fastmath=FAST)
def _screen(count, screens, b):
    """Rows PROBES on: the share of the samples that each of the eight probes sees."""
    for i in range(U(count)):
        place = b[U(FIRST_X) + i], b[U(FIRST_Y) + i], b[U(FIRST_Z) + i]
        _look(screens, U(i4(b[U(PLACE) + i])), place[0], place[1], place[2], b, U(PROBES) + i)


@lanewise
def _weigh(b):
    shares = [b[row] * b[PROBES, k * BLOCK] for k, row in enumerate(WEIGHTS)]
    scale = 1 / most(sum(shares[1:], shares[0]), 1e-12)
    for k, share in enumerate(shares):
        b[WEIGHTS[k]] = b[KEPT, k * BLOCK] = share * scale
    b[KEPT, CORNERS * BLOCK] = b[PLACE]


@inner(fastmath=FAST)
def _read(count, light, columns, layer, b):
    """Rows PROBES on: the weighted sum of the columns of the eight probes. layer: number of probes in a layer."""
    one = U(1)
    for i in range(U(count)):
        if b[U(MAPPED) + i] > f4(0):
            continue
        p = U(i4(b[U(PLACE) + i]))
        q, r = p + columns, p + layer
        s = r + columns
        near, far = (b[T0 + i], b[T1 + i], b[T2 + i], b[T3 + i]), (b[T4 + i], b[T5 + i], b[T6 + i], b[T7 + i])
        _blend28(light, (p, p + one, q, q + one, r, r + one, s, s + one), (*near, *far), b, U(PROBES) + i)


def terms(x, y, z):
    """The nine polynomials that the columns of irradiance multiply, except the first, which is 1."""
    return y, z, x, x * y, y * z, 3 * z * z - 1, x * z, x * x - y * y


@lanewise
def _shine(b):
    """GLOW, and LEAN: the value for a surface that leans towards the mirrored ray. The lightmap has the same value for both."""
    inside, open_, is_mapped = b[INSIDE], b[OPEN], b[MAPPED] > 0
    normal, view = b.get(NX, NY, NZ), b.get(VX, VY, VZ)
    along = clamp(dot(normal, view))
    leaning = tuple(n + (2 * along * n - v - n) * LEANING for n, v in zip(normal, view, strict=True))
    per = 1 / most(root(dot(leaning, leaning)), 1e-6)
    kinds = terms(*normal), terms(*(x * per for x in leaning))
    for k in range(3):
        own = b[GLOW_R, k * BLOCK]
        for polynomials, row in zip(kinds, (GLOW_R, LEAN_R), strict=True):
            value = b[PROBES, k * BLOCK]
            for j, polynomial in enumerate(polynomials, 1):
                value = value + polynomial * b[PROBES, (3 * j + k) * BLOCK]
            b[row, k * BLOCK] = where(is_mapped, own, most(value, 0) * inside) * open_


@lanewise
def _place_on_floor(frame, across, b):
    """T0: 1 more than the index of the first of four cells, 0 beyond the map; T1 to T4: weights. `across`: cells in a row."""
    u = (b[PX] - frame.one(1)) * frame.one(0) - 0.5
    v = (b[PY] - frame.one(2)) * frame.one(0) - 0.5
    is_within = (u >= 0) & (v >= 0) & (u < across - 1) & (v < across - 1)
    u, v = where(is_within, u, 0), where(is_within, v, 0)
    column, row = u.whole().real(), v.whole().real()
    fu, fv = u - column, v - row
    right = fu * fv
    b[T0] = where(is_within, row * across + column + 1, 0)
    b.put((T1, T2, T3, T4), (1 - fu - fv + right, fu - right, fv - right, right))
    for row in (GLOW_R, GLOW_G, GLOW_B, LEAN_R, LEAN_G, LEAN_B, INSIDE, MAPPED):
        b[row] = 0
    for k in range(CORNERS + 1):
        b[KEPT, k * BLOCK] = 0


@inner(fastmath=FAST)
def _read_floor(count, floor, frame, b):
    across = U(floor.shape[0])
    _place_on_floor(count, frame, f4(across), b)
    for i in range(U(count)):
        if b[T0 + i] > f4(0):
            p = U(i4(b[T0 + i])) - U(1)
            q = p + across
            weights = b[T1 + i], b[T2 + i], b[T3 + i], b[T4 + i]
            _blend4(floor, (p, p + U(1), q, q + U(1)), weights, b, U(GLOW_R) + i)


@lanewise
def _darken(b):
    """Multiply this light, too, by the value of an occlusion texture."""
    for row, lean in ((GLOW_R, LEAN_R), (GLOW_G, LEAN_G), (GLOW_B, LEAN_B)):
        b[row] = b[lean] = b[row] * b[AO]
    b[INSIDE] = 0


@inner(fastmath=FAST)
def dim_by_near(start, count, slots, near, b):
    """Replace the probes' light that near surfaces block from the samples `slots` by the near surfaces' own light."""
    for i in range(U(count)):
        own = near[U(slots[U(start) + i])]
        known = max(b[U(INSIDE) + i], b[U(MAPPED) + i]) * b[U(OPEN) + i]  # in proportion to the probes' light
        for k in range(U(3)):
            for row in (U(GLOW_R) + k * U(BLOCK) + i, U(LEAN_R) + k * U(BLOCK) + i):
                b[row] = b[row] * own[U(0)] + own[U(1) + k] * known


@inner
def bounced(count, bounces, is_ground, own, b):
    """Fill GLOW, LEAN, INSIDE and MAPPED of a block after occlusion; rows KEPT and on get the weights of the eight probes
    around, and the first of these. own: the samples' triangles, unless they are on the ground.

    Overwrites the rows of a light.
    """
    if is_ground and bounces.floor_frame[U(3)] > f4(0):
        _read_floor(count, bounces.floor, bounces.floor_frame, b)
        _darken(count, b)
        return
    layers, rows, columns = U(bounces.grid[0]), U(bounces.grid[1]), U(bounces.grid[2])
    _place(count, bounces.frame, f4(columns), f4(rows), f4(layers), b)
    _screen(count, bounces.screens, b)
    _weigh(count, b)
    if is_ground or bounces.lightmap.chart.shape[0] == 0:
        forget_map(count, b)
    else:
        read_map(count, bounces.lightmap, own, b)
        read_vertices(count, bounces.lightmap, own, b)
    _read(count, bounces.light, columns, rows * columns, b)
    _shine(count, b)
