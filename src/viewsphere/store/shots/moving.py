"""Puts a file or a folder in its place in one step, on Windows too; and keeps it there when the machine crashes, if asked to.

A file system writes what it was given when it likes, and in any order: after a crash of the machine (not of a program) a folder
may be in its place whose files are empty, or one is gone that was seen before. With `VIEWSPHERE_DURABILITY=fsync` the files
are written to the disk before they are moved, and the folders that lead to them afterwards: what is there then is whole, and
what was finished is there.
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
"""The variable that asks for it; processes that are started meanwhile have it, too."""

DURABILITIES = ("none", "fsync")
"""Values of the variable; the first is the default."""

AT_ONCE = 8
"""Files that are written to the disk at once, which then does so together: a quarter of the time of one after another."""

WAITS_S = (0.02, 0.05, 0.1, 0.2, 0.4, 0.8) if os.name == "nt" else ()
"""Seconds before each further try. Windows refuses to move what another program has open, and virus scanners and indexers
open what was just written."""

NOT_OURS = {errno.EACCES, errno.EPERM, errno.EINVAL, errno.ENOTSUP, errno.EOPNOTSUPP}
"""Errors for folders that we may not flush to the disk, or that their file system cannot flush, such as automatic mounts."""


def durability() -> str:
    """Return the requested durability; raises UserError for an unknown one."""
    asked = os.environ.get(DURABILITY) or DURABILITIES[0]
    if asked not in DURABILITIES:
        raise UserError(f"{DURABILITY}: expected {' or '.join(DURABILITIES)}; found {asked!r}")
    return asked


def move(source: Path, target: Path) -> None:
    """Rename `source`; a file that is `target` gives way to it, a folder does not.

    Raises OSError; where refusals pass (`WAITS_S`), after the last try.
    """
    write_through(source)
    _rename(source, target)
    if durability() == "fsync":
        for folder in target.parents:
            _write_entries(folder)


def write_through(path: Path) -> None:
    """Have the disk keep a file, or a folder with all that is in it, its entries last, if that is asked for; raises OSError."""
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
    """Have the disk keep which names are in a folder, where that is ours to ask for."""
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
