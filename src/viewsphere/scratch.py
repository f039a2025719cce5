"""Scratch folders for unfinished files: each belongs to one process and is removed after that process ends.

    <prefix><host>~<pid>~<random>/lock    held by the process that made the folder, as long as it lives
    <prefix><host>~<pid>~<random>/...     its unfinished files

The system releases a lock when its holder ends in any way, while a process ID is soon reused. So if a process gets the lock of
a folder made on the same host, the folder's maker is dead. For folders of other hosts, and on file systems without locks, this
is unknown: such a folder is kept until nothing in it has changed for a day. A folder whose lock is visibly held is always kept.
"""

from __future__ import annotations

import errno
import glob
import os
import shutil
import socket
import sys
import tempfile
import time
from collections.abc import Generator, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from viewsphere.errors import UserError

LOCK = "lock"
"""Name of the lock file in a scratch folder."""

HALF = "~"
"""Suffix of folders whose removal has begun."""

OPEN = os.O_RDWR | getattr(os, "O_NOFOLLOW", 0)
"""Flags to open the lock file."""

TRIES = 30
"""Attempts to make a folder before an error is raised because none persists."""

STALE_S = 86_400.0
"""Seconds without a change after which a folder of unknown state counts as a dead process's folder."""


@dataclass(frozen=True)
class ScratchDir:
    """A folder of this process, which other users cannot read, and its open lock."""

    folder: Path
    lock: int

    @staticmethod
    def make(place: Path, prefix: str = "") -> ScratchDir:
        """A new folder in this existing place; raises OSError if it cannot be made."""
        for left in reversed(range(TRIES)):
            folder = Path(tempfile.mkdtemp(prefix=prefix + of_this_process(), dir=place))
            try:
                made = ScratchDir(folder, _lock_of(folder, is_sure=left > 0))
            except (FileNotFoundError, BlockingIOError):  # another process sweeps, and considers its maker dead
                with suppress(OSError):
                    (folder / LOCK).unlink(missing_ok=True)
                    folder.rmdir()
            else:
                _held.add(made)
                return made
        raise OSError(errno.EAGAIN, "no folder stays that is made there", str(place))

    def remove(self) -> None:
        """Remove the folder and its contents; a forked copy of the process that made it does nothing."""
        if self in _held:
            gone = _out_of_the_way(self.folder)
            self.leave()
            _delete(gone)

    def leave(self) -> None:
        """Release the folder as a dead process would: the next sweep removes it. A forked copy does nothing."""
        if self in _held:
            _held.remove(self)
            os.close(self.lock)


_held: set[ScratchDir] = set()
"""Scratch folders of this process."""


def of_this_process() -> str:
    """Return the start of the names of this process's folders, behind their prefix."""
    return f"{socket.gethostname()}~{os.getpid()}~"


@contextmanager
def scratch_folder(place: Path, prefix: str = "") -> Generator[Path]:
    """A folder of this process in a place that exists, for the duration of the block; raises OSError if none can be made."""
    made = ScratchDir.make(place, prefix)
    try:
        yield made.folder
    finally:
        made.remove()


@contextmanager
def temporary(what: str) -> Generator[Path]:
    """An empty folder among the system's temporary files, for the duration of the block. Its purpose `what` distinguishes it
    from others; those of dead processes are removed first.
    """
    place, prefix = Path(tempfile.gettempdir()), f"viewsphere-{what}-"
    sweep(place, prefix)
    with scratch_folder(place, prefix) as own:
        folder = own / "new"
        folder.mkdir()
        yield folder


def write_whole(file: Path, data: bytes) -> None:
    """Write a file of these bytes, and the folders it needs. An old file stays unchanged until the new one is complete.

    Raises UserError if the file cannot be written.
    """
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        target = file.resolve()
        if not isinstance(file, Path) or (target.exists() and not target.is_file()):  # at a URL, or a device
            file.write_bytes(data)
        else:
            _replace(target, data)
    except OSError as error:
        raise UserError(f"{file}: expected a place to write, found: {error.strerror or error}") from None


def _replace(target: Path, data: bytes) -> None:
    half = target.with_name(f".unfinished-{os.getpid()}")
    try:
        half.write_bytes(data)
        if target.exists():
            shutil.copymode(target, half)
        half.replace(target)
    except BaseException:
        half.unlink(missing_ok=True)
        raise


def sweep(place: Path, prefix: str = "") -> None:
    """Remove folders left by dead processes in this place."""
    for _ in left_by_dead(place, prefix):
        pass


def left_by_dead(place: Path, prefix: str = "") -> Iterator[Path]:
    """The folders in this place whose makers are dead; each is removed when the next one is requested. Folders whose removal
    has already begun are incomplete: they are removed without being yielded.
    """
    for folder in sorted(path for path in place.glob(f"{glob.escape(prefix)}*~*~*") if not path.is_symlink()):
        is_own = folder.name.startswith(f"{prefix}{socket.gethostname()}~")
        try:
            with _locked(folder / LOCK, OPEN | (os.O_CREAT if is_own else 0)) as taken:
                if not (taken and is_own) and not _is_stale(folder):
                    continue
                if not folder.name.endswith(HALF):
                    yield folder
                gone = _out_of_the_way(folder)
        except BlockingIOError:
            continue
        _delete(gone)


def lives(folder: Path) -> bool | None:
    """Return whether the maker of a folder is alive, or None if that is unknown. The folder must be at its original path and
    have no prefix.
    """
    is_own = folder.name.startswith(f"{socket.gethostname()}~")
    try:
        with _locked(folder / LOCK, OPEN) as taken:
            return False if taken and is_own else None
    except BlockingIOError:
        return True


def _lock_of(folder: Path, is_sure: bool) -> int:
    """The lock of a folder that this process has just made. Raises FileNotFoundError or BlockingIOError if another process
    sweeps it.

    `is_sure`: inode numbers identify files here; some user-space file systems change them all the time.
    """
    try:
        lock = os.open(folder / LOCK, OPEN | os.O_CREAT)
    except FileNotFoundError:
        raise
    except OSError:
        folder.rmdir()
        raise
    try:
        if _take(lock) and not os.path.samestat(os.fstat(lock), (folder / LOCK).stat()) and is_sure:
            raise FileNotFoundError(folder)
    except OSError:
        os.close(lock)
        raise
    return lock


@contextmanager
def _locked(file: Path, flags: int) -> Generator[bool]:
    """Yield True if this process holds the lock during the block, False if that cannot be determined. Raises BlockingIOError if
    another process holds it.
    """
    try:
        lock = os.open(file, flags)
    except OSError:
        yield False
        return
    try:
        yield _take(lock)
    finally:
        os.close(lock)


def _take(lock: int) -> bool:
    """Take a lock, and return True; False if the file system has no locks. Raises BlockingIOError if another process holds
    it.
    """
    try:
        if sys.platform == "win32":
            import msvcrt

            msvcrt.locking(lock, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise
    except ImportError:  # neither Windows nor POSIX
        return False
    except OSError as error:
        if sys.platform == "win32" and isinstance(error, PermissionError):
            raise BlockingIOError(error.errno, "another process has it") from None
        return False  # a system that forbids locks counts as one without
    return True


def _is_stale(folder: Path) -> bool:
    """Return whether nothing in a folder that has a lock has changed for `STALE_S`."""
    try:
        last = max(path.lstat().st_mtime for path in (folder, folder / LOCK, *folder.rglob("*")))
    except OSError:  # it has no lock, or is being changed
        return False
    return last < time.time() - STALE_S


def _out_of_the_way(folder: Path) -> Path:
    """Rename a folder before removing it, so that neither a sweeping process nor a maker that resumes mistakes the remains for
    the complete folder.
    """
    if not folder.name.endswith(HALF):
        with suppress(OSError):  # Windows cannot rename a folder that contains an open file
            return folder.rename(folder.with_name(f"{folder.name}{HALF}"))
    return folder


def _delete(folder: Path) -> None:
    """Delete a folder that no process holds any more, its lock first. If Windows refuses, another process has the lock open and
    removes the folder itself.
    """
    gone = _out_of_the_way(folder)
    try:
        (gone / LOCK).unlink(missing_ok=True)
    except OSError:
        return
    shutil.rmtree(gone, ignore_errors=True)


def _forget() -> None:
    """Close the locks in a forked process, so that they end with the process that made them."""
    for made in _held:
        with suppress(OSError):
            os.close(made.lock)
    _held.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget)
