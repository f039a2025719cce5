"""Files of compiled kernels, identified by the content of their sources: neither the path nor the date of a source matters.

    <kernels>/<digest of sources and build>/<kernel>-<digest of its types>.kernel

An entry holds a pickle, which could run any program. So entries are loaded only from the package itself and from folders that
no other user can write. A digest at an entry's start detects incomplete entries; these are compiled again.
"""

from __future__ import annotations

import hashlib
import multiprocessing
import os
import sys
import tempfile
import zlib
from contextlib import suppress
from functools import cache
from pathlib import Path
from stat import S_ISLNK, S_ISREG, S_IWGRP, S_IWOTH

from viewsphere.caches import cache_of
from viewsphere.caches.entries import making, note_use

SHIPPED = Path(__file__).with_name("shipped")
"""The folder of entries that wheels include; source distributions have none."""

SUFFIX = ".kernel"
_DIGEST = hashlib.sha256().digest_size
_OPEN = os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0)
_LEVEL = 6  # 4.1 MB of a frame's kernels become 1.5; a faster level saves little compared to compiling


def kernel_folder() -> Path:
    """Return the folder of compiled kernels: `$NUMBA_CACHE_DIR`, `$VIEWSPHERE_CACHE/kernels`, or a folder in the user's cache
    folder.
    """
    if os.environ.get("NUMBA_CACHE_DIR"):
        return Path(os.environ["NUMBA_CACHE_DIR"])
    return cache_of("kernels")


def _folders() -> tuple[Path, ...]:
    """The folders in which entries are searched and written, with a temporary one if the first cannot be written."""
    first = kernel_folder()
    if _make(first):
        return (first,)
    return first, Path(tempfile.gettempdir()) / f"viewsphere-{_user()}" / "kernels"


def load(name: str) -> bytes | None:
    """The content of the entry of this name, None if it is missing, incomplete or not trusted."""
    for folder in (SHIPPED, *_folders()):
        data = _read(folder, name)
        if data is not None and hashlib.sha256(data[_DIGEST:]).digest() == data[:_DIGEST]:
            if folder != SHIPPED:
                note_use(folder / name)
            return zlib.decompress(data[_DIGEST:])
    return None


def save(name: str, content: bytes) -> None:
    """Store an entry if possible. Other processes see it completely or not at all, even if several write it at once."""
    packed = zlib.compress(content, _LEVEL)
    data = hashlib.sha256(packed).digest() + packed
    for folder in _folders():
        if _make(folder) and _make((folder / name).parent):
            with suppress(OSError):  # full
                _write(folder, name, data)
                return


def has(name: str) -> bool:
    """True if an entry of this name, complete or damaged, is in a folder that `load` searches."""
    return any(_is_trusted(folder, name) and os.access(folder / name, os.R_OK) for folder in (SHIPPED, *_folders()))


def _is_private(about: os.stat_result) -> bool:
    """True if only this user and root can write a file or folder; always True on systems without file owners."""
    return _is_owned(about) and (not hasattr(os, "geteuid") or not about.st_mode & (S_IWGRP | S_IWOTH))


def _is_owned(about: os.stat_result) -> bool:
    return not hasattr(os, "geteuid") or about.st_uid in (0, os.geteuid())


def _read(folder: Path, name: str) -> bytes | None:
    """The bytes of a trusted file. Owner and mode are checked on the open file, so that nobody can swap it meanwhile."""
    try:
        if not _is_trusted(folder, name):
            return None
        with os.fdopen(os.open(folder / name, _OPEN), "rb") as file:
            about = os.fstat(file.fileno())
            return file.read() if S_ISREG(about.st_mode) and (folder == SHIPPED or _is_private(about)) else None
    except OSError:
        return None


def _is_trusted(folder: Path, name: str) -> bool:
    """True if the folders of an entry belong to this user alone. A package is as trustworthy as the code beside it."""
    return folder == SHIPPED or (_is_own(folder) and _is_own((folder / name).parent))


def _is_own(folder: Path) -> bool:
    try:
        about = folder.lstat()
        if S_ISLNK(about.st_mode) and folder == kernel_folder() and _is_owned(about):  # users may link their cache elsewhere
            about = folder.stat()
    except OSError:
        return False
    if not _is_private(about):
        _warn(folder)
        return False
    return True


@cache
def _warn(folder: Path) -> None:
    """Warn once, in a run's first process, that a folder's kernels are not loaded."""
    if multiprocessing.parent_process() is None:
        problem = f"{folder}: others can write this folder, so that kernels in it are not used and are compiled elsewhere"
        sys.stderr.write(f"warning: {problem}. Allow it to yourself alone: chmod 700 {folder}\n")


def _make(folder: Path) -> bool:
    """Make a folder, and return True if it exists and only this user can write it."""
    try:
        if not folder.is_dir():
            folder.parent.mkdir(parents=True, exist_ok=True)
            folder.mkdir(mode=0o700, exist_ok=True)
    except OSError:
        return False
    return _is_own(folder) and os.access(folder, os.W_OK)


def _write(folder: Path, name: str, data: bytes) -> None:
    """Write an entry that this user alone may write, whatever the umask."""
    with making(folder / name, folder) as half:
        descriptor = os.open(half, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_NOFOLLOW", 0), 0o600)
        with os.fdopen(descriptor, "wb") as stream:
            stream.write(data)


def _user() -> str:
    return str(os.geteuid()) if hasattr(os, "geteuid") else Path.home().name
