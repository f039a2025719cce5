"""The decorators of all kernels: they use `compiler` for the numba versions that it supports, else `stock`."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from viewsphere.kernels.build import IS_STOCK

if IS_STOCK:
    from viewsphere.kernels import stock as compiler
else:
    from viewsphere.kernels import compiler

_EXACT: dict[str, Any] = {"nogil": True, "error_model": "numpy"}


def njit(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """`numba.njit` as every kernel uses it: no GIL, cached, numpy's division, exact unless `fastmath` is given.

    Kernels that allocate arrays need `_nrt`. Others omit it, since reference counting of arrays is slow to compile.
    """
    if function is None:
        return partial(njit, **options)
    return compiler.whole(function, **{**_EXACT, **options})


def inner(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """`njit` for functions that only kernels call: a part of each such kernel, neither optimized nor cached by itself.

    Optimizing each part would take most of the compile time. Python cannot call a part, and a part allocates no arrays unless
    `_nrt`.
    """
    if function is None:
        return partial(inner, **options)
    return compiler.part(function, **{**_EXACT, **options})
