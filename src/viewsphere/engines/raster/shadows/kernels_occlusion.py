"""The share of the sky that is visible from a place: volumes around occluding things, maps of the ground below, and look-ups.

In a still picture, all targets share one volume and one map. In a sequence, each target has its own, which move along with it.
The shares of several targets are multiplied (Malmer, Malmer, Assarsson and Holzschuch 2007).

A cell of the volume has values for the directions above the horizon, and for the directions below. The values are the visible
share m of the sphere and the mean v of the visible directions. They are the spherical harmonics up to degree 1 (Ramamoorthi and
Hanrahan 2001). The cosine-weighted share that a surface with normal n can see is m + 2 v . n.
"""

from __future__ import annotations

import numba as nb
import numpy as np

from viewsphere.engines.raster.shading.kernels_blend import blend
from viewsphere.engines.raster.shading.kernels_block import (
    AO,
    BLOCK,
    BOUNCE,
    GROUND,
    IR,
    LX,
    LY,
    LZ,
    NX,
    NY,
    NZ,
    ONX,
    ONY,
    ONZ,
    OPEN,
    OPENX,
    OPENY,
    OX,
    OY,
    OZ,
    PX,
    PY,
    PZ,
    SCENERY,
    SHARE,
    T0,
    T1,
    T2,
    T3,
    T4,
    T5,
    T6,
    T7,
)  # fmt: skip
from viewsphere.engines.raster.shadows.kernels_direct_light import FACING, look
from viewsphere.kernels.jit import inner, njit
from viewsphere.kernels.lanes import clamp, dot, lanewise, least, most, size, where

f4 = nb.float32
i4 = nb.int32
U = nb.uintp
_blend2, _blend8 = blend(2), blend(8)
SKY, LIGHT, WITHIN, PLACE = LX, LY, LZ, IR  # rows of a light, in use before the first light
ABOVE, BELOW = OPENX, OPENY  # OPEN and BOUNCE from one volume alone
COEFFICIENTS = 8
BEHIND = 0.02  # minimum weight of a point of the volume behind the surface
HIDDEN = 0.03  # a cell that sees a smaller share is inside a solid thing
GAIN = 1.04  # compensates for the directions that a plane's own horizon hides: each represents a wide cone of the sphere
CLEAR = 3.0  # about thirds of a height: above a target's top, its sequence misses no light of the ground
HORIZON = 0.03  # keeps the ratio from becoming noise if the surface hardly faces the sky


@njit
def see(points, views, directions, b, out):
    """Write the visible share and mean direction for each point (N, 3), above the horizon and below, into out (N, 8).

    b (ROWS * BLOCK,) is scratch.
    """
    per = f4(1.0 / directions.shape[0])
    for start in range(0, points.shape[0], BLOCK):
        count = min(BLOCK, points.shape[0] - start)
        for i in range(count):
            for k in range(3):
                b[PX + k * BLOCK + i] = points[start + i, k]
        for d in range(directions.shape[0]):
            x, y, z = directions[d, 0], directions[d, 1], directions[d, 2]
            for i in range(count):
                b[SHARE + i], b[FACING + i] = f4(1), f4(1)
            look(count, views.form, views.grid, views.depth, views.bounds, U(d), b)
            first = 0 if z > f4(0) else 4
            for i in range(count):
                share = b[SHARE + i] * per
                out[start + i, first] += share
                out[start + i, first + 1] += share * x
                out[start + i, first + 2] += share * y
                out[start + i, first + 3] += share * z


@lanewise
def _turn(pose, b):
    """The samples' positions and normals in the axes of baking."""
    place, normal = b.get(PX, PY, PZ), b.get(NX, NY, NZ)
    rows = [tuple(pose.one(4 * k + i) for i in range(3)) for k in range(3)]
    b.put((OX, OY, OZ), tuple(dot(place, row) + pose.one(4 * k + 3) for k, row in enumerate(rows)))
    b.put((ONX, ONY, ONZ), tuple(dot(normal, row) for row in rows))


@inner
def _bound(count, b):
    """The box around all samples of a block: lowest and highest x, y, z."""
    x, y, z = (f4(np.inf), f4(-np.inf)), (f4(np.inf), f4(-np.inf)), (f4(np.inf), f4(-np.inf))
    for i in range(count):
        x = min(x[0], b[PX + i]), max(x[1], b[PX + i])
        y = min(y[0], b[PY + i]), max(y[1], b[PY + i])
        z = min(z[0], b[PZ + i]), max(z[1], b[PZ + i])
    return x, y, z


@inner
def _is_beyond(box, reach, is_ground):
    """Return whether a block's box is outside of a reach (6,): lowest and highest x, y, z. The ground is in reach at any
    depth.
    """
    (x0, x1), (y0, y1), (z0, z1) = box
    is_beside = x1 < reach[0] or x0 > reach[1] or y1 < reach[2] or y0 > reach[3]
    return is_beside or (not is_ground and (z1 < reach[4] or z0 > reach[5]))


@lanewise
def _place_on_floor(frame, across, b):
    """T0: 1 more than the index of the first of four cells, 0 beyond the map; T1 to T4: weights. `across`: cells a row."""
    # A wall is lit by the ground in front of it, not by the ground beneath it.
    u = (b[OX] - frame.one(1)) * frame.one(0) + b[ONX] - 0.5
    v = (b[OY] - frame.one(2)) * frame.one(0) + b[ONY] - 0.5
    is_within = (u >= 0) & (v >= 0) & (u < across - 1) & (v < across - 1)
    u, v = where(is_within, u, 0), where(is_within, v, 0)
    column, row = u.whole().real(), v.whole().real()
    fu, fv = u - column, v - row
    right = fu * fv
    b[T0] = where(is_within, row * across + column + 1, 0)
    b.put((T1, T2, T3, T4), (1 - fu - fv + right, fu - right, fv - right, right))
    b[SKY], b[LIGHT] = 1, 1


@inner
def _read_floor(count, floor, frame, b):
    """SKY and LIGHT: both shares of the ground's map at each sample, from four cells; 1 beyond the map."""
    across = U(floor.shape[0])
    _place_on_floor(count, frame, f4(across), b)
    for i in range(count):
        if b[T0 + i] > f4(0):
            p = U(i4(b[T0 + i])) - U(1)
            q = p + across
            weights = b[T1 + i], b[T2 + i], b[T3 + i], b[T4 + i]
            _blend2(floor, (p, p + U(1), q, q + U(1)), weights, b, U(SKY) + U(i))


@lanewise
def _place_in_volume(frame, columns, rows, layers, b):
    """PLACE: the first of the eight points of the volume around a place slightly off the surface; T0 to T7: their weights.

    WITHIN: the depth of that place inside the volume, 0..1.
    """
    normal, cells, push = b.get(ONX, ONY, ONZ), frame.one(3), frame.one(4)
    own = [(b[OX + k * BLOCK] - frame.one(k)) * cells for k in range(3)]
    place = [at + n * push for at, n in zip(own, normal, strict=True)]
    near = [least(at, points - 1 - at) for at, points in zip(place, (columns, rows, layers), strict=True)]
    is_within = (near[0] > 0) & (near[1] > 0) & (near[2] > 0)
    b[WITHIN] = where(is_within, least(least(least(near[0], near[1]), near[2]) * 0.5, 1), 0)
    # NaN is placed at the first point.
    place = [where(is_within, at, 0) for at in place]
    first = [at.whole().real() for at in place]
    part = [at - low for at, low in zip(place, first, strict=True)]
    b[PLACE] = (first[2] * rows + first[1]) * columns + first[0]
    off = dot([low - at for low, at in zip(first, own, strict=True)], normal)
    shares = []
    for k in range(8):
        share, before = None, off
        for axis in range(3):
            is_next = k >> axis & 1
            near_by = part[axis] if is_next else 1 - part[axis]
            share = near_by if share is None else share * near_by
            before = before + normal[axis] if is_next else before
        # A point behind the surface has a different view from the surface.
        shares.append(share * least(most(before, BEHIND), 1))
    scale = 1 / most(sum(shares[1:], shares[0]), 1e-6)
    b.put((T0, T1, T2, T3, T4, T5, T6, T7), [share * scale for share in shares])


@inner
def _read_volume(count, volume, grid, frame, b):
    """The volume's coefficients into T0..T7, read slightly off each sample's surface, from points in front of it."""
    first, layers, rows, columns = U(grid[0]), U(grid[1]), U(grid[2]), U(grid[3])
    _place_in_volume(count, frame, f4(columns), f4(rows), f4(layers), b)
    for i in range(count):
        p = first + U(i4(b[PLACE + i]))
        q, r = p + columns, p + rows * columns
        s = r + columns
        near, far = (b[T0 + i], b[T1 + i], b[T2 + i], b[T3 + i]), (b[T4 + i], b[T5 + i], b[T6 + i], b[T7 + i])
        _blend8(volume, (p, p + U(1), q, q + U(1), r, r + U(1), s, s + U(1)), (*near, *far), b, U(T0) + U(i))


@lanewise
def _shares(has_ground, b):
    """ABOVE and BELOW from the volume's coefficients."""
    normal, within = b.get(ONX, ONY, ONZ), b[WITHIN]
    up = b[T0] + 2 * dot(b.get(T1, T2, T3), normal)
    down = b[T4] + 2 * dot(b.get(T5, T6, T7), normal)
    whole = clamp((up + down) * GAIN)
    for row, part, facing in ((ABOVE, up, normal[2]), (BELOW, down, -normal[2])):
        share = clamp((part * GAIN + HORIZON) / (0.5 + 0.5 * facing + HORIZON))
        b[row] = 1 + (whole + (share - whole) * has_ground - 1) * within


@lanewise
def _near_floor(frame, b):
    """Reduce the light from the ground beside the targets; scenery that serves as this ground is darkened like the ground."""
    height = (b[OZ] - frame.one(3)) / (0.35 * frame.one(4))
    light, sky, above = b[LIGHT], b[SKY], b[ABOVE]
    lost = b[BELOW] * (1 - (light + (1 - light) * 0.6 * clamp(height)))
    b[BELOW] = b[BELOW] * (light + (1 - light) * 0.6 * clamp(height)) + lost * frame.one(6) * clamp(height - CLEAR)
    # Scenery that faces up at about the height of the targets' lowest point serves as their ground.
    close = most(1 - size(height), 0) * most(b[ONZ], 0) * b[SCENERY]
    b[ABOVE] = above + (least(above, sky) - above) * close


@lanewise
def _fill(is_floor, b):
    b[ABOVE] = where(is_floor > 0, b[SKY], 1)
    b[BELOW] = 1


@lanewise
def _begin(b):
    b[OPEN], b[BOUNCE] = 1, 1


@lanewise
def _take(b):
    b[OPEN], b[BOUNCE] = b[OPEN] * b[ABOVE], b[BOUNCE] * b[BELOW]


@lanewise
def _darken(b):
    b[OPEN], b[BOUNCE] = b[OPEN] * b[AO], b[BOUNCE] * b[AO]


@inner
def _hide(count, occlusion, k, is_ground, b):
    """ABOVE and BELOW: the shares that volume and map k leave."""
    grounded = occlusion.floor_frame[k, U(5)] > f4(0)
    _turn(count, occlusion.pose[k], b)
    if grounded:
        _read_floor(count, occlusion.floor[k], occlusion.floor_frame[k], b)
    if occlusion.frame[k, U(5)] > f4(0) and not is_ground:
        _read_volume(count, occlusion.volume, occlusion.grid[k], occlusion.frame[k], b)
        _shares(count, occlusion.frame[k, U(6)], b)
    else:
        _fill(count, f4(is_ground and grounded), b)
    if grounded and not is_ground:
        _near_floor(count, occlusion.floor_frame[k], b)


@inner
def occlude(count, occlusion, b):
    """Fill OPEN and BOUNCE of a block of samples, either all on the ground or none (see row GROUND of the first sample).

    With a ground, OPEN is the share of the cosine-weighted upper sky, and BOUNCE that of the ground's light. Without one, both
    are the share of the whole hemisphere above the surface. Both include the occlusion texture (row AO).
    """
    hiders, is_ground = U(occlusion.frame.shape[0]), b[GROUND] > f4(0)
    # Bounding a block costs as much as it saves for the one volume of a still picture.
    box = _bound(count if hiders > U(1) else U(0), b)
    _begin(count, b)
    for k in range(hiders):
        if hiders == U(1) or not _is_beyond(box, occlusion.reach[k], is_ground):
            _hide(count, occlusion, k, is_ground, b)
            _take(count, b)
    _darken(count, b)
