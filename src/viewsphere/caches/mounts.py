"""The mounted file systems that Linux lists."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path

from viewsphere.files import read_text

LOCAL = frozenset({"bcachefs", "btrfs", "ext2", "ext3", "ext4", "f2fs", "overlay", "tmpfs", "xfs", "zfs"})
"""Types of file systems, as in proc_mounts(5), whose files only this machine changes."""

MOUNTS = Path("/proc/self/mounts")


def is_local(file: Path) -> bool:
    """True if a file is on a file system that certainly belongs to this machine alone."""
    path = os.path.realpath(file)
    best = max((mount for mount in _mounts() if _is_below(path, mount[0])), key=lambda mount: len(mount[0]), default=("", ""))
    return best[1] in LOCAL


@cache
def _mounts() -> tuple[tuple[str, str], ...]:
    """The folder and the type of each mounted file system; empty if the system lists none."""
    try:
        lines = read_text(MOUNTS, "MAX_TABLE_BYTES").splitlines()
    except (OSError, ValueError):
        return ()
    fields = (line.split(" ") for line in lines)
    return tuple((part[1].encode().decode("unicode_escape"), part[2]) for part in fields if len(part) > 2)


def _is_below(path: str, folder: str) -> bool:
    return path == folder or path.startswith(folder.rstrip("/") + "/")
