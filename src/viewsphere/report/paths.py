"""A page is shown to others: it names files, not where on somebody's machine they are."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import PurePath, PurePosixPath, PureWindowsPath
from typing import Any, cast

FOLDERS = re.compile(r"(?<![\w./:~\\-])(?:/(?:[^/\s'\",:;()]+/)+|[A-Za-z]:[\\/](?:[^\\/\s'\",:;()]+[\\/])+)(?=[^/\\\s])")
"""The folders of an absolute path, as POSIX and as Windows write one, before the name of its file."""


KINDS: tuple[type[PurePath], ...] = (PurePosixPath, PureWindowsPath)


def without_folders(value: Any) -> Any:
    """Plain data whose texts have no absolute path: of each only the last name is left. Where a path ends in a text is guessed,
    so a folder whose name has a space may be left.
    """
    return _changed(value, lambda text: FOLDERS.sub("", text))


def only_names(value: Any) -> Any:
    """Plain data, such as a recipe, whose texts that are absolute paths from end to end are their last names."""
    return _changed(value, _name)


def _name(text: str) -> str:
    return next((path.name for path in (kind(text) for kind in KINDS) if path.is_absolute()), text)


def _changed(value: Any, change: Callable[[str], str]) -> Any:
    if isinstance(value, str):
        return change(value)
    if isinstance(value, Mapping):
        return {key: _changed(item, change) for key, item in cast(Mapping[str, Any], value).items()}
    if isinstance(value, (list, tuple)):
        return [_changed(item, change) for item in cast(list[Any], value)]
    return value
