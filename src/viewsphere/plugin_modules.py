"""The modules of plug-ins: the modules of a package, and those named by the entry points of installed packages.

`viewsphere.plugins` uses these functions to load plug-ins. Lenses are imported below that layer, so they use the functions
directly.
"""

from __future__ import annotations

import importlib
import os
import pkgutil
import sys
from collections.abc import Iterable
from functools import lru_cache
from importlib import metadata
from typing import Any

PACKAGES = "viewsphere.packages"
"""The group of entry points that name packages of plug-ins, each by its kind."""

MOST_GROUPS = 32
"""Number of entry-point groups, and of packages, whose contents are cached: more than there are kinds of plug-ins."""


def listed(package: str) -> tuple[str, ...]:
    """Names of a package's modules. The list is renewed after the folder changes."""
    return _modules_in(changes(importlib.import_module(package).__path__))


@lru_cache(maxsize=MOST_GROUPS)
def _modules_in(paths: Changes) -> tuple[str, ...]:
    return tuple(m.name for m in pkgutil.iter_modules([path for path, _ in paths]))


def entry_points(group: str) -> metadata.EntryPoints:
    """The installed entry points of this group.

    The entry points of all packages are read once, and again after a package was installed or removed, since reading takes 10
    ms.
    """
    return of_group(changes(sys.path), group)


Changes = tuple[tuple[str, int], ...]
"""Folders and their modification times."""


@lru_cache(maxsize=MOST_GROUPS)
def of_group(paths: Changes, group: str) -> metadata.EntryPoints:
    """The entry points of this group in the packages of these folders, cached by modification time."""
    return _installed(paths).select(group=group)


@lru_cache(maxsize=1)
def _installed(_paths: Changes) -> Any:
    """All entry points of the packages in these folders, cached by modification time."""
    return metadata.entry_points()


def changes(paths: Iterable[str]) -> Changes:
    """The modification times of these folders."""
    return tuple((path, _changed(path)) for path in paths)


def _changed(path: str) -> int:
    """Return the time at which a folder was last changed, ns; 0 if there is no folder."""
    try:
        # Called a thousand times per run: making a Path takes longer than the system call.
        return os.stat(path or ".").st_mtime_ns  # noqa: PTH116
    except OSError:
        return 0
