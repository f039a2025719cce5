"""A pixel's four samples side by side in one vector register, as functions that kernels call: exact, without fastmath.

Written as LLVM instructions, since numba splits four numbers into four scalars, and takes long to compile them.
"""

from __future__ import annotations

from functools import reduce
from typing import Any

import numba as nb
from llvmlite import ir
from numba.core import cgutils
from numba.extending import intrinsic

from viewsphere.truth.raster.kernels_rays import ABOVE

FOUR = 4
_WHOLE = ir.IntType(32)


@intrinsic
def cover(typing: Any, edges: Any, plane: Any, bounds: Any, box: Any, offsets: Any, limit: Any, found: Any) -> Any:
    """List the pixels of a box that have a sample at which a triangle is nearer than `limit`; return their number.

    edges: three times coefficients (a, b, c), a x + b y + c >= 0 inside; plane: coefficients of 1/z, which stays within
    `bounds`; box: first column and row, last column and row; offsets (2, 4) float64; limit (H, W) float32 1/z. The list
    `found`, with room for one pixel more than the box has: places (n,) uint32, row << 16 | column; the samples inside (n,)
    uint8, as one bit for each; 1/z at all samples (n, 4) float32. A row of pixels has no branch: branches were mispredicted.
    """
    kind = nb.uintp(edges, plane, bounds, box, offsets, limit, found)

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        edges, plane, bounds, box, offsets, limit, found = arguments
        parts = [cgutils.unpack_tuple(builder, e, 3) for e in (*cgutils.unpack_tuple(builder, edges, 3), plane)]
        rows = [[_all(builder, value) for value in part] for part in parts]
        within = [_all(builder, value) for value in cgutils.unpack_tuple(builder, bounds, 2)]
        places = _data(context, builder, kind.args[4], offsets)
        limits = context.make_array(kind.args[5])(context, builder, limit)
        width = cgutils.unpack_tuple(builder, limits.shape, 2)[1]
        arrays = [
            _data(context, builder, of, array)
            for of, array in zip(kind.args[6], cgutils.unpack_tuple(builder, found, 3), strict=True)
        ]
        xa, ya, xb, yb = cgutils.unpack_tuple(builder, box, 4)
        one, count = xa.type(1), cgutils.alloca_once_value(builder, xa.type(0))
        with cgutils.for_range_slice(builder, ya, builder.add(yb, one), one) as (y, _):
            py = _beside(builder, y, places, FOUR)
            level = [builder.fadd(builder.fmul(row[1], py), row[2]) for row in rows]
            first = builder.mul(y, width)
            with cgutils.for_range_slice(builder, xa, builder.add(xb, one), one) as (x, _):
                px = _beside(builder, x, places, 0)
                values = [builder.fadd(builder.fmul(row[0], px), f) for row, f in zip(rows, level, strict=True)]
                inside, z = _sample(builder, values, within)
                reach = _all(builder, builder.load(builder.gep(limits.data, [builder.add(first, x)])))
                before = builder.bitcast(builder.and_(inside, builder.fcmp_ordered(">", z, reach)), ir.IntType(FOUR))
                n = builder.load(count)
                place = builder.trunc(builder.or_(builder.shl(y, y.type(16)), x), _WHOLE)
                builder.store(place, builder.gep(arrays[0], [n]))
                flags = builder.zext(builder.bitcast(inside, ir.IntType(FOUR)), ir.IntType(8))
                builder.store(flags, builder.gep(arrays[1], [n]))
                _store(builder, z, arrays[2], builder.mul(n, n.type(FOUR)))
                is_found = builder.zext(builder.icmp_unsigned("!=", before, before.type(0)), n.type)
                builder.store(builder.add(n, is_found), count)
        return builder.load(count)

    return kind, code


@intrinsic
def inside(typing: Any, edges: Any, plane: Any, bounds: Any, x: Any, y: Any, offsets: Any, inverse: Any, row: Any) -> Any:
    """Return the samples of the pixel at (x, y) that are inside a triangle, as one bit for each sample. Fill inverse[row]
    (n, 4) with 1/z at all of them. The other arguments are those of `cover`.
    """
    kind = nb.uint8(edges, plane, bounds, x, y, offsets, inverse, row)

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        edges, plane, bounds, x, y, offsets, inverse, row = arguments
        parts = [cgutils.unpack_tuple(builder, e, 3) for e in (*cgutils.unpack_tuple(builder, edges, 3), plane)]
        within = [_all(builder, value) for value in cgutils.unpack_tuple(builder, bounds, 2)]
        places = _data(context, builder, kind.args[5], offsets)
        px, py = _beside(builder, x, places, 0), _beside(builder, y, places, FOUR)
        values = [
            builder.fadd(builder.fmul(_all(builder, a), px), builder.fadd(builder.fmul(_all(builder, b), py), _all(builder, c)))
            for a, b, c in parts
        ]
        flags, z = _sample(builder, values, within)
        _store(builder, z, _data(context, builder, kind.args[6], inverse), builder.mul(row, row.type(FOUR)))
        return builder.zext(builder.bitcast(flags, ir.IntType(FOUR)), ir.IntType(8))

    return kind, code


@intrinsic
def covered(typing: Any, edges: Any, slope: Any, bounds: Any, x: Any, y: Any, offsets: Any, nearest: Any, row: Any) -> Any:
    """Return the samples of the pixel at (x, y) at which no edge function is negative, and at which the triangle is hardly
    behind 1/z = nearest[row] (n, 4): one bit for each sample.

    slope and bounds are those of `kernels_parallel.depth_at`; the other arguments are those of `cover`.
    """
    kind = nb.uint8(edges, slope, bounds, x, y, offsets, nearest, row)

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        edges, slope, bounds, x, y, offsets, nearest, row = arguments
        places = _data(context, builder, kind.args[5], offsets)
        px, py = _beside(builder, x, places, 0), _beside(builder, y, places, FOUR)

        def value(a: Any, b: Any, c: Any) -> Any:
            return builder.fadd(builder.fmul(a, px), builder.fadd(builder.fmul(b, py), c))

        a, b, z0, u0, v0 = (_all(builder, part) for part in cgutils.unpack_tuple(builder, slope, 5))
        z = builder.fadd(builder.fmul(b, builder.fsub(py, v0)), z0)
        z = builder.fadd(builder.fmul(a, builder.fsub(px, u0)), z)
        low, high = (_all(builder, part) for part in cgutils.unpack_tuple(builder, bounds, 2))
        z = builder.select(builder.fcmp_ordered("<", z, low), low, z)
        z = builder.select(builder.fcmp_ordered(">", z, high), high, z)
        before = _load(builder, _data(context, builder, kind.args[6], nearest), builder.mul(row, row.type(FOUR)))
        times = builder.fmul(z, before)
        is_near = builder.fcmp_ordered("<=", times, ir.Constant(times.type, [ABOVE] * FOUR))
        return _not_negative(builder, edges, value, [is_near])

    return kind, code


@intrinsic
def along(typing: Any, edges: Any, plane: Any, rays: Any, nearest: Any, row: Any) -> Any:
    """Return the rays d of rays[row] (n, 3, 4) at which no edge function e . d is negative, and at which plane . d is not less
    than nearest[row] (n, 4): one bit for each ray.
    """
    kind = nb.uint8(edges, plane, rays, nearest, row)

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        edges, plane, rays, nearest, row = arguments
        data, four = _data(context, builder, kind.args[2], rays), row.type(FOUR)
        first = builder.mul(row, row.type(3 * FOUR))
        dx, dy, dz = (_load(builder, data, builder.add(first, first.type(FOUR * i))) for i in range(3))

        def product(a: Any, b: Any, c: Any) -> Any:
            return builder.fadd(builder.fmul(a, dx), builder.fadd(builder.fmul(b, dy), builder.fmul(c, dz)))

        before = _load(builder, _data(context, builder, kind.args[3], nearest), builder.mul(row, four))
        inverse = product(*(_all(builder, part) for part in cgutils.unpack_tuple(builder, plane, 3)))
        return _not_negative(builder, edges, product, [builder.fcmp_ordered(">=", inverse, before)])

    return kind, code


@intrinsic
def nearer(typing: Any, inverse: Any, at: Any, nearest: Any, row: Any) -> Any:
    """Return the samples at which inverse[at] is greater than nearest[row], both (n, 4), as one bit for each sample."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        inverse, at, nearest, row = arguments
        z, before = (
            _load(builder, _data(context, builder, kind, array), builder.mul(index, index.type(FOUR)))
            for kind, array, index in ((signature.args[0], inverse, at), (signature.args[2], nearest, row))
        )
        return builder.zext(builder.bitcast(builder.fcmp_ordered(">", z, before), ir.IntType(FOUR)), ir.IntType(64))

    return nb.intp(inverse, at, nearest, row), code


@intrinsic
def put_before(typing: Any, found: Any, inverse: Any, place: Any, index: Any, nearest: Any, seen: Any, row: Any) -> Any:
    """Write inverse[place] and `index` into nearest[row] and seen[row] for each bit set in `found`; return the row's minimum
    1/z.
    """
    kind = nb.float32(found, inverse, place, index, nearest, seen, row)

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        found, inverse, place, index, nearest, seen, row = arguments
        flags = builder.bitcast(builder.trunc(found, ir.IntType(FOUR)), ir.VectorType(ir.IntType(1), FOUR))
        at = builder.mul(row, row.type(FOUR))
        own = _data(context, builder, kind.args[1], inverse)
        new = _load(builder, own, builder.mul(place, place.type(FOUR))), _all(builder, index)
        arrays = _data(context, builder, kind.args[4], nearest), _data(context, builder, kind.args[5], seen)
        chosen = [builder.select(flags, n, _load(builder, data, at)) for n, data in zip(new, arrays, strict=True)]
        for value, data in zip(chosen, arrays, strict=True):
            _store(builder, value, data, at)
        least = builder.extract_element(chosen[0], _WHOLE(0))
        for i in range(1, FOUR):
            other = builder.extract_element(chosen[0], _WHOLE(i))
            least = builder.select(builder.fcmp_ordered("<", other, least), other, least)
        return least

    return kind, code


def _beside(builder: Any, pixel: Any, offsets: Any, first: int) -> Any:
    """One coordinate of a pixel's four samples; `first` is its first offset."""
    at = builder.sitofp(pixel, ir.DoubleType()) if isinstance(pixel.type, ir.IntType) else pixel
    return builder.fadd(_all(builder, at), _load(builder, offsets, _WHOLE(first)))


def _sample(builder: Any, values: Any, bounds: Any) -> tuple[Any, Any]:
    """Flags of the samples at which no edge function is negative, and 1/z, the last value, as float32 within the bounds."""
    *edges, z = values
    z = builder.select(builder.fcmp_ordered(">", z, bounds[0]), z, bounds[0])
    z = builder.select(builder.fcmp_ordered("<", z, bounds[1]), z, bounds[1])
    flags = [builder.fcmp_ordered(">=", value, ir.Constant(value.type, [0.0] * FOUR)) for value in edges]
    return reduce(builder.and_, flags), builder.fptrunc(z, ir.VectorType(ir.FloatType(), FOUR))


def _not_negative(builder: Any, edges: Any, value: Any, flags: list[Any]) -> Any:
    """Bits of the lanes with all these flags in which `value`, of an edge's three coefficients, is not negative for any of the
    edges.
    """
    for edge in cgutils.unpack_tuple(builder, edges, 3):
        v = value(*(_all(builder, part) for part in cgutils.unpack_tuple(builder, edge, 3)))
        flags.append(builder.fcmp_ordered(">=", v, ir.Constant(v.type, [0.0] * FOUR)))
    return builder.zext(builder.bitcast(reduce(builder.and_, flags), ir.IntType(FOUR)), ir.IntType(8))


def _data(context: Any, builder: Any, kind: Any, array: Any) -> Any:
    return context.make_array(kind)(context, builder, array).data


def _all(builder: Any, value: Any) -> Any:
    """A number in all four lanes."""
    first = builder.insert_element(ir.Constant(ir.VectorType(value.type, FOUR), ir.Undefined), value, _WHOLE(0))
    return builder.shuffle_vector(first, first, ir.Constant(ir.VectorType(_WHOLE, FOUR), [0] * FOUR))


def _pointer(builder: Any, data: Any, at: Any) -> Any:
    return builder.bitcast(builder.gep(data, [at]), ir.VectorType(data.type.pointee, FOUR).as_pointer())


def _load(builder: Any, data: Any, at: Any) -> Any:
    return builder.load(_pointer(builder, data, at), align=4)


def _store(builder: Any, value: Any, data: Any, at: Any) -> None:
    builder.store(value, _pointer(builder, data, at), align=4)
