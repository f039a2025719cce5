"""Prefetching: a kernel that reads rows in an order that processors cannot guess requests them before it needs them."""

from __future__ import annotations

from typing import Any

import numba as nb
from llvmlite import ir
from numba.extending import intrinsic

AHEAD = 16
"""Number of rows between the current one and the one that is requested. 8 to 32 were equally fast on an AMD EPYC."""


@intrinsic
def prefetch(typing: Any, array: Any, index: Any) -> Any:
    """Prefetch the number at a flat index of an array into the processor's cache. The index may be beyond the end."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        word = builder.bitcast(builder.gep(data, [arguments[1]]), ir.IntType(8).as_pointer())
        flag = ir.IntType(32)
        kind = ir.FunctionType(ir.VoidType(), [word.type, flag, flag, flag])
        builder.call(builder.module.declare_intrinsic("llvm.prefetch.p0", fnty=kind), [word, flag(0), flag(3), flag(1)])
        return context.get_dummy_value()

    return nb.void(array, nb.uintp), code
