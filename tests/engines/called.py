"""Kernels that only kernels call, for tests to call."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from viewsphere.geometry.jit import njit


def called(kernel: Any) -> Callable[..., Any]:
    """The same kernel, compiled so that Python can call it."""
    return njit(kernel.py_func, fastmath=kernel.targetoptions.get("fastmath", False))
