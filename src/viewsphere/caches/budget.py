"""The limit of the cache: the entries that were used longest ago are deleted.

No lock is needed. Two processes that prune at once delete the same entries, and an entry that is gone is made again.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path
from stat import S_ISREG

from viewsphere.aside import sweep
from viewsphere.caches import KINDS, cache_of
from viewsphere.limits import limits

KEPT_SHARE = 0.9
"""Share of the limit that pruning leaves, so that the next entries need no further pruning."""

CHECKED_SHARE = 1 / 32
"""Share of the limit that a process writes between two looks at the whole cache: a look takes 2 ms for 1,000 entries."""

_written: dict[int, int] = {}
"""Bytes that this process, by its number, has written since its last look; none where it has not looked yet."""


@dataclass(frozen=True)
class Entry:
    """A file of the cache: its kind, its bytes, and when it was last used, in seconds since 1970."""

    file: Path
    kind: str
    size: int
    used: float


def entries(kinds: Iterable[str] = tuple(KINDS)) -> Iterator[Entry]:
    """All whole files of these kinds."""
    for kind in kinds:
        for folder, folders, names in os.walk(cache_of(kind)):
            folders[:] = (name for name in folders if "~" not in name)  # in which entries are being written, see `aside`
            for name in (name for name in names if not name.startswith(".")):
                file = Path(folder, name)
                with suppress(OSError):  # deleted meanwhile
                    about = file.lstat()
                    if S_ISREG(about.st_mode):
                        yield Entry(file, kind, about.st_size, about.st_mtime)


def note_written(size: int) -> None:
    """Count the bytes of a new entry, and prune the cache if this process has written enough since it last looked."""
    process = os.getpid()
    written = _written.get(process)
    _written[process] = size if written is None else written + size
    if written is None or _written[process] > limits.CACHE_LIMIT * CHECKED_SHARE:
        _written[process] = 0
        if sum(entry.size for entry in entries()) > limits.CACHE_LIMIT:
            prune(int(limits.CACHE_LIMIT * KEPT_SHARE))


def prune(limit: int) -> list[Entry]:
    """Delete the entries that were used longest ago until the others have at most `limit` bytes; return the deleted ones.

    An entry whose time lies in the future, as after a jump of the clock, counts as the oldest.
    """
    _sweep_all()
    now = time.time() + 60  # machines that share a cache differ by some seconds
    newest_first = sorted(entries(), key=lambda entry: (entry.used > now, -entry.used, str(entry.file)))
    sums = accumulate(entry.size for entry in newest_first)
    return _delete(entry for entry, total in zip(newest_first, sums, strict=True) if total > limit)


def clear(kinds: Iterable[str] = tuple(KINDS)) -> list[Entry]:
    """Delete all entries of these kinds; return the deleted ones."""
    _sweep_all()
    return _delete(entries(tuple(kinds)))


def _delete(chosen: Iterable[Entry]) -> list[Entry]:
    gone: list[Entry] = []
    for entry in list(chosen):
        with suppress(OSError):
            entry.file.unlink(missing_ok=True)
            gone.append(entry)
    return gone


def _sweep_all() -> None:
    """Remove folders that dead processes left."""
    for kind in KINDS:
        with suppress(OSError):
            sweep(cache_of(kind))
