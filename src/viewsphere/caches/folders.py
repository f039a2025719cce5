"""Entries that are several files, which others open by their names. Each is copied out, with shared blocks where the file
system can do that.

    <cache>/<kind>/<digest>.arrays            the names of the files, their sizes and the digests of their content
    <cache>/<kind>/<digest of content>.file   a file; entries with equal files share it
"""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import xxhash

from viewsphere.caches import cache_of
from viewsphere.caches.entries import SUFFIX, making, note_use, read_entry, write_entry
from viewsphere.files import open_file

FILE_SUFFIX = ".file"
_DIGEST = re.compile("[0-9a-f]{32}")
_NAME = re.compile(r"[^/\\:\0]*[^/\\:\0.]")
"""Names of files of a folder; this excludes paths, `.` and `..`."""


def cached_files(kind: str, digest: str, make: Callable[[Path], None], folder: Path) -> None:
    """Fill an empty folder with the files that `make` writes, from the cache if it has an entry of this kind and digest.

    A damaged entry is made anew; a cache that cannot be written costs time only. Raises as `make` does, and OSError if the
    folder cannot be written.
    """
    entry = cache_of(kind) / f"{digest}{SUFFIX}"
    held = read_entry(entry)
    if held is not None and _copied(held.about, entry.parent, folder):
        return
    make(folder)
    with suppress(OSError):
        about = {file.name: _kept(file, entry.parent) for file in sorted(folder.iterdir())}
        write_entry(entry, about, {})


def _copied(about: Any, place: Path, folder: Path) -> bool:
    """Return whether all files of an entry were copied into the folder; else the folder is empty again."""
    names: list[str] = []
    try:
        for name, (size, digest) in about.items():
            if not (_NAME.fullmatch(name) and _DIGEST.fullmatch(digest)):
                raise ValueError(f"{name!r}, {digest!r}")
            names.append(name)
            _copy(place / f"{digest}{FILE_SUFFIX}", folder / name, size, digest)
    except (OSError, ValueError, TypeError, AttributeError):  # missing, damaged or hostile
        for name in names:
            (folder / name).unlink(missing_ok=True)
        return False
    return True


def _copy(kept: Path, target: Path, size: int, digest: str) -> None:
    """Copy a file of the cache. Raises OSError if it cannot be read, ValueError if its content is not the expected one; then it
    is deleted.
    """
    with open_file(kept) as source:
        is_whole = os.fstat(source.fileno()).st_size == size
        if is_whole:
            with target.open("wb") as stream:
                _copy_bytes(source.fileno(), stream.fileno(), size)
            is_whole = _digest_of(target) == digest
    if not is_whole:
        with suppress(OSError):
            kept.unlink()
        raise ValueError(f"{kept}: damaged")
    note_use(kept)


def _copy_bytes(source: int, target: int, size: int) -> None:
    """Copy a file between descriptors; file systems such as Btrfs and XFS then share its blocks (copy_file_range(2))."""
    copied = 0
    if hasattr(os, "copy_file_range"):
        with suppress(OSError):  # between two file systems, or on one that cannot do it
            while copied < size and (count := os.copy_file_range(source, target, size - copied, copied, copied)):
                copied += count
    os.lseek(source, copied, os.SEEK_SET)
    os.lseek(target, copied, os.SEEK_SET)
    with open(source, "rb", closefd=False) as rest, open(target, "wb", closefd=False) as stream:
        shutil.copyfileobj(rest, stream)


def _kept(file: Path, place: Path) -> tuple[int, str]:
    """Add a file to the cache, unless it is there; returns its size and the digest of its content. Raises OSError if the cache
    cannot be written.
    """
    size, digest = file.stat().st_size, _digest_of(file)
    kept = place / f"{digest}{FILE_SUFFIX}"
    if kept.is_file() and kept.stat().st_size == size:
        note_use(kept)
    else:
        with making(kept) as half, open_file(file) as source, half.open("wb") as target:
            _copy_bytes(source.fileno(), target.fileno(), size)
    return size, digest


def _digest_of(file: Path) -> str:
    digest = xxhash.xxh3_128()
    with open_file(file) as stream:
        while block := stream.read(1 << 20):
            digest.update(block)
    return digest.hexdigest()
