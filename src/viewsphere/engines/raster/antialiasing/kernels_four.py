"""A pixel's four samples side by side in one vector register, as functions that kernels call: exact, without fastmath.

Written as LLVM instructions, since numba splits four numbers into four scalars, and takes long to compile them.
"""

from __future__ import annotations

from typing import Any

import numba as nb
from llvmlite import ir
from numba.core import cgutils
from numba.extending import intrinsic

FOUR = 4
_WHOLE = ir.IntType(32)


@intrinsic
def nearer(
    typing: Any, edges: Any, plane: Any, bounds: Any, x: Any, y: Any, offsets: Any, nearest: Any, row: Any, inverse: Any
) -> Any:
    """Return the samples of the pixel at (x, y) at which a triangle covers nearest[row], as one bit for each sample.

    edges: three times coefficients (a, b, c), a x + b y + c >= 0 inside; plane: coefficients of 1/z, which stays within
    `bounds`; offsets (2, 4) float64; inverse (4,) float32 is filled with 1/z at all samples.
    """
    kind = nb.intp(edges, plane, bounds, x, y, offsets, nearest, row, inverse)

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        edges, plane, bounds, x, y, offsets, nearest, row, inverse = arguments
        parts = [cgutils.unpack_tuple(builder, e, 3) for e in (*cgutils.unpack_tuple(builder, edges, 3), plane)]
        low, high = (_all(builder, b) for b in cgutils.unpack_tuple(builder, bounds, 2))
        places = _data(context, builder, kind.args[5], offsets)
        px = builder.fadd(_all(builder, x), _load(builder, places, row.type(0)))
        py = builder.fadd(_all(builder, y), _load(builder, places, row.type(FOUR)))
        *values, z = (
            builder.fadd(builder.fmul(_all(builder, a), px), builder.fadd(builder.fmul(_all(builder, b), py), _all(builder, c)))
            for a, b, c in parts
        )
        z = builder.select(builder.fcmp_ordered(">", z, low), z, low)
        z = builder.select(builder.fcmp_ordered("<", z, high), z, high)
        z = builder.fptrunc(z, ir.VectorType(ir.FloatType(), FOUR))
        _store(builder, z, _data(context, builder, kind.args[8], inverse), row.type(0))
        before = _load(builder, _data(context, builder, kind.args[6], nearest), builder.mul(row, row.type(FOUR)))
        found = builder.fcmp_ordered(">", z, before)
        for value in values:
            found = builder.and_(found, builder.fcmp_ordered(">=", value, ir.Constant(value.type, [0.0] * FOUR)))
        return builder.zext(builder.bitcast(found, ir.IntType(FOUR)), ir.IntType(64))

    return kind, code


@intrinsic
def put_before(typing: Any, found: Any, inverse: Any, index: Any, nearest: Any, seen: Any, row: Any) -> Any:
    """Write `inverse` and `index` into nearest[row] and seen[row] for each bit set in `found`; return the row's minimum 1/z."""
    kind = nb.float32(found, inverse, index, nearest, seen, row)

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        found, inverse, index, nearest, seen, row = arguments
        flags = builder.bitcast(builder.trunc(found, ir.IntType(FOUR)), ir.VectorType(ir.IntType(1), FOUR))
        at = builder.mul(row, row.type(FOUR))
        new = (_load(builder, _data(context, builder, kind.args[1], inverse), row.type(0)), _all(builder, index))
        arrays = _data(context, builder, kind.args[3], nearest), _data(context, builder, kind.args[4], seen)
        chosen = [builder.select(flags, n, _load(builder, data, at)) for n, data in zip(new, arrays, strict=True)]
        for value, data in zip(chosen, arrays, strict=True):
            _store(builder, value, data, at)
        least = builder.extract_element(chosen[0], _WHOLE(0))
        for i in range(1, FOUR):
            other = builder.extract_element(chosen[0], _WHOLE(i))
            least = builder.select(builder.fcmp_ordered("<", other, least), other, least)
        return least

    return kind, code


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
