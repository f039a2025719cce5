"""numba's lowering, with a few instructions instead of dozens for elements of arrays and for counting loops.

LLVM would remove the surplus instructions again, but writing them takes most of Python's time.
"""

# pyright: reportAttributeAccessIssue=false, reportPrivateUsage=false, reportMissingTypeArgument=false
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false
# Only through its internals does numba let its users choose how it compiles.

from __future__ import annotations

from functools import reduce
from typing import Any

from llvmlite import ir as llvm
from numba.core import cgutils, ir, types
from numba.core.analysis import compute_cfg_from_blocks
from numba.core.ir_utils import get_definition, guard
from numba.core.lowering import Lower
from numba.np.arrayobj import fix_integer_index, load_item, store_item


class KernelLower(Lower):
    """Lowers a function's statements."""

    def _find_singly_assigned_variable(self) -> None:
        """Keep variables that are set once, before all uses, as values; numba keeps those used in several blocks in memory."""
        if self.context.enable_nrt:
            super()._find_singly_assigned_variable()
        else:
            self._singly_assigned_vars, self._blk_local_varmap = self._values(), {}

    def _values(self) -> set[str]:
        above = compute_cfg_from_blocks(self.blocks).dominators()
        set_in: dict[str, int] = {}
        others = set[str]()
        for at, block in sorted(self.blocks.items()):
            for statement in block.body:
                value = statement.value if isinstance(statement, ir.Assign) else statement
                used = [value] if isinstance(value, ir.Var) else value.list_vars() if isinstance(value, ir.Inst) else []
                others.update(each.name for each in used if set_in.get(each.name) not in above[at])
                if value is not statement:
                    name = statement.target.name
                    if name in set_in:
                        others.add(name)
                    set_in[name] = at
        return set(set_in) - others

    def storevar(self, value: Any, name: str, argidx: int | None = None) -> None:
        """Sets a variable; without reference counts (`_nrt`) no old value has to be released."""
        if self.context.enable_nrt or name in self._singly_assigned_vars:
            super().storevar(value, name, argidx)
        else:
            self.builder.store(value, self.getvar(name))

    def lower_getitem(self, resty: Any, expr: Any, value: Any, index: Any, signature: Any) -> Any:
        """array[i, j], or any other indexing."""
        array = self.typeof(value.name)
        place = self._place(value, index)
        if place is None:
            return super().lower_getitem(resty, expr, value, index, signature)
        return self.context.cast(self.builder, load_item(self.context, self.builder, array, place), array.dtype, resty)

    def lower_setitem(self, target_var: Any, index_var: Any, value_var: Any, signature: Any) -> Any:
        """array[i, j] = value, or any other indexed assignment."""
        array = self.typeof(target_var.name)
        place = self._place(target_var, index_var)
        if place is None:
            return super().lower_setitem(target_var, index_var, value_var, signature)
        return store_item(self.context, self.builder, array, self._cast_var(value_var, array.dtype), place)

    def _place(self, variable: Any, index: Any) -> Any:
        """The address of the one indexed element; None for slices, other types than arrays, or where bounds are checked."""
        array, kind = self.typeof(variable.name), self.typeof(index.name)
        kinds = kind.types if isinstance(kind, types.BaseTuple) else (kind,)
        is_plain = isinstance(array, types.Array) and isinstance(array.dtype, (types.Number, types.Boolean))
        is_one = is_plain and len(kinds) == array.ndim and all(isinstance(each, types.Integer) for each in kinds)
        if not is_one or self.context.enable_boundscheck:
            return None
        builder, held, given = self.builder, self.loadvar(variable.name), self.loadvar(index.name)
        values = cgutils.unpack_tuple(builder, given, array.ndim) if isinstance(kind, types.BaseTuple) else [given]
        at = [self._index(k, v, array, held, axis) for axis, (k, v) in enumerate(zip(kinds, values, strict=True))]
        data = self._field(array, held, "data")
        if array.layout != "C":
            steps = [builder.mul(each, self._field(array, held, "strides", axis)) for axis, each in enumerate(at)]
            return cgutils.pointer_add(builder, data, reduce(builder.add, steps))
        offset = at[0]
        for axis, each in enumerate(at[1:], 1):
            offset = builder.add(builder.mul(offset, self._field(array, held, "shape", axis)), each)
        return builder.gep(data, [offset])

    def _index(self, kind: Any, value: Any, array: Any, held: Any, axis: int) -> Any:
        """An index counted from the beginning of its axis: negative ones count from the axis' end."""
        if isinstance(kind, types.IntegerLiteral) and kind.literal_value >= 0:
            return self.context.get_constant(types.intp, kind.literal_value)
        size = self._field(array, held, "shape", axis) if kind.signed else None
        return fix_integer_index(self.context, self.builder, kind, value, size)

    def _field(self, kind: Any, value: Any, name: str, *axis: int) -> Any:
        return self.builder.extract_value(value, [self.context.data_model_manager[kind].get_field_position(name), *axis])

    def lower_expr(self, resty: Any, expr: Any) -> Any:
        """Any expression that a variable is set to."""
        if self._is_range(expr):
            return self._range(resty, expr)
        if expr.op == "getiter" and self._counts_by_one(expr.value):
            return self._counter(resty, expr)
        if expr.op == "iternext" and isinstance(self.typeof(expr.value.name), types.RangeIteratorType):
            return self._next(resty, expr)
        if expr.op in ("pair_first", "pair_second") and not self.context.enable_nrt:
            return self.builder.extract_value(self.loadvar(expr.value.name), int(expr.op == "pair_second"))
        return super().lower_expr(resty, expr)

    def _range(self, kind: Any, expr: Any) -> Any:
        """range(stop), range(start, stop), range(start, stop, step)."""
        number = kind.iterator_type.yield_type
        given = [self._cast_var(each, number) for each in expr.args]
        zero, one = (self.context.get_constant(number, n) for n in (0, 1))
        bounds = [zero, *given] if len(given) == 1 else given
        return self._struct(kind, [*bounds, one][:3])

    def _is_range(self, expr: Any) -> bool:
        called = self.typeof(expr.func.name) if isinstance(expr, ir.Expr) and expr.op == "call" and not expr.vararg else None
        return isinstance(called, types.Function) and called.typing_key is range

    def _counts_by_one(self, bounds: Any) -> bool:
        made: Any = guard(get_definition, self.func_ir, bounds)
        return self._is_range(made) and len(made.args) < 3

    def _counter(self, kind: Any, expr: Any) -> Any:
        """The range's iterator: a place that holds its next value and the number of values to come; its end; its step."""
        builder, bounds = self.builder, self.loadvar(expr.value.name)
        start, stop, step = (builder.extract_value(bounds, n) for n in range(3))
        kept = [cgutils.alloca_once_value(builder, n) for n in (start, builder.sub(stop, start))]
        return self._struct(kind, [kept[0], stop, step, kept[1]])

    def _next(self, kind: Any, expr: Any) -> Any:
        """The next value, and whether there was one."""
        builder, counter = self.builder, self.loadvar(expr.value.name)
        at, step, left = (builder.extract_value(counter, n) for n in (0, 2, 3))
        value, count = builder.load(at), builder.load(left)
        builder.store(builder.add(value, step), at)
        builder.store(builder.sub(count, count.type(1)), left)
        return self._struct(kind, [value, builder.icmp_signed(">", count, count.type(0))])

    def _struct(self, kind: Any, values: list[Any]) -> Any:
        made = llvm.Constant(self.context.get_value_type(kind), llvm.Undefined)
        for n, value in enumerate(values):
            made = self.builder.insert_value(made, value, n)
        return made
