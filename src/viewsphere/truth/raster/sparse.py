"""Arrays of which only parts are ever written, such as those of the things in a picture."""

from __future__ import annotations

import math
import mmap
import weakref
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

LEAST = 1 << 25
"""Bytes from which on an array has pages of its own: smaller ones are on the heap, whose memory is there already."""

MOST = 16
"""Arrays, one after another, that have the same pages: those of what is out of sight by then are given back."""


Kind = TypeVar("Kind", bound=np.generic)


def sparse(shape: tuple[int, ...], dtype: type[Kind]) -> NDArray[Kind]:
    """An uninitialised array that takes memory where it is written to, page by page.

    numpy asks for pages of 2 MB, each of which is there as a whole once any of it is written: of things of half a megabyte, a
    few of which are in the picture, that is nearly all. Systems without such pages give memory like this anyway.
    """
    return Spare().array(shape, dtype)


@dataclass(eq=False)
class _Pages:
    memory: mmap.mmap
    uses: int = 0


@dataclass(eq=False)
class Spare:
    """Gives sparse arrays whose pages are those of an earlier one that nobody holds any more, where there is one: to get new
    pages takes longer than to write to them.
    """

    _free: list[_Pages] = field(default_factory=list[_Pages])

    def array(self, shape: tuple[int, ...], dtype: type[Kind]) -> NDArray[Kind]:
        """One like `sparse`."""
        count = math.prod(shape)
        size = count * np.dtype(dtype).itemsize
        if size < LEAST or not hasattr(mmap, "MADV_NOHUGEPAGE"):
            return np.empty(shape, dtype)
        pages = self._free.pop() if self._free else None
        if pages is None or pages.uses == MOST or len(pages.memory) < size:
            pages = _Pages(mmap.mmap(-1, size, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS))
            pages.memory.madvise(mmap.MADV_NOHUGEPAGE)
        pages.uses += 1
        whole = np.frombuffer(pages.memory, dtype, count)  # lives as long as any view of it
        weakref.finalize(whole, self._free.append, pages).atexit = False
        return whole.reshape(shape)
