"""Memory that was freed stays with the process, for the next frame.

The kernel hands out pages one by one and clears each: of a frame whose arrays are new memory that is a tenth of the time,
and more on a virtual machine.
"""

from __future__ import annotations

import ctypes
import os
import platform

KEPT_BYTES = 1 << 29
"""Of free memory at the heap's end, before any is given back."""

LARGEST_BYTES = 1 << 25
"""Of an array on the heap, the most that glibc allows; a larger one is given back when it is freed."""

_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3  # malloc.h


def keep_freed_memory() -> bool:
    """Tell glibc's allocator to keep what is freed; whether it was told.

    Not where the environment tells it something else (`MALLOC_TRIM_THRESHOLD_`, `MALLOC_MMAP_THRESHOLD_`, `GLIBC_TUNABLES`),
    nor with other C libraries. See mallopt(3).
    """
    is_told = any(os.environ.get(f"MALLOC_{name}_THRESHOLD_") for name in ("TRIM", "MMAP"))
    if is_told or "glibc.malloc" in os.environ.get("GLIBC_TUNABLES", "") or platform.libc_ver()[0] != "glibc":
        return False
    libc = ctypes.CDLL(None)
    return bool(libc.mallopt(_M_MMAP_THRESHOLD, LARGEST_BYTES) and libc.mallopt(_M_TRIM_THRESHOLD, KEPT_BYTES))
