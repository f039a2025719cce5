"""Files of plain data: JSON and numpy arrays, which processes that read a file share in memory.

    4 bytes    MAGIC
    16 bytes   xxh128 of all that follows
    8 bytes    length of the head, little endian
    head       JSON: {"about": ..., "arrays": {name: [dtype, shape, offset]}}
    arrays     C-contiguous, at their offsets from the first multiple of LINE bytes behind the head

Nothing in a file is executed: arrays hold numbers, and their places are checked against the file's length.
"""

from __future__ import annotations

import ctypes
import json
import math
import mmap
import os
import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from io import BufferedReader
from pathlib import Path
from typing import Any

import numpy as np
import xxhash
from numpy.typing import NDArray

from viewsphere.files import open_file, read_text

LOCAL = frozenset({"bcachefs", "btrfs", "ext2", "ext3", "ext4", "f2fs", "overlay", "tmpfs", "xfs", "zfs"})
"""Types of file systems, as in proc_mounts(5), whose files only this machine changes."""

_MAP_FIXED = 0x10  # sys/mman.h of Linux; Python's mmap has no such flag

MOUNTS = Path("/proc/self/mounts")

MAGIC = b"VSA1"
MAPPED_BYTES = 1 << 16 if sys.platform == "linux" else 1 << 20
"""Size in bytes from which a file is mapped. On Linux, most bytes of a town's models are in files of at least 64 kB.
Elsewhere each mapping holds an open file, and a process may have 1,024 of them. Truncating a mapped file in place ends the
processes that map it; viewsphere itself only replaces and deletes files.
"""

LINE = 64
"""Bytes of a processor's cache line, at which every array begins."""

_DIGEST_BYTES, _LENGTH_BYTES = 16, 8
_START = len(MAGIC) + _DIGEST_BYTES
_NUMBERS = re.compile("[<>|][biuf][1248]")
_OCTAL = re.compile(r"\\([0-7]{3})")  # a blank, tab, line end or backslash in the table of mounts, see fstab(5)
"""numpy's names of the dtypes that arrays may have. Other texts are rejected, since numpy might interpret them in unforeseen
ways.
"""

Arrays = Mapping[str, NDArray[Any]]


class DamagedError(ValueError):
    """A file that is incomplete or has another format."""


@dataclass(frozen=True)
class Content:
    """The content of a file: plain JSON, and arrays by name. Changes of an array stay in this process."""

    about: Any
    arrays: Arrays


def write_arrays(file: Path, about: Any, arrays: Arrays) -> int:
    """Write a new file, and return its size in bytes. Raises OSError if writing fails."""
    blocks = {name: np.ascontiguousarray(values) for name, values in arrays.items()}
    head = _head(about, blocks)
    digest = xxhash.xxh3_128(head)
    with file.open("wb") as stream:
        stream.write(MAGIC + bytes(_DIGEST_BYTES) + head)
        for values in blocks.values():
            for part in (_filling(stream.tell()), _bytes(values)):
                digest.update(part)
                stream.write(part)
        size = stream.tell()
        stream.seek(len(MAGIC))
        stream.write(digest.digest())
    return size


def read_arrays(file: Path) -> Content:
    """The content of a file. Raises DamagedError for an incomplete file and OSError if it cannot be opened."""
    with open_file(file) as stream:
        whole = _mapped(stream, file)
    if bytes(whole[: len(MAGIC)]) != MAGIC or len(whole) < _START + _LENGTH_BYTES:
        raise DamagedError(f"{file}: not a file of arrays")
    if xxhash.xxh3_128(whole[_START:]).digest() != bytes(whole[len(MAGIC) : _START]):
        raise DamagedError(f"{file}: damaged")
    _release_pages(whole)
    try:
        begin = _START + _LENGTH_BYTES
        length = int.from_bytes(whole[_START:begin], "little")
        head = json.loads(bytes(whole[begin : begin + length]))
        data = whole[begin + length + len(_filling(begin + length)) :]
        return Content(head["about"], {name: _array(data, *place) for name, place in head["arrays"].items()})
    except (ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError) as error:
        raise DamagedError(f"{file}: damaged ({error})") from None


def _head(about: Any, blocks: Arrays) -> bytes:
    """The head of the entry, preceded by its length."""
    places: dict[str, list[Any]] = {}
    at = 0
    for name, values in blocks.items():
        places[name] = [values.dtype.str, list(values.shape), at]
        at += values.nbytes + -values.nbytes % LINE
    text = json.dumps({"about": about, "arrays": places}).encode()
    return len(text).to_bytes(_LENGTH_BYTES, "little") + text


def _filling(at: int) -> bytes:
    """The bytes up to the next multiple of LINE."""
    return bytes(-at % LINE)


def _bytes(values: NDArray[Any]) -> memoryview:
    return values.reshape(-1).view(np.uint8).data if values.size else memoryview(b"")


def _array(data: memoryview, dtype: str, shape: list[int], at: int) -> NDArray[Any]:
    kind, count = number_type(dtype), math.prod(shape)
    if min(shape, default=0) < 0 or at < 0 or at + count * kind.itemsize > len(data):
        raise ValueError(f"an array of {dtype} {shape} at {at}")
    return np.frombuffer(data, kind, count, at).reshape(shape) if count else np.empty(shape, kind)


def number_type(name: str) -> np.dtype[Any]:
    """The numeric dtype of this name. Raises ValueError for any other name, and TypeError if the name is not a string."""
    if not _NUMBERS.fullmatch(name):
        raise ValueError(f"numbers of type {name!r}")
    return np.dtype(name)


def _mapped(stream: BufferedReader, file: Path) -> memoryview:
    """Return all bytes of a file. A large file is mapped, and copied on write: processes share its memory. A file on another
    machine is read instead: if that machine deleted it, a process that maps it would end.
    """
    size = os.fstat(stream.fileno()).st_size
    if size >= MAPPED_BYTES and is_local(file):
        if sys.platform != "linux":
            return memoryview(mmap.mmap(stream.fileno(), size, access=mmap.ACCESS_COPY))
        pages = mmap.mmap(-1, size, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
        if map_over(np.frombuffer(pages, np.uint8).ctypes.data, size, stream.fileno()):
            return memoryview(pages)
    return memoryview(bytearray(stream.read()))


def map_over(address: int, size: int, descriptor: int) -> bool:
    """Map a file, copied on write, over pages at an address that a mapping of this process holds, and return whether this
    worked. Such a mapping holds no open file, unlike those of Python's `mmap`. Linux only.
    """
    protection, flags = mmap.PROT_READ | mmap.PROT_WRITE, mmap.MAP_PRIVATE | _MAP_FIXED
    return _system_map()(address, size, protection, flags, descriptor, 0) == address


@cache
def _system_map() -> Any:
    """mmap(2), which can map a file at a given address."""
    function = ctypes.CDLL(None).mmap
    function.restype = ctypes.c_void_p
    function.argtypes = [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int, ctypes.c_int, ctypes.c_int, ctypes.c_long]
    return function


def is_local(file: Path) -> bool:
    """True if a file is on a file system that certainly belongs to this machine alone."""
    path = os.path.realpath(file)
    best = max((mount for mount in _mounts() if _is_below(path, mount[0])), key=lambda mount: len(mount[0]), default=("", ""))
    return best[1] in LOCAL


@cache
def _mounts() -> tuple[tuple[str, str], ...]:
    """The folder and the type of each mounted file system, the latest first, as it hides earlier ones at its folder; empty if
    the system lists none.
    """
    try:
        lines = read_text(MOUNTS, "MAX_TABLE_BYTES").splitlines()
    except (OSError, ValueError):
        return ()
    fields = [line.split(" ") for line in lines]
    return tuple((_OCTAL.sub(lambda code: chr(int(code[1], 8)), part[1]), part[2]) for part in fields[::-1] if len(part) > 2)


def _is_below(path: str, folder: str) -> bool:
    return path == folder or path.startswith(folder.rstrip("/") + "/")


def _release_pages(whole: memoryview) -> None:
    """Release the pages of a mapped file that the computation of its digest has read. Those that are used come back from the
    system's cache of files, in blocks; most of a town's textures and baked light never are.
    """
    if isinstance(whole.obj, mmap.mmap) and sys.platform == "linux":  # elsewhere, this may discard the content
        whole.obj.madvise(mmap.MADV_DONTNEED)
