"""Containment checks for paths from untrusted sources."""

from __future__ import annotations

import re
from pathlib import PurePosixPath, PureWindowsPath

PLAIN = re.compile(r"[\w+-][\w+.-]*(?:/[\w+-][\w+.-]*)*", re.ASCII)
"""Relative paths that mean the same on every system; others are examined more closely."""


def is_inside(relative: str) -> bool:
    """Return whether a path is relative on every system and never leads to a parent folder."""
    if PLAIN.fullmatch(relative):
        return True
    path, on_windows = PurePosixPath(relative), PureWindowsPath(relative)
    return not (path.is_absolute() or on_windows.anchor or ".." in on_windows.parts or "\0" in relative)
