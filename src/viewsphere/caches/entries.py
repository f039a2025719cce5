"""Entries of the cache: written whole or not at all, checked whenever they are read, and never an error.

An entry that is damaged is deleted and made anew. Where the cache cannot be written, or its disk is full, the caller makes its
result again in each process.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from viewsphere.caches import budget, cache_of
from viewsphere.scratch import scratch_folder, sweep

if TYPE_CHECKING:
    from viewsphere.caches.arrays import Arrays, Content  # which imports numpy: listing the zoo does not

SUFFIX = ".arrays"
PREFIX = "entry-"
"""The prefix of folders in which entries are being written."""

RECENT_S = 600.0
"""Seconds within which a second use of an entry is not noted: noting one writes to the disk."""

T = TypeVar("T")


def kept(kind: str, digest: str, make: Callable[[], T], pack: Callable[[T], Content], unpack: Callable[[Content], T]) -> T:
    """The result of `make`, from the cache where it has an entry of this kind and digest."""
    file = cache_of(kind) / f"{digest}{SUFFIX}"
    content = read_entry(file)
    if content is not None:
        with suppress(ValueError, LookupError, TypeError, AttributeError, RecursionError):  # hostile, in spite of its digest
            return unpack(content)
    result = make()
    packed = pack(result)
    write_entry(file, packed.about, packed.arrays)
    return result


def read_entry(file: Path) -> Content | None:
    """The content of an entry; None where there is none that is whole."""
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
    """Write an entry where that is possible."""
    from viewsphere.caches.arrays import write_arrays

    with suppress(OSError), making(file) as half:
        write_arrays(half, about, arrays)


@contextmanager
def making(file: Path) -> Generator[Path]:
    """A path at which to write an entry's file, which appears when the block has ended; raises OSError as writing does."""
    file.parent.mkdir(parents=True, exist_ok=True)
    sweep_once(file.parent, PREFIX, os.getpid())
    with scratch_folder(file.parent, PREFIX) as place:
        half = place / file.name
        yield half
        publish(half, file)


@cache
def sweep_once(folder: Path, prefix: str, process: int) -> None:
    """Remove what dead processes left in a folder: the first time that a process writes there, since it lists all entries."""
    sweep(folder, prefix)


def publish(half: Path, file: Path) -> None:
    """Make a whole file an entry of the cache, and keep the cache within its limit; raises OSError as renaming does. An entry
    that alone would fill the cache is left out.
    """
    size = half.stat().st_size
    if budget.takes(size) or file.suffix in budget.READ_BY_PATH:
        budget.make_room(size)
        half.replace(file)


def note_use(file: Path) -> None:
    """Note that an entry was used, as the time of its last change."""
    with suppress(OSError):
        if abs(time.time() - file.stat().st_mtime) > RECENT_S:
            os.utime(file)
