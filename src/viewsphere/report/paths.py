"""The removal of folders from a page: other people see the page, so it names files without their location on a machine."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import PurePath, PurePosixPath, PureWindowsPath
from typing import Any, cast

FOLDERS = re.compile(r"(?<![\w./:~\\-])(?:/(?:[^/\s'\",:;()]+/)+|[A-Za-z]:[\\/](?:[^\\/\s'\",:;()]+[\\/])+)(?=[^/\\\s])")
"""The folders of an absolute path, as POSIX and as Windows write one, before the name of its file."""


KINDS: tuple[type[PurePath], ...] = (PurePosixPath, PureWindowsPath)


def without_folders(value: Any) -> Any:
    """Plain data with each absolute path in its texts reduced to the last name. The end of a path in a text is a guess, so a
    folder with a space in its name may remain.
    """
    return _changed(value, lambda text: FOLDERS.sub("", text))


def only_names(value: Any) -> Any:
    """Plain data, such as a recipe, with texts that are entirely an absolute path reduced to the last name."""
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
