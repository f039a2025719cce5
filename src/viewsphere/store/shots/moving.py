"""Moves a file or a folder into place in one step, on Windows too; on request, it also survives a crash of the machine.

A file system delays and reorders writes: after a crash of the machine (not of a program), a folder may exist whose files are
empty, or a finished folder may be missing. With `VIEWSPHERE_DURABILITY=fsync`, files are flushed to the disk before they are
moved, and their parent folders afterwards: existing folders are then complete, and finished ones exist.
"""

from __future__ import annotations

import errno
import os
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

from viewsphere.errors import UserError

DURABILITY = "VIEWSPHERE_DURABILITY"
"""The environment variable that requests durability; child processes inherit it."""

DURABILITIES = ("none", "fsync")
"""Values of the variable; the first is the default."""

AT_ONCE = 8
"""Number of files that are flushed in parallel, which takes a quarter of the time of flushing one by one."""

WAITS_S = (0.02, 0.05, 0.1, 0.2, 0.4, 0.8) if os.name == "nt" else ()
"""Seconds before each further try. Windows refuses to move files that another program has open, and virus scanners and indexers
open new files.
"""

NOT_OURS = {errno.EACCES, errno.EPERM, errno.EINVAL, errno.ENOTSUP, errno.EOPNOTSUPP}
"""Errors for folders that we may not flush to the disk, or that their file system cannot flush, such as automatic mounts."""


def durability() -> str:
    """Return the requested durability; raises UserError for an unknown one."""
    asked = os.environ.get(DURABILITY) or DURABILITIES[0]
    if asked not in DURABILITIES:
        raise UserError(f"{DURABILITY}: expected {' or '.join(DURABILITIES)}; found {asked!r}")
    return asked


def move(source: Path, target: Path) -> None:
    """Rename `source`; it replaces a file at `target`, but not a folder.

    Raises OSError; for temporary refusals, after the last try (`WAITS_S`).
    """
    write_through(source)
    _rename(source, target)
    if durability() == "fsync":
        for folder in target.parents:
            _write_entries(folder)


def write_through(path: Path) -> None:
    """Flush a file, or a folder with its content and then its entries, to the disk, if durability is requested; raises
    OSError.
    """
    if durability() != "fsync":
        return
    if not path.is_dir():
        _sync(path)
        return
    inside = list(os.walk(path, topdown=False))
    with ThreadPoolExecutor(AT_ONCE) as pool:
        for _ in pool.map(_sync, (Path(top, name) for top, _, names in inside for name in names)):
            pass
    for folder, _, _ in inside:
        _write_entries(Path(folder))


def _rename(source: Path, target: Path) -> None:
    for seconds in WAITS_S:
        try:
            os.replace(source, target)  # noqa: PTH105, the one place that renames
            return
        except PermissionError:
            time.sleep(seconds)
    os.replace(source, target)  # noqa: PTH105


def _write_entries(folder: Path) -> None:
    """Flush a folder's entries to the disk, where that is permitted."""
    if os.name != "nt":  # which keeps them with the files
        try:
            _sync(folder)
        except OSError as error:
            if error.errno not in NOT_OURS:
                raise


def _sync(path: Path) -> None:
    descriptor = os.open(path, os.O_RDWR if os.name == "nt" else os.O_RDONLY)
    try:
        if sys.platform == "darwin":
            import fcntl

            with suppress(OSError):  # network file systems have none
                fcntl.fcntl(descriptor, fcntl.F_FULLFSYNC)  # fsync leaves it in the disk's own memory there
                return
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
