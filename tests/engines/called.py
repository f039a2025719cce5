"""Kernels that only kernels call, for tests to call."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from viewsphere.kernels.jit import njit


def called(kernel: Any) -> Callable[..., Any]:
    """The same kernel, compiled so that Python can call it."""
    options = {name: kernel.targetoptions[name] for name in ("fastmath", "_nrt") if name in kernel.targetoptions}
    return njit(kernel.py_func, **options)
