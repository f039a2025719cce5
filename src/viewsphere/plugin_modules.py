"""The modules of plug-ins: those of a package, and those that the entry points of installed packages name.

`viewsphere.plugins` loads plug-ins by these; lenses, which models have, lie below it and load themselves.
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
"""Groups of entry points, and packages, whose contents are remembered: more than there are kinds of plug-ins."""


def listed(package: str) -> tuple[tuple[str, bool], ...]:
    """Names of a package's modules, and whether each is a package itself; listed again after its folder was changed."""
    return _modules_in(changes(importlib.import_module(package).__path__))


@lru_cache(maxsize=MOST_GROUPS)
def _modules_in(paths: Changes) -> tuple[tuple[str, bool], ...]:
    return tuple((m.name, m.ispkg) for m in pkgutil.iter_modules([path for path, _ in paths]))


def entry_points(group: str) -> metadata.EntryPoints:
    """The installed entry points of this group.

    Those of all packages are read once, and again after one was installed or removed: reading them takes 10 ms.
    """
    return of_group(changes(sys.path), group)


Changes = tuple[tuple[str, int], ...]
"""Folders, and when each was last changed."""


@lru_cache(maxsize=MOST_GROUPS)
def of_group(paths: Changes, group: str) -> metadata.EntryPoints:
    """The entry points of this group, of the packages in folders as they were last changed at these times."""
    return _installed(paths).select(group=group)


@lru_cache(maxsize=1)
def _installed(_paths: Changes) -> Any:
    """Entry points of the packages in these folders, as they were last changed at these times."""
    return metadata.entry_points()


def changes(paths: Iterable[str]) -> Changes:
    """When each of these folders was last changed."""
    return tuple((path, _changed(path)) for path in paths)


def _changed(path: str) -> int:
    """Return the time at which a folder was last changed, ns; 0 if there is no folder."""
    try:
        # Asked a thousand times a run: making a Path takes longer than the system's answer.
        return os.stat(path or ".").st_mtime_ns  # noqa: PTH116
    except OSError:
        return 0
