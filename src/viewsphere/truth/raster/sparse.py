"""Arrays that are written only in part, such as those of the things in a picture."""

from __future__ import annotations

import math
import mmap
import weakref
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

LEAST = 1 << 25
"""Minimum size in bytes of an array with pages of its own; smaller ones use the heap, whose memory is already mapped."""

LEAST_ZEROS = 1 << 22
"""Minimum size in bytes of an array of zeros with pages of its own: the objects of the triangles of a town take 13 MB."""

MOST = 16
"""Number of successive arrays that reuse the same pages; then pages of things no longer in sight are released."""


Kind = TypeVar("Kind", bound=np.generic)


def sparse(shape: tuple[int, ...], dtype: type[Kind]) -> NDArray[Kind]:
    """An uninitialised array that uses memory only for the pages that are written.

    numpy requests pages of 2 MB, each of which becomes resident as soon as any of it is written. With things of half a
    megabyte, a few of them in the picture, that is nearly the whole array. Systems without such pages behave like this anyway.
    """
    return Spare().array(shape, dtype)


def zeros(count: int, dtype: type[Kind]) -> NDArray[Kind]:
    """An array of zeros that, if it is large, uses memory only for the pages that are written. numpy's own are written as soon
    as the heap has room for them.
    """
    size = count * np.dtype(dtype).itemsize
    if size < LEAST_ZEROS or not hasattr(mmap, "MADV_NOHUGEPAGE"):
        return np.zeros(count, dtype)
    return np.frombuffer(_pages(size), dtype, count)


def _pages(size: int) -> mmap.mmap:
    """New pages, which are zero and take no memory before they are written."""
    pages = mmap.mmap(-1, size, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    pages.madvise(mmap.MADV_NOHUGEPAGE)
    return pages


@dataclass(eq=False)
class _Pages:
    memory: mmap.mmap
    uses: int = 0


@dataclass(eq=False)
class Spare:
    """Gives sparse arrays that reuse the pages of an earlier, released array, if there is one: new pages take longer to get
    than to write to.
    """

    _free: list[_Pages] = field(default_factory=list[_Pages])

    def array(self, shape: tuple[int, ...], dtype: type[Kind]) -> NDArray[Kind]:
        """An array like those of `sparse`."""
        count = math.prod(shape)
        size = count * np.dtype(dtype).itemsize
        if size < LEAST or not hasattr(mmap, "MADV_NOHUGEPAGE"):
            return np.empty(shape, dtype)
        pages = self._free.pop() if self._free else None
        if pages is None or pages.uses == MOST or len(pages.memory) < size:
            pages = _Pages(_pages(size))
        pages.uses += 1
        whole = np.frombuffer(pages.memory, dtype, count)  # lives as long as any view of it
        weakref.finalize(whole, self._free.append, pages).atexit = False
        return whole.reshape(shape)
