"""One array made of the arrays of several entries, whose memory processes share."""

from __future__ import annotations

import mmap
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from viewsphere.caches.arrays import MAPPED_BYTES, is_local, map_over
from viewsphere.files import open_file


@dataclass(frozen=True, eq=False)
class Stored:
    """The only array of an entry, as read from it, and the file that ends with the array. The file may not exist."""

    values: NDArray[Any]
    file: Path


def joined(parts: Sequence[Stored | int], dtype: type[np.generic], after: int) -> tuple[NDArray[Any], list[int]]:
    """An array that has all parts in this order, and the index at which each begins. Gaps between them have any value.

    A number stands for so many elements that the caller writes; `after` elements follow the last part. Large arrays of entries
    are mapped from their files where the system can do that, and copied elsewhere. Changes of the array stay in this process.
    """
    item = np.dtype(dtype).itemsize
    sizes = [_mappable_bytes(part) for part in parts]
    starts, total = _places(parts, sizes, item)
    total += after * item
    memory = mmap.mmap(-1, total, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS) if any(sizes) else None
    array = np.empty(total // item, dtype) if memory is None else np.frombuffer(memory, dtype, total // item)
    for part, size, start in zip(parts, sizes, starts, strict=True):
        if isinstance(part, Stored):
            place = array[start : start + part.values.size]
            if memory is None or not size or not _map(part, size, place):
                place[:] = part.values.reshape(-1)
            else:
                # The pages that the comparison has read leave the process; those that are used come back.
                memory.madvise(mmap.MADV_DONTNEED, start * item + part.values.nbytes - size, size)
    return array, starts


def _places(parts: Sequence[Stored | int], sizes: Sequence[int], item: int) -> tuple[list[int], int]:
    """The index at which each part begins, and the bytes of all parts. sizes: of their files, 0 for parts without one."""
    starts: list[int] = []
    at = 0
    for part, size in zip(parts, sizes, strict=True):
        own = part.values.nbytes if isinstance(part, Stored) else part * item
        at += -at % mmap.PAGESIZE if size else 0
        starts.append((at + max(size - own, 0)) // item)
        at += size + -size % mmap.PAGESIZE if size else own
    return starts, at


def _mappable_bytes(part: Stored | int) -> int:
    """The size of a part's file, 0 if it is not to be mapped."""
    if isinstance(part, int) or sys.platform != "linux" or part.values.nbytes < MAPPED_BYTES:
        return 0
    try:
        size = part.file.stat().st_size
    except OSError:
        return 0
    is_usable = size >= part.values.nbytes and (size - part.values.nbytes) % part.values.itemsize == 0
    return size if is_usable and is_local(part.file) else 0


def _map(part: Stored, size: int, place: NDArray[Any]) -> bool:
    """Map a part's file of `size` bytes so that its array is at `place`; return whether this worked.

    False also if the file has changed since the array was read from it: it is compared, so that its digest is not needed again.
    """
    try:
        with open_file(part.file) as stream:
            if os.fstat(stream.fileno()).st_size != size:
                return False
            address = place.ctypes.data + part.values.nbytes - size
            if not map_over(address, size, stream.fileno()):
                return False
    except OSError:
        return False
    return np.array_equal(place, part.values.reshape(-1))
