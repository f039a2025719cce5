"""Arrays of which only parts are ever written, such as those of the things in a picture."""

from __future__ import annotations

import math
import mmap
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

LEAST = 1 << 25
"""Bytes from which on an array has pages of its own: smaller ones are on the heap, whose memory is there already."""


Kind = TypeVar("Kind", bound=np.generic)


def sparse(shape: tuple[int, ...], dtype: type[Kind]) -> NDArray[Kind]:
    """An uninitialised array that takes memory where it is written to, page by page.

    numpy asks for pages of 2 MB, each of which is there as a whole once any of it is written: of things of half a megabyte, a
    few of which are in the picture, that is nearly all. Systems without such pages give memory like this anyway.
    """
    count = math.prod(shape)
    size = count * np.dtype(dtype).itemsize
    if size < LEAST or not hasattr(mmap, "MADV_NOHUGEPAGE"):
        return np.empty(shape, dtype)
    pages = mmap.mmap(-1, size, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    pages.madvise(mmap.MADV_NOHUGEPAGE)
    return np.frombuffer(pages, dtype, count).reshape(shape)
