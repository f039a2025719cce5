"""Files and folders at URLs of any kind that fsspec supports (`s3://`, `gs://`, `az://`, `memory://`, ...), read like those on
a disk.

A root is a path, and all other names are relative to it. A root on a disk is a `pathlib.Path`; a root at a URL is a
`RemotePath`. The latter has only the methods of a Path that read and list, so that no call changes the disk by mistake:

    read    path.read_bytes(), path.read_text(), path.open() in blocks; `byte_range` of a file
    list    path.iterdir(), path.glob(), path.is_file(), path.is_dir(), path.stat(); `files_below` a folder
    link    `link_file`: hard links on one disk, else a copy
    local   `here`: a file or folder for programs that need it on this machine
"""

from __future__ import annotations

import os
import re
import shutil
import sys
from collections.abc import Generator, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from viewsphere.errors import UserError
from viewsphere.files import check_file, open_file
from viewsphere.printable import is_utf8, printable
from viewsphere.scratch import temporary
from viewsphere.urls.remote_path import BLOCK
from viewsphere.urls.remote_path import RemotePath as RemotePath

_URL = re.compile(r"[A-Za-z][A-Za-z0-9+.:-]+:/")
"""Start of a URL, also if pathlib has merged its two slashes; drives of Windows have one letter."""


def located(root: str | os.PathLike[str]) -> Path:
    """The path of a data set's root: a folder's path, or a `RemotePath` for a URL. Raises UserError for a URL with a password,
    which would be displayed and stored.
    """
    if isinstance(root, RemotePath):
        return root
    text = os.fspath(root)
    if not is_utf8(text):
        raise UserError(f"the name {printable(text)} is not UTF-8. Choose another name for the folder")
    if not _URL.match(text):
        return Path(root)
    if text.startswith("file:"):
        return Path("/" + text.removeprefix("file:").lstrip("/"))
    return RemotePath.from_url(text)


def files_below(folder: Path) -> Iterator[str]:
    """Paths, relative to a folder, of all files in it and below, in an order that does not depend on the disk."""
    if isinstance(folder, RemotePath):
        yield from folder.files_below()
        return
    for place, folders, names in os.walk(folder):
        folders.sort()
        inside = Path(place).relative_to(folder)
        yield from ((inside / name).as_posix() for name in sorted(names))


def byte_range(file: Path, start: int, size: int) -> bytes:
    """`size` bytes of a file from `start` on, fewer if the file ends before; raises OSError if reading fails."""
    if isinstance(file, RemotePath):
        return file.byte_range(start, size)
    with open_file(file) as stream:
        held = os.fstat(stream.fileno()).st_size
        stream.seek(min(start, held))
        return stream.read(max(0, min(size, held - start)))


@contextmanager
def here(path: Path) -> Generator[Path]:
    """A file or folder on this machine for the duration of the block: the path itself, or a copy of the same name if it is at a
    URL.
    """
    if not isinstance(path, RemotePath):
        yield path
        return
    with temporary("copy") as folder:
        copy = folder / path.name
        if path.is_file():
            download(path, copy)
        else:
            for inside in path.files_below():
                download(path / inside, copy / inside)
        yield copy


def download(file: Path, destination: Path, most: int = sys.maxsize) -> bool:
    """Copy a file from a URL to a disk, block by block, up to `most` bytes; return True if that is the whole file."""
    destination.parent.mkdir(parents=True, exist_ok=True)
    with open_file(file) as read, destination.open("wb") as write:
        while block := read.read(min(BLOCK, most + 1)):
            write.write(block[:most])
            most -= len(block)
            if most < 0:
                return False
    return True


def link_file(source: Path, destination: Path) -> str:
    """Put a file at `destination` on a disk, which must not exist: as a `hard link`, else a `reflink`, else a `copy`; return
    which. A file at a URL is a `download`.
    """
    if isinstance(source, RemotePath):
        download(source, destination)
        return "download"
    with suppress(OSError):
        os.link(source, destination)
        return "hard link"
    try:
        import fcntl

        with open_file(source) as read, destination.open("wb") as write:
            fcntl.ioctl(write.fileno(), 0x40049409, read.fileno())  # FICLONE of linux/fs.h
        return "reflink"
    except (ImportError, OSError):
        check_file(source, "MAX_STREAMED_BYTES")
        shutil.copyfile(source, destination)
        return "copy"
