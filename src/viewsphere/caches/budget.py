"""The limit of the cache: the entries that were used longest ago are deleted.

No lock is needed. Two processes that prune at once delete the same entries, and a deleted entry is recreated when needed.
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

from viewsphere.caches import KINDS, cache_folder, cache_of
from viewsphere.limits import limits
from viewsphere.scratch import sweep

KEPT_SHARE = 0.9
"""Share of the limit that pruning leaves, so that the next entries need no further pruning."""

CHECKED_SHARE = 1 / 32
"""Share of the limit that all processes together write between two scans of the whole cache. A scan takes 2 ms for 1,000
entries.
"""

LEDGER = "written"
"""A cache file whose length records how much was written since the last scan, in units of `UNIT` of the limit."""

UNIT = 1 / 4096
"""A byte of the ledger represents this share of the limit: the ledger has 128 bytes when a scan is due."""

KERNELS, KERNELS_S = "kernels", 30 * 86_400.0
"""The kind that is deleted last, unless unused for this many seconds. Kernels are small compared to light and slow to make, and
workers read them again hours after a run has begun.
"""

EXPORTS = "exports"
"""The kind that is deleted first: the exports of a run's models may be larger than the cache, and each saves least time."""

READ_BY_PATH = frozenset({".glb"})
"""Endings of files that others open by their path, so that pruning spares the ones in use."""

SPARED_S = 1200.0
"""Seconds after its last use during which such a file counts as in use: twice `entries.RECENT_S`."""


@dataclass(frozen=True)
class Entry:
    """A file of the cache: its kind, its bytes, and when it was last used, in seconds since 1970."""

    file: Path
    kind: str
    size: int
    used: float


def entries(kinds: Iterable[str] = tuple(KINDS)) -> Iterator[Entry]:
    """Yield the complete files of these kinds."""
    for kind in kinds:
        for folder, folders, names in os.walk(cache_of(kind)):
            folders[:] = (name for name in folders if "~" not in name)  # without the scratch folders of unfinished entries
            for name in names:
                file = Path(folder, name)
                with suppress(OSError):  # deleted meanwhile
                    about = file.lstat()
                    if S_ISREG(about.st_mode):
                        yield Entry(file, kind, about.st_size, about.st_mtime)


def make_room(size: int) -> None:
    """Count the bytes of an entry that is about to appear, and prune the cache once enough was written since the last look.

    Bytes are counted before they are written, for all processes together: neither many short processes nor killed ones exceed
    the limit. Raises OSError if the cache cannot be written.
    """
    if _is_look_due(size):
        held = _unfinished() + sum(entry.size for entry in entries())
        if held > limits.CACHE_LIMIT * (1 - CHECKED_SHARE):
            prune(int(limits.CACHE_LIMIT * KEPT_SHARE) - size)


def _unfinished() -> int:
    """Return the bytes of the entries that all processes are writing now, the caller's included.

    Processes that look at the same moment thus count one another's entries. Call this before `entries`, so that an entry that
    is finished in between counts twice, not never.
    """
    held = 0
    for kind in KINDS:
        for folder, _, names in os.walk(cache_of(kind)):
            for name in names if "~" in Path(folder).name else ():
                with suppress(OSError):  # finished meanwhile
                    held += Path(folder, name).lstat().st_size
    return held


def _is_look_due(size: int) -> bool:
    """True if a `CHECKED_SHARE` has been written; then the ledger restarts."""
    units = min(int(size / (limits.CACHE_LIMIT * UNIT)) + 1, int(1 / UNIT))
    # Appending is atomic: no lock is needed. Where machines share the folder, they may count too little at times.
    further = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
    cache_folder().mkdir(parents=True, exist_ok=True)
    ledger = os.open(cache_folder() / LEDGER, os.O_WRONLY | os.O_CREAT | os.O_APPEND | further, 0o666)
    try:
        os.write(ledger, bytes(units))
        is_due = os.fstat(ledger).st_size >= CHECKED_SHARE / UNIT
        if is_due:
            os.ftruncate(ledger, 0)
    finally:
        os.close(ledger)
    return is_due


def prune(limit: int) -> list[Entry]:
    """Delete the entries that were used longest ago, kernels last, until the remaining ones hold at most `limit` bytes. Return
    the deleted entries.

    An entry with a time in the future, such as after a clock change, counts as the oldest.
    """
    _sweep_all()
    now = time.time() + 60  # machines that share a cache differ by some seconds
    newest_first = sorted(entries(), key=lambda entry: (_rank(entry, now), entry.used > now, -entry.used, str(entry.file)))
    sums = accumulate(entry.size for entry in newest_first)
    return _delete(
        entry for entry, total in zip(newest_first, sums, strict=True) if total > limit and not _is_in_use(entry, now)
    )


def takes(size: int) -> bool:
    """True if an entry of this many bytes leaves room for others. A larger one would displace all of them."""
    return size <= limits.CACHE_LIMIT * KEPT_SHARE


def _is_in_use(entry: Entry, now: float) -> bool:
    return entry.file.suffix in READ_BY_PATH and now - SPARED_S < entry.used <= now


def _rank(entry: Entry, now: float) -> int:
    """The higher, the earlier an entry is deleted."""
    if _is_in_use(entry, now):
        return 0  # others make room for it
    if entry.kind == KERNELS and entry.used >= now - KERNELS_S:
        return 1
    return 3 if entry.kind == EXPORTS else 2


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
    """Remove folders left behind by dead processes."""
    for kind in KINDS:
        with suppress(OSError):
            sweep(cache_of(kind))
