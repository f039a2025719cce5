"""Four samples at once in vector registers: the sums are bitwise the same as for single samples."""

from __future__ import annotations

from typing import Any

import numba as nb
from llvmlite import ir
from numba.extending import intrinsic

from viewsphere.truth.kernel_constants import FOUR, NEARER

_REAL, _WHOLE, _FLAGS = ir.DoubleType(), ir.IntType(32), ir.IntType(FOUR)
_REALS, _WHOLES = ir.VectorType(_REAL, FOUR), ir.VectorType(_WHOLE, FOUR)
_EDGES = nb.types.UniTuple(nb.float64, 3)


def _spread(builder: Any, value: Any) -> Any:
    """One number copied to all lanes."""
    one = builder.insert_element(ir.Constant(ir.VectorType(value.type, FOUR), ir.Undefined), value, _WHOLE(0))
    return builder.shuffle_vector(one, one, ir.Constant(_WHOLES, [0] * FOUR))


def _from(context: Any, builder: Any, kind: Any, array: Any, at: Any, lanes: Any) -> Any:
    """The pointer to the lanes of an array from this flat index on."""
    data = context.make_array(kind)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [at]), lanes.as_pointer())


@intrinsic
def shows_farther(typing: Any, nearest: Any, at: Any, most: Any) -> Any:
    """Return whether one of the samples from flat index `at` on is farther than 1/z = `most`."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data, at, most = arguments
        shown = builder.load(_from(context, builder, signature.args[0], data, at, _REALS), align=8)
        flags = builder.fcmp_ordered("<", shown, _spread(builder, most))
        return builder.icmp_unsigned("!=", builder.bitcast(flags, _FLAGS), _FLAGS(0))

    return nb.boolean(nearest, at, nb.float64), code


@intrinsic
def draw_four(
    typing: Any, nearest: Any, seen: Any, at: Any, t: Any, first: Any, step: Any, e: Any, f: Any, n: Any, s: Any
) -> Any:
    """Write triangle t to each of four samples that is inside it and nearer; the samples begin at flat index `at`.

    Sample i is at (first + i) step along the row. It is inside if e x + f is not negative for all three edges; its 1/z, n x +
    s, must exceed the 1/z shown so far times NEARER.
    """

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        nearest, seen, at, t, first, step, e, f, n, s = arguments
        place = _from(context, builder, signature.args[0], nearest, at, _REALS)
        owner = _from(context, builder, signature.args[1], seen, at, _WHOLES)
        order = ir.Constant(_REALS, [float(i) for i in range(FOUR)])
        x = builder.fmul(builder.fadd(_spread(builder, first), order), _spread(builder, step))

        def line(slope: Any, offset: Any) -> Any:
            return builder.fadd(builder.fmul(_spread(builder, slope), x), _spread(builder, offset))

        shown, inverse = builder.load(place, align=8), line(n, s)
        flags = builder.fcmp_ordered(">", inverse, builder.fmul(shown, ir.Constant(_REALS, [NEARER] * FOUR)))
        for i in range(3):
            value = line(builder.extract_value(e, i), builder.extract_value(f, i))
            flags = builder.and_(flags, builder.fcmp_ordered(">=", value, ir.Constant(_REALS, [0.0] * FOUR)))
        number = _spread(builder, builder.trunc(t, _WHOLE))
        builder.store(builder.select(flags, inverse, shown), place, align=8)
        builder.store(builder.select(flags, number, builder.load(owner, align=4)), owner, align=4)
        return context.get_dummy_value()

    return nb.void(nearest, seen, at, nb.intp, nb.float64, nb.float64, _EDGES, _EDGES, nb.float64, nb.float64), code


@intrinsic
def draw_four_deep(
    typing: Any, nearest: Any, seen: Any, at: Any, t: Any, first: Any, step: Any, e: Any, f: Any, plane: Any, bounds: Any
) -> Any:
    """`draw_four` along parallel rays: `nearest` is z, which is a (x - u) + s for the plane (a, u, s), within the bounds.

    A sample's z must be above 0 and, times NEARER, less than the z shown so far.
    """

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        nearest, seen, at, t, first, step, e, f, plane, bounds = arguments
        place = _from(context, builder, signature.args[0], nearest, at, _REALS)
        owner = _from(context, builder, signature.args[1], seen, at, _WHOLES)
        order = ir.Constant(_REALS, [float(i) for i in range(FOUR)])
        x = builder.fmul(builder.fadd(_spread(builder, first), order), _spread(builder, step))
        slope, begin, offset, low, high = (
            _spread(builder, builder.extract_value(*part))
            for part in ((plane, 0), (plane, 1), (plane, 2), (bounds, 0), (bounds, 1))
        )
        z = builder.fadd(builder.fmul(slope, builder.fsub(x, begin)), offset)
        z = builder.select(builder.fcmp_ordered("<", z, low), low, z)
        z = builder.select(builder.fcmp_ordered(">", z, high), high, z)
        shown, zero = builder.load(place, align=8), ir.Constant(_REALS, [0.0] * FOUR)
        flags = builder.fcmp_ordered("<", builder.fmul(z, ir.Constant(_REALS, [NEARER] * FOUR)), shown)
        flags = builder.and_(flags, builder.fcmp_ordered(">", z, zero))
        for i in range(3):
            slope, offset = _spread(builder, builder.extract_value(e, i)), _spread(builder, builder.extract_value(f, i))
            flags = builder.and_(flags, builder.fcmp_ordered(">=", builder.fadd(builder.fmul(slope, x), offset), zero))
        number = _spread(builder, builder.trunc(t, _WHOLE))
        builder.store(builder.select(flags, z, shown), place, align=8)
        builder.store(builder.select(flags, number, builder.load(owner, align=4)), owner, align=4)
        return context.get_dummy_value()

    pair = nb.types.UniTuple(nb.float64, 2)
    return nb.void(nearest, seen, at, nb.intp, nb.float64, nb.float64, _EDGES, _EDGES, _EDGES, pair), code


@intrinsic
def meet_four(
    typing: Any, x: Any, y: Any, nearest: Any, met: Any, own: Any, at: Any, t: Any, e0: Any, e1: Any, e2: Any, n: Any
) -> Any:
    """Record triangle t for each of four points that is inside it, behind it, and not its own; the points begin at index `at`.

    A point (x, y) is inside if e . (x, y, 1) is not negative for all three edges; its 1/z there, n . (x, y, 1), must exceed the
    1/z met so far times NEARER.
    """

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        x, y, nearest, met, own, at, t, e0, e1, e2, n = arguments
        kinds = signature.args

        def load(argument: int, array: Any, lanes: Any) -> tuple[Any, Any]:
            place = _from(context, builder, kinds[argument], array, at, lanes)
            return place, builder.load(place, align=4 if lanes is _WHOLES else 8)

        (_, u), (_, v), (farther, shown) = load(0, x, _REALS), load(1, y, _REALS), load(2, nearest, _REALS)

        def line(e: Any) -> Any:
            a, b, c = (_spread(builder, builder.extract_value(e, i)) for i in range(3))
            return builder.fadd(builder.fmul(a, u), builder.fadd(builder.fmul(b, v), c))

        inverse, number = line(n), _spread(builder, builder.trunc(t, _WHOLE))
        flags = builder.fcmp_ordered(">", inverse, builder.fmul(shown, ir.Constant(_REALS, [NEARER] * FOUR)))
        for e in (e0, e1, e2):
            flags = builder.and_(flags, builder.fcmp_ordered(">=", line(e), ir.Constant(_REALS, [0.0] * FOUR)))
        flags = builder.and_(flags, builder.icmp_signed("!=", load(4, own, _WHOLES)[1], number))
        with builder.if_then(builder.icmp_unsigned("!=", builder.bitcast(flags, _FLAGS), _FLAGS(0)), likely=False):
            place, before = load(3, met, _WHOLES)
            builder.store(builder.select(flags, inverse, shown), farther, align=8)
            builder.store(builder.select(flags, number, before), place, align=4)
        return context.get_dummy_value()

    return nb.void(x, y, nearest, met, own, nb.intp, nb.intp, _EDGES, _EDGES, _EDGES, _EDGES), code


@intrinsic
def draw_four_along(
    typing: Any, nearest: Any, seen: Any, at: Any, rays: Any, ray: Any, t: Any, e0: Any, e1: Any, e2: Any, n: Any
) -> Any:
    """Write triangle t to each of four pixels whose ray is inside it and meets it nearer; the pixels begin at flat index `at`,
    the coordinates of their rays at flat index `ray`.

    A ray d is inside if e . d is not negative for all three edges; its 1/s, n . d, must exceed the 1/s shown so far times
    NEARER.
    """

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        nearest, seen, at, rays, ray, t, e0, e1, e2, n = arguments
        place = _from(context, builder, signature.args[0], nearest, at, _REALS)
        x, y, z = _coordinates(context, builder, signature.args[3], rays, ray)

        def along(e: Any) -> Any:
            a, b, c = (_spread(builder, builder.extract_value(e, i)) for i in range(3))
            return builder.fadd(builder.fmul(a, x), builder.fadd(builder.fmul(b, y), builder.fmul(c, z)))

        shown, inverse = builder.load(place, align=8), along(n)
        flags = builder.fcmp_ordered(">", inverse, builder.fmul(shown, ir.Constant(_REALS, [NEARER] * FOUR)))
        for e in (e0, e1, e2):
            flags = builder.and_(flags, builder.fcmp_ordered(">=", along(e), ir.Constant(_REALS, [0.0] * FOUR)))
        with builder.if_then(builder.icmp_unsigned("!=", builder.bitcast(flags, _FLAGS), _FLAGS(0))):
            owner = _from(context, builder, signature.args[1], seen, at, _WHOLES)
            number = _spread(builder, builder.trunc(t, _WHOLE))
            builder.store(builder.select(flags, inverse, shown), place, align=8)
            builder.store(builder.select(flags, number, builder.load(owner, align=4)), owner, align=4)
        return context.get_dummy_value()

    return nb.void(nearest, seen, at, rays, ray, nb.intp, _EDGES, _EDGES, _EDGES, _EDGES), code


def _coordinates(context: Any, builder: Any, kind: Any, rays: Any, at: Any) -> tuple[Any, Any, Any]:
    """The x, y and z of four rays, whose twelve numbers begin at this flat index."""
    parts = [
        builder.load(_from(context, builder, kind, rays, builder.add(at, at.type(FOUR * i)), _REALS), align=8) for i in range(3)
    ]
    first = builder.shuffle_vector(parts[0], parts[1], ir.Constant(ir.VectorType(_WHOLE, 8), list(range(8))))
    last = builder.shuffle_vector(parts[2], parts[2], ir.Constant(ir.VectorType(_WHOLE, 8), list(range(8))))

    def every_third(begin: int) -> Any:
        return builder.shuffle_vector(first, last, ir.Constant(_WHOLES, list(range(begin, 12, 3))))

    return every_third(0), every_third(1), every_third(2)
