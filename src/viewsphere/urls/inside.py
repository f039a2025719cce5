"""Paths that a stranger may have written: whether they stay where they belong."""

from __future__ import annotations

import re
from pathlib import PurePosixPath, PureWindowsPath

PLAIN = re.compile(r"[\w+-][\w+.-]*(?:/[\w+-][\w+.-]*)*", re.ASCII)
"""Relative paths that mean the same on every system; other ones are looked at more closely."""


def is_inside(relative: str) -> bool:
    """Return whether a path is relative on every system, and goes up nowhere."""
    if PLAIN.fullmatch(relative):
        return True
    path, on_windows = PurePosixPath(relative), PureWindowsPath(relative)
    return not (path.is_absolute() or on_windows.anchor or ".." in on_windows.parts or "\0" in relative)
