"""The geometry of a block's samples: position, direction to the viewer, geometric and smooth normal, vertex attributes."""

from __future__ import annotations

import numba as nb
from numba.extending import intrinsic

from viewsphere.engines.raster.materials.kernels_material import L_SCENERY
from viewsphere.engines.raster.shading.kernels_block import (
    ALPHA,
    AX,
    AY,
    AZ,
    BARY1,
    BARY2,
    BLUE,
    BX,
    BY,
    BZ,
    FADE,
    GREEN,
    GX,
    GY,
    GZ,
    NX,
    NY,
    NZ,
    PIXEL,
    PX,
    PY,
    PZ,
    RED,
    SCENERY,
    SIDE,
    T0,
    T1,
    T2,
    U0,
    U1,
    UA0,
    UA1,
    V0,
    V1,
    VA0,
    VA1,
    VX,
    VY,
    VZ,
)  # fmt: skip
from viewsphere.kernels.jit import inner
from viewsphere.kernels.lanes import (
    FAST,
    clamp,
    dot,
    lanewise,
    least,
    load,
    most,
    root,
    scatter,
    sign,
    size,
    spread,
    where,
)
from viewsphere.kernels.prefetching import AHEAD, prefetch
from viewsphere.rendering.ground.horizon import BEGIN, FLAT, OVER
from viewsphere.rendering.ground.kernels_slabs import shade

f4 = nb.float32
U = nb.uintp
VERTEX = 16  # numbers
# The rows for the numbers of a vertex (see `Surfaces.vertices`): for a point of a triangle, and for its edges.
ATTRIBUTES = {0: NX, 1: NY, 2: NZ, 3: U0, 4: V0, 5: U1, 6: V1, 7: RED, 8: GREEN, 9: BLUE, 10: ALPHA}
DIFFERENCES = {3: UA0, 4: VA0, 5: UA1, 6: VA1, 11: AX, 12: AY, 13: AZ}


@inner(fastmath=FAST)
def _rays(view, count, own, b):
    """Rays in the camera's axes, not normalised, into VX, VY, VZ: ray / inverse depth is the visible point."""
    if view.rays.shape[0] > 0:
        for i in range(U(count)):
            ray = view.rays[U(own[i])]
            b[U(VX) + i], b[U(VY) + i], b[U(VZ) + i] = ray[0], ray[1], ray[2]
        return
    if view.places.shape[0] > 0:
        for i in range(U(count)):
            place = view.places[U(own[i])]
            b[U(T0) + i], b[U(T1) + i] = place[0], place[1]
    else:
        _find_centers(count, nb.intp(view.columns), f4(1) / f4(view.columns), own, b)
    _look_through_pinhole(count, view.lens, b)


@lanewise
def _find_centers(columns, per, own, b):
    """T0, T1: column and row of the pixels' centres."""
    k = own[0]
    row = (k.real() * per).whole()
    column = k - row * columns
    # A product of float32 may be one row too high or too low.
    row, column = where(column < 0, row - 1, row), where(column < 0, column + columns, column)
    is_next = column >= columns
    row, column = where(is_next, row + 1, row), where(is_next, column - columns, column)
    b[T0], b[T1] = column.real() + 0.5, row.real() + 0.5


@lanewise
def _look_through_pinhole(lens, b):
    x, y = b[T0], b[T1]
    b[VX], b[VY] = (lens.one(3 * k) * x + lens.one(3 * k + 1) * y + lens.one(3 * k + 2) for k in range(2))
    b[VZ] = 1


@inner(fastmath=FAST)
def locate(view, start, count, slots, depth, b, own):
    """Positions, directions to the viewer and pixel sizes of samples; own: the samples' slots."""
    for i in range(U(count)):
        own[i] = slots[U(start) + i]
        b[U(T2) + i] = depth[U(own[i])]
    _rays(view, count, own, b)
    _aim(count, view.eye, view.rotation, view.scale, view.pixel, b)
    if view.shifts.shape[0] > 0:
        for i in range(U(count)):
            shift = view.shifts[U(own[i])]
            b[U(PX) + i] += shift[0]
            b[U(PY) + i] += shift[1]
            b[U(PZ) + i] += shift[2]
            if view.is_parallel:
                b[U(PIXEL) + i] = view.scale * view.pixel


@lanewise
def _aim(eye, rotation, scale, pixel, b):
    """Turn the rays from the camera's axes into the world's."""
    ray = b.get(VX, VY, VZ)
    way = tuple(dot(tuple(rotation.one(3 * row + k) for row in range(3)), ray) for k in range(3))
    along = scale / b[T2]
    for k, row in enumerate((PX, PY, PZ)):
        b[row] = eye.one(k) + along * way[k]
    b[PIXEL] = along * pixel
    back = -1 / root(dot(way, way))
    b.put((VX, VY, VZ), tuple(w * back for w in way))


@intrinsic
def _differ(typing, vertices, i, j, b, at):
    """Row j of the vertices minus row i: its DIFFERENCES, to b[row + at]."""

    def code(context, builder, signature, arguments):
        rows, target = (context.make_array(signature.args[n])(context, builder, arguments[n]).data for n in (0, 3))
        first, second = (_vertex(builder, rows, row) for row in arguments[1:3])
        scatter(target, arguments[4], DIFFERENCES, second - first)
        return context.get_dummy_value()

    return nb.void(vertices, nb.uintp, nb.uintp, b, nb.uintp), code


@intrinsic
def _blend(typing, vertices, i, j, k, g, h, b, at):
    """The ATTRIBUTES of row i of the vertices, moved by g towards row j and by h towards row k, into b."""

    def code(context, builder, signature, arguments):
        rows, target = (context.make_array(signature.args[n])(context, builder, arguments[n]).data for n in (0, 6))
        p0, p1, p2 = (_vertex(builder, rows, row) for row in arguments[1:4])
        g, h = (spread(builder, share, VERTEX) for share in arguments[4:6])
        scatter(target, arguments[7], ATTRIBUTES, p0 + (p1 - p0) * g + (p2 - p0) * h)
        return context.get_dummy_value()

    return nb.void(vertices, nb.uintp, nb.uintp, nb.uintp, nb.float32, nb.float32, b, nb.uintp), code


def _vertex(builder, vertices, row):
    return load(builder, vertices, builder.mul(row, row.type(VERTEX)), VERTEX)


@inner(fastmath=FAST)
def gather(surfaces, count, triangle, b, own, material):
    """Vertex attributes, edges, materials, and normals on the viewer's side, for located samples. The samples' triangles
    replace their slots.
    """
    vertices, triangles, normals = surfaces.vertices, surfaces.triangles, surfaces.normals
    last = U(count) - U(1)
    for i in range(U(count)):
        t = U(triangle[U(own[min(i + U(AHEAD), last)])])
        for k in range(U(3)):
            prefetch(vertices, U(VERTEX) * U(triangles[t, k]))
        t = U(triangle[U(own[i])])
        own[i], m = t, surfaces.material[t]
        material[i] = m
        first = U(triangles[t, U(0)])
        _differ(vertices, first, U(triangles[t, U(1)]), b, i)
        _differ(vertices, first, U(triangles[t, U(2)]), b, i + U(BX - AX))
        corner, normal = vertices[first], normals[t]
        b[U(T0) + i], b[U(T1) + i], b[U(T2) + i] = corner[11], corner[12], corner[13]
        b[U(GX) + i], b[U(GY) + i], b[U(GZ) + i] = normal[0], normal[1], normal[2]
        b[U(SCENERY) + i] = surfaces.looks[U(m), U(L_SCENERY)]
    _find(count, b)
    for i in range(U(count)):
        t = U(own[i])
        g, h = b[U(BARY1) + i], b[U(BARY2) + i]
        _blend(vertices, U(triangles[t, U(0)]), U(triangles[t, U(1)]), U(triangles[t, U(2)]), g, h, b, i)
    _face_viewer(count, b)


@lanewise
def _find(b):
    """Barycentric coordinates of the samples' positions in their triangles."""
    first, second = b.get(AX, AY, AZ), b.get(BX, BY, BZ)
    place = tuple(b[row] - b[corner] for row, corner in ((PX, T0), (PY, T1), (PZ, T2)))
    aa, ac, cc = dot(first, first), dot(first, second), dot(second, second)
    qa, qc = dot(place, first), dot(place, second)
    scale = 1 / most(aa * cc - ac * ac, 1e-30)
    g = clamp((cc * qa - ac * qc) * scale)
    b[BARY1], b[BARY2] = g, least(most((aa * qc - ac * qa) * scale, 0), 1 - g)
    b[FADE] = 0


@lanewise
def _face_viewer(b):
    """Turn both normals to the visible side, for either winding; the smooth one faces the viewer at least slightly."""
    g, n = b.get(GX, GY, GZ), b.get(NX, NY, NZ)
    side = sign(dot(g, b.get(VX, VY, VZ)))
    g = tuple(x * side for x in g)
    side = sign(dot(n, g))
    b[SIDE] = side
    n = tuple(x * side + 1e-4 * w for x, w in zip(n, g, strict=True))
    scale = 1 / root(dot(n, n) + 1e-20)
    b.put((GX, GY, GZ), g)
    b.put((NX, NY, NZ), tuple(x * scale for x in n))


@inner(fastmath=FAST)
def gather_ground(view, floor, count, b, material):
    """The equivalent of `gather` for samples of the ground: its texture repeats in the world, and fades into the sky far behind
    all things.

    floor: see `painting.Baked`.
    """
    own = nb.int32(floor[3])
    for i in range(U(count)):
        material[i] = own
    _stand(count, view.eye, floor, b)
    if floor[12] > f4(0):
        _lay_slabs(count, floor, b)


@lanewise
def _stand(eye, floor, b):
    """Fill the rows of samples on the ground."""
    side = sign(b[VZ])
    for row in (NX, NY, GX, GY, U1, V1, BARY1, BARY2):
        b[row] = 0
    for row in (RED, GREEN, BLUE, ALPHA):
        b[row] = 1
    b[NZ], b[GZ] = side, side
    per, place, origin = floor.one(0), b.get(PX, PY, PZ), tuple(eye.one(k) for k in range(3))
    b[U0], b[V0] = place[0] * per + floor.one(1), floor.one(2) - place[1] * per
    way = tuple(place[k] - origin[k] for k in range(3))
    middle = tuple(origin[k] - floor.one(8 + k) for k in range(3))
    behind = (root(dot(way, way)) - root(dot(middle, middle))) * floor.one(11)
    far = 1 - clamp((behind - BEGIN) * (1 / OVER))
    far = 1 - far * far
    low = clamp((FLAT - size(b[VZ])) * (1 / FLAT))
    b[FADE] = 1 - (1 - far * far * (3 - far - far)) * (1 - low * low * (3 - low - low))


@lanewise
def _lay_slabs(floor, b):
    """The slabs' shade, filtered over the mean of both axes of the ellipse that a pixel covers."""
    slabs = floor.one(12)
    pixel = b[PIXEL] * floor.one(0) * slabs / root(most(size(b[VZ]), 1e-4))
    tone = shade(b[U0] * slabs, b[V0] * slabs, pixel)
    b.put((RED, GREEN, BLUE), (tone, tone, tone))
