"""Cache entries: written completely or not at all, checked on every read, and never a cause of errors.

A damaged entry is deleted and recreated. If the cache cannot be written or its disk is full, the caller recomputes its result
in each process.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from viewsphere.caches import budget, cache_folder, cache_of
from viewsphere.scratch import scratch_folder, sweep

if TYPE_CHECKING:
    from viewsphere.caches.arrays import Arrays, Content  # which imports numpy: listing the zoo does not

SUFFIX = ".arrays"
PREFIX = "entry-"
"""The prefix of folders in which entries are being written."""

RECENT_S = 600.0
"""Seconds after a recorded use during which further uses of an entry are not recorded, since each record writes to the disk."""

T = TypeVar("T")


def cached(kind: str, digest: str, make: Callable[[], T], pack: Callable[[T], Content], unpack: Callable[[Content], T]) -> T:
    """The result of `make`, read from the cache if it has an entry of this kind and digest.

    A large result that is new is read back, too, so that the caller has the memory that other processes map.
    """
    from viewsphere.caches.arrays import MAPPED_BYTES

    file = cache_of(kind) / f"{digest}{SUFFIX}"
    for held in _held(file, unpack):
        return held
    result = make()
    packed = pack(result)
    write_entry(file, packed.about, packed.arrays)
    if sum(values.nbytes for values in packed.arrays.values()) >= MAPPED_BYTES:
        for held in _held(file, unpack):
            return held
    return result


def _held(file: Path, unpack: Callable[[Content], T]) -> Generator[T]:
    """Yield the result in an entry, if there is one."""
    content = read_entry(file)
    if content is not None:
        with suppress(ValueError, LookupError, TypeError, AttributeError, RecursionError):  # hostile, in spite of its digest
            yield unpack(content)


def read_entry(file: Path) -> Content | None:
    """The content of an entry; None if it does not exist or is incomplete."""
    from viewsphere.caches.arrays import DamagedError, read_arrays

    try:
        content = read_arrays(file)
    except DamagedError:
        with suppress(OSError):
            file.unlink()
        return None
    except (OSError, MemoryError):
        return None
    note_use(file)
    return content


def write_entry(file: Path, about: Any, arrays: Arrays) -> None:
    """Write an entry if possible."""
    from viewsphere.caches.arrays import write_arrays

    with suppress(OSError), making(file) as half:
        write_arrays(half, about, arrays)


@contextmanager
def making(file: Path, kind: Path | None = None) -> Generator[Path]:
    """A temporary path for an entry's file, which becomes visible when the block ends. Raises OSError if writing fails.

    `kind` is the folder of the entry's kind, where killed processes' files are removed; by default the one that holds the file.
    """
    kind = kind or file.parent
    file.parent.mkdir(parents=True, exist_ok=True)
    sweep_once(kind, PREFIX, os.getpid())
    with scratch_folder(kind, PREFIX) as place:
        half = place / file.name
        yield half
        publish(half, file)


@cache
def sweep_once(folder: Path, prefix: str, process: int) -> None:
    """Remove files left by dead processes from a folder. This runs only at a process's first write, since it lists all
    entries.
    """
    sweep(folder, prefix)


def publish(half: Path, file: Path) -> None:
    """Turn a complete file into a cache entry, and keep the cache within its limit. An entry that alone would fill the cache is
    not stored. A file in another folder does not count. Raises OSError if renaming fails.
    """
    if cache_folder() in file.parents:
        size = half.stat().st_size
        if not budget.takes(size) and file.suffix not in budget.READ_BY_PATH:
            return
        budget.make_room(size)
    half.replace(file)


def note_use(file: Path) -> None:
    """Record the use of an entry as its modification time."""
    with suppress(OSError):
        if abs(time.time() - file.stat().st_mtime) > RECENT_S:
            os.utime(file)
