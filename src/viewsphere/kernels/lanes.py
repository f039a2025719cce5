"""Vector arithmetic written like scalar code, for kernels that treat all samples of a block alike.

A function decorated with `lanewise` is called from kernels like any other. Its operations become vector instructions directly:
numba need not infer their types, which takes most of a kernel's compile time, and vectorisation does not depend on heuristics.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numba as nb
from llvmlite import ir
from numba.core import cgutils
from numba.extending import intrinsic

FAST = {"contract", "arcp", "nsz", "afn", "reassoc"}
"""LLVM's fast-math flags for arithmetic on colours."""

LANES = 8
WHOLE, REAL, FLAG = ir.IntType(32), ir.FloatType(), ir.IntType(1)
_FLAGS = tuple(sorted(FAST))


class Lanes:
    """A vector of numbers: float32, int32, or the flags of a comparison. The other operand may be one number for all lanes."""

    fast = _FLAGS

    def __init__(self, builder: ir.IRBuilder, value: Any) -> None:
        self.builder = builder
        self.value = value

    @property
    def is_real(self) -> bool:
        """Return whether the lanes are float32."""
        return self.value.type.element == REAL

    def like(self, other: Any) -> Any:
        """The other operand as an LLVM value of the same type."""
        if isinstance(other, Lanes):
            return other.value
        number = float(other) if self.is_real else other
        return ir.Constant(self.value.type, [number] * self.value.type.count)

    def all(self, number: float) -> Lanes:
        """A float32 in all lanes."""
        return type(self)(self.builder, ir.Constant(self._as(REAL), [number] * self.value.type.count))

    def _do(self, real: str, whole: str, other: Any, *, swap: bool = False) -> Lanes:
        values = self.value, self.like(other)
        values = values[::-1] if swap else values
        kind = Strict if isinstance(other, Strict) else type(self)
        if self.is_real:
            return kind(self.builder, getattr(self.builder, real)(*values, flags=kind.fast))
        return kind(self.builder, getattr(self.builder, whole)(*values))

    def __add__(self, other: Any) -> Lanes:
        return self._do("fadd", "add", other)

    def __sub__(self, other: Any) -> Lanes:
        return self._do("fsub", "sub", other)

    def __mul__(self, other: Any) -> Lanes:
        return self._do("fmul", "mul", other)

    def __truediv__(self, other: Any) -> Lanes:
        return self._do("fdiv", "", other)

    def __radd__(self, other: Any) -> Lanes:
        return self._do("fadd", "add", other, swap=True)

    def __rsub__(self, other: Any) -> Lanes:
        return self._do("fsub", "sub", other, swap=True)

    def __rmul__(self, other: Any) -> Lanes:
        return self._do("fmul", "mul", other, swap=True)

    def __rtruediv__(self, other: Any) -> Lanes:
        return self._do("fdiv", "", other, swap=True)

    def __neg__(self) -> Lanes:
        return 0 - self

    def __and__(self, other: Any) -> Lanes:
        return self._do("", "and_", other)

    def __or__(self, other: Any) -> Lanes:
        return self._do("", "or_", other)

    def __xor__(self, other: Any) -> Lanes:
        return self._do("", "xor", other)

    def __rshift__(self, other: Any) -> Lanes:
        return self._do("", "ashr", other)

    def _compare(self, operator: str, other: Any) -> Lanes:
        # Ordered comparisons without fast-math flags: NaN is neither less nor equal nor greater.
        compare = self.builder.fcmp_ordered if self.is_real else self.builder.icmp_signed
        return type(self)(self.builder, compare(operator, self.value, self.like(other)))

    def __lt__(self, other: Any) -> Lanes:
        return self._compare("<", other)

    def __le__(self, other: Any) -> Lanes:
        return self._compare("<=", other)

    def __gt__(self, other: Any) -> Lanes:
        return self._compare(">", other)

    def __ge__(self, other: Any) -> Lanes:
        return self._compare(">=", other)

    def equals(self, other: Any) -> Lanes:
        """Flags where both operands are equal."""
        return self._compare("==", other)

    def _as(self, element: Any) -> Any:
        return ir.VectorType(element, self.value.type.count)

    def whole(self) -> Lanes:
        """Truncated to int32, towards zero."""
        return type(self)(self.builder, self.builder.fptosi(self.value, self._as(WHOLE)))

    def real(self) -> Lanes:
        """Converted to float32."""
        return type(self)(self.builder, self.builder.sitofp(self.value, self._as(REAL)))

    def widened(self) -> Lanes:
        """uint16 converted to int32."""
        return type(self)(self.builder, self.builder.zext(self.value, self._as(WHOLE)))

    def bits(self) -> Lanes:
        """The bits of float32 as int32."""
        return type(self)(self.builder, self.builder.bitcast(self.value, self._as(WHOLE)))

    def exponent(self) -> Lanes:
        """Two to the power (int32 - 127), as float32: the integers become its exponents."""
        return type(self)(self.builder, self.builder.bitcast((self * (1 << 23)).value, self._as(REAL)))

    def call(self, name: str) -> Lanes:
        """LLVM's intrinsic function of one float32, lane by lane."""
        suffix = f"v{self.value.type.count}f32"
        kind = ir.FunctionType(self.value.type, [self.value.type])
        function = cgutils.get_or_insert_function(self.builder.module, kind, f"llvm.{name}.{suffix}")
        return type(self)(self.builder, self.builder.call(function, [self.value], fastmath=self.fast))


class Strict(Lanes):
    """Lanes whose results, even when combined with other lanes, are rounded one by one, as in scalar arithmetic."""

    fast = ()


def where(flags: Lanes, yes: Any, no: Any) -> Lanes:
    """`yes` where the flag is set, else `no`; float32 if both are numbers."""
    model = next((a for a in (yes, no) if isinstance(a, Lanes)), None) or flags.all(1.0)
    return type(model)(flags.builder, flags.builder.select(flags.value, model.like(yes), model.like(no)))


def least(a: Lanes, b: Any) -> Lanes:
    """The smaller; `b` where `a` is NaN."""
    return where(a < b, a, b)


def most(a: Lanes, b: Any) -> Lanes:
    """The larger; `b` where `a` is NaN."""
    return where(a > b, a, b)


def root(a: Lanes) -> Lanes:
    """The square root."""
    return a.call("sqrt")


def size(a: Lanes) -> Lanes:
    """The absolute value."""
    return a.call("fabs")


def floor(a: Lanes) -> Lanes:
    """The greatest integer not above the value, as float32."""
    return a.call("floor")


def sign(a: Lanes) -> Lanes:
    """1 where the value is not negative, else -1."""
    return where(a >= 0, 1, -1)


def clamp(a: Lanes) -> Lanes:
    """The value clamped to [0, 1]."""
    return least(most(a, 0), 1)


def dot(a: tuple[Lanes, ...], b: tuple[Lanes, ...]) -> Lanes:
    """The scalar product of two 3-vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: tuple[Lanes, ...], b: tuple[Lanes, ...]) -> tuple[Lanes, ...]:
    """The vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def spread(builder: ir.IRBuilder, value: Any, count: int = LANES) -> Lanes:
    """One number in all lanes."""
    lanes = ir.VectorType(value.type, count)
    first = builder.insert_element(ir.Constant(lanes, ir.Undefined), value, WHOLE(0))
    return Lanes(builder, builder.shuffle_vector(first, first, ir.Constant(ir.VectorType(WHOLE, count), [0] * count)))


def load(builder: ir.IRBuilder, data: Any, at: Any, count: int = LANES) -> Lanes:
    """Neighbouring numbers of an array from this index on."""
    element = data.type.pointee
    align = 4 if element == REAL else element.width // 8
    return Lanes(builder, builder.load(_pointer(builder, data, at, count), align=align))


def store(data: Any, at: Any, lanes: Lanes) -> None:
    """Write lanes to neighbouring numbers of an array from this index on."""
    lanes.builder.store(lanes.value, _pointer(lanes.builder, data, at, lanes.value.type.count), align=4)


def scatter(data: Any, at: Any, rows: Mapping[int, int], lanes: Lanes) -> None:
    """Store single lanes: `rows` maps each lane to its place in the array, counted from `at`."""
    builder = lanes.builder
    for lane, row in rows.items():
        builder.store(builder.extract_element(lanes.value, WHOLE(lane)), builder.gep(data, [builder.add(at, at.type(row))]))


def _pointer(builder: ir.IRBuilder, data: Any, at: Any, count: int) -> Any:
    return builder.bitcast(builder.gep(data, [at]), ir.VectorType(data.type.pointee, count).as_pointer())


class Rows:
    """An array of rows; [row] reads the lanes from `row + i` on, [row, shift] those from `row + shift + i` on.

    If `kept` flags are given, writing changes only lanes whose flag is set.
    """

    def __init__(self, builder: ir.IRBuilder, data: Any, i: Any, kept: Lanes | None) -> None:
        self.builder = builder
        self.data = data
        self.i = i
        self.kept = kept

    def _at(self, row: Any) -> Any:
        at: Any = self.i
        for part in row if isinstance(row, tuple) else (row,):
            at = self.builder.add(at, at.type(part) if isinstance(part, int) else part)
        return at

    def __getitem__(self, row: Any) -> Lanes:
        return load(self.builder, self.data, self._at(row))

    def __setitem__(self, row: Any, lanes: Lanes | float) -> None:
        if not isinstance(lanes, Lanes):
            lanes = Lanes(self.builder, ir.Constant(ir.VectorType(REAL, LANES), [float(lanes)] * LANES))
        if self.kept is not None:
            lanes = where(self.kept, lanes, self[row])
        store(self.data, self._at(row), lanes)

    def one(self, at: int) -> Lanes:
        """One number of the array, in all lanes."""
        return spread(self.builder, self.builder.load(self.builder.gep(self.data, [self.i.type(at)])))

    def get(self, *rows: int) -> tuple[Lanes, ...]:
        """The lanes of several rows."""
        return tuple(self[row] for row in rows)

    def put(self, rows: tuple[int, ...], values: tuple[Lanes, ...]) -> None:
        """Set several rows."""
        for row, value in zip(rows, values, strict=True):
            self[row] = value


def lanewise(function: Callable[..., None] | None = None, *, exact: bool = False) -> Any:
    """Make a function of rows and numbers callable from kernels, with a count before its arguments: it runs for that many
    samples, or a few more, up to whole vectors.

    Arrays are passed as Rows, numbers of float32 as Lanes, unsigned ones as row numbers. With `exact`, the elements of rows
    beyond the count keep their values.
    """
    if function is None:
        return partial(lanewise, exact=exact)

    def typed(typing: Any, count: Any, *arguments: Any) -> Any:
        return nb.void(nb.intp, *arguments), code

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        def samples(i: Any, kept: Lanes | None) -> None:
            given = zip(signature.args[1:], arguments[1:], strict=True)
            function(*(_argument(context, builder, kind, value, i, kept) for kind, value in given))

        count = arguments[0]
        full = builder.and_(count, count.type(-LANES)) if exact else count
        with cgutils.for_range_slice(builder, count.type(0), full, count.type(LANES)) as (i, _):
            samples(i, None)
        if exact:
            left = builder.sub(count, full)
            with builder.if_then(builder.icmp_signed(">", left, left.type(0))):
                order = Lanes(builder, ir.Constant(ir.VectorType(WHOLE, LANES), list(range(LANES))))
                samples(full, order < spread(builder, builder.trunc(left, WHOLE)))
        return context.get_dummy_value()

    names = inspect.signature(function).parameters
    kinds = [inspect.Parameter(name, inspect.Parameter.POSITIONAL_OR_KEYWORD) for name in ("typing", "count", *names)]
    typed.__signature__ = inspect.Signature(kinds)
    typed.__name__ = typed.__qualname__ = function.__name__
    typed.__module__ = function.__module__
    return intrinsic(typed)


def _argument(context: Any, builder: Any, kind: Any, value: Any, i: Any, kept: Lanes | None) -> Any:
    if isinstance(kind, nb.types.Array):
        return Rows(builder, context.make_array(kind)(context, builder, value).data, i, kept)
    if kind == nb.uintp:
        return value
    return spread(builder, builder.trunc(value, WHOLE) if kind == nb.intp else value)
