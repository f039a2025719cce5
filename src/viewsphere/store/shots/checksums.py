"""The digests of an export's files, one line a file, in a self-checking file that `xxhsum --check` also reads.

    # options {"category_ids":"contiguous"}         the export's format options, if the format has any
    # keep_annotations_above 0.1                    the visibility, for an export that leaves annotations out
    # credits "0c94a3..."                           the digest of CREDITS.md, for an export that names credits
    # frames 12                                     the number of frames, all those finished at the time
    6f0c3b...  annotations/instances_train.json
    # 91d2...

Reading needs memory for one line only. The last line is the digest of all lines above.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from itertools import islice, takewhile
from pathlib import Path
from typing import Any

import xxhash

from viewsphere.errors import StoreError
from viewsphere.files import open_file, open_text
from viewsphere.store.paths import file_inside
from viewsphere.store.shots.manifest import seal_of
from viewsphere.store.texts import parsed
from viewsphere.urls import files_below

CHECKSUMS = "checksums.xxh128"
"""Name of the file in an export's folder."""

AT_ONCE = 8
"""Number of files that are read in parallel: disks and storages are faster so."""

OPTIONS = "# options "
KEPT = "# keep_annotations_above "
CREDITED = "# credits "
FRAMES = "# frames "
AGAIN = "export again, or mend it with viewsphere check --repair"


def write_checksums(
    folder: Path,
    options: Mapping[str, Any] | None = None,
    least: float | None = None,
    credited: str | None = None,
    frames: int | None = None,
) -> None:
    """List all files of a finished folder, with the export's options, the visibility above which it keeps annotations (None:
    all), the digest of its credits (None: no credits), and its number of frames.
    """
    seal = xxhash.xxh3_128()
    with (folder / CHECKSUMS).open("wb") as file:
        for line in _to_write(folder, options or {}, least, credited, frames):
            seal.update(line)
            file.write(line)
        file.write(f"# {seal.hexdigest()}\n".encode())


def _to_write(
    folder: Path, options: Mapping[str, Any], least: float | None, credited: str | None, frames: int | None
) -> Iterator[bytes]:
    if options:
        yield f"{OPTIONS}{json.dumps(options, separators=(',', ':'))}\n".encode()
    if least is not None:
        yield f"{KEPT}{json.dumps(least)}\n".encode()
    if credited is not None:
        yield f"{CREDITED}{json.dumps(credited)}\n".encode()
    if frames is not None:
        yield f"{FRAMES}{frames}\n".encode()
    yield from (f"{seal_of(folder / path)[1]}  {path}\n".encode() for path in _files(folder))


def written_options(folder: Path) -> dict[str, Any]:
    """The options of a folder's export; empty without a readable list."""
    return _said(folder, OPTIONS) or {}


def written_least(folder: Path) -> float | None:
    """The visibility above which a folder's files have annotations; None: they have all."""
    return _said(folder, KEPT)


def written_credits(folder: Path) -> str | None:
    """The digest of the credits in a folder's export; None if it has no credits."""
    return _said(folder, CREDITED)


def written_frames(folder: Path) -> int | None:
    """Return the number of frames in a folder's files when they were written; None if unknown."""
    return _said(folder, FRAMES)


def _said(folder: Path, mark: str) -> Any:
    """Return the value in a line at the list's head; None without such a line, or without a readable list."""
    with suppress(OSError, ValueError), open_text(folder / CHECKSUMS) as file:
        head = takewhile(lambda line: line.startswith("# "), file)
        return next((parsed(line.removeprefix(mark)) for line in head if line.startswith(mark)), None)
    return None


def damaged_files(folder: Path) -> Iterator[str]:
    """Yield the differences of a folder from its list: files that are missing, changed, or additional."""
    try:
        listed = sum(1 for _ in _lines(folder))  # the list itself is verified first
        for digest, path, found in _compared(folder):
            if found != digest:
                yield f"{path}: expected digest {digest[:12]}, found {(found and found[:12]) or 'no such file'}: {AGAIN}"
    except (OSError, ValueError, StoreError) as error:
        yield f"{CHECKSUMS}: expected the digests of all files, found {error}: {AGAIN}"
        return
    there = sum(1 for _ in _files(folder))
    if there > listed:
        known = {path for _, path in _lines(folder)}
        yield from (f"{path}: expected no such file: {AGAIN}" for path in _files(folder) if path not in known)


def _compared(folder: Path) -> Iterator[tuple[str, str, str | None]]:
    """Listed digest, path and actual digest of every listed file; several files are read in parallel."""
    lines = _lines(folder)
    with ThreadPoolExecutor(AT_ONCE) as pool:
        while some := list(islice(lines, AT_ONCE * 16)):
            digests = pool.map(_digest, (file_inside(folder, path) for _, path in some))
            yield from ((*line, has) for line, has in zip(some, digests, strict=True))


def _lines(folder: Path) -> Iterator[tuple[str, str]]:
    """Digest and path of every listed file; raises ValueError at the end if the list was changed."""
    seal, last = xxhash.xxh3_128(), b""
    with open_file(folder / CHECKSUMS) as file:
        for line in file:
            if last:
                seal.update(last)
                digest, _, path = last.decode().removesuffix("\n").partition("  ")
                if not digest.startswith("#"):
                    yield digest, path
            last = line
    if last != f"# {seal.hexdigest()}\n".encode():
        raise ValueError("a list that was changed since it was written")


def _digest(file: Path) -> str | None:
    return seal_of(file)[1] if file.is_file() else None


def _files(folder: Path) -> Iterator[str]:
    """Yield all files but the list, by their paths, in an order that does not depend on the disk."""
    return (path for path in files_below(folder) if path != CHECKSUMS)
