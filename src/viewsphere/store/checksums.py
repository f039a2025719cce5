"""The digests of an export's files, one line a file, in a file that `xxhsum --check` reads, too, and that proves itself.

    6f0c3b...  annotations/instances_train.json
    # 91d2...

No more of it is held in memory than a line. The last line is the digest of all lines above.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import xxhash

from viewsphere.store.manifest import seal_of

CHECKSUMS = "checksums.xxh128"
"""Name of the file in an export's folder."""

AGAIN = "export again, or mend it with viewsphere check --repair"


def write_checksums(folder: Path) -> None:
    """List all files of a finished folder."""
    seal = xxhash.xxh3_128()
    with (folder / CHECKSUMS).open("wb") as file:
        for path in _files(folder):
            line = f"{seal_of(folder / path)[1]}  {path}\n".encode()
            seal.update(line)
            file.write(line)
        file.write(f"# {seal.hexdigest()}\n".encode())


def damaged_files(folder: Path) -> Iterator[str]:
    """What of a folder is not as it was listed: files that are missing, changed, or too many."""
    try:
        listed = sum(1 for _ in _lines(folder))  # the list itself is proved first
        for digest, path in _lines(folder):
            found = _digest(folder / path)
            if found != digest:
                yield f"{path}: expected digest {digest[:12]}, found {(found and found[:12]) or 'no such file'}: {AGAIN}"
    except (OSError, ValueError) as error:
        yield f"{CHECKSUMS}: expected the digests of all files, found {error}: {AGAIN}"
        return
    there = sum(1 for _ in _files(folder))
    if there > listed:
        known = {path for _, path in _lines(folder)}
        yield from (f"{path}: expected no such file: {AGAIN}" for path in _files(folder) if path not in known)


def _lines(folder: Path) -> Iterator[tuple[str, str]]:
    """Digest and path of every file that is listed; raises ValueError at the end where the list was changed."""
    seal, last = xxhash.xxh3_128(), b""
    with (folder / CHECKSUMS).open("rb") as file:
        for line in file:
            if last:
                seal.update(last)
                digest, _, path = last.decode().removesuffix("\n").partition("  ")
                yield digest, path
            last = line
    if last != f"# {seal.hexdigest()}\n".encode():
        raise ValueError("a list that was changed since it was written")


def _digest(file: Path) -> str | None:
    return seal_of(file)[1] if file.is_file() else None


def _files(folder: Path) -> Iterator[str]:
    """All files but the list, by their paths, in an order that does not depend on the disk."""
    for place, folders, names in os.walk(folder):
        folders.sort()
        inside = Path(place).relative_to(folder)
        yield from (path for path in ((inside / name).as_posix() for name in sorted(names)) if path != CHECKSUMS)
